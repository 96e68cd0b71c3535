"""Merges the per-effect vectors into one table a trial: a column that an effect leaves as it is in the nominal rig is left out.

Usage: python3 merge.py FOLDER_OF_VECTORS
"""
import csv
import pathlib
import sys

source = pathlib.Path(sys.argv[1])
target = pathlib.Path(__file__).parent
for trial in ("inflation", "deflation", "arbitrary"):
    columns = {}
    names = sorted(p.name[: -len(trial) - 5] for p in source.glob(f"*_{trial}.csv"))
    names.sort(key=lambda n: n != "nominal")
    for name in names:
        rows = list(csv.DictReader(open(source / f"{name}_{trial}.csv")))
        if name == "nominal":
            for key in ("time_s", "inlet", "outlet"):
                columns[key] = [r[key] for r in rows]
        for key in ("pressure_kpa", "length_mm", "bridge_v"):
            column = [r[key] for r in rows]
            if name == "nominal" or column != columns[f"nominal.{key}"]:
                columns[f"{name}.{key}"] = column
    with open(target / f"{trial}.csv", "w") as out:
        out.write("# an independent implementation of the rig, double precision, RK4 with 40 steps a sample; see README.md\n")
        out.write(",".join(columns) + "\n")
        for row in zip(*columns.values()):
            out.write(",".join(row) + "\n")
