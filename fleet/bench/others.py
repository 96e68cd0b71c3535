"""Measures the time of DuckDB and NumPy on the files that `speed rows FOLDER ...` wrote: python others.py FOLDER

Requires duckdb, numpy and pyarrow (in a separate environment). The shortest of three times counts.
"""

import glob
import sys
import time

import duckdb
import numpy as np
import pyarrow.parquet as pq

folder = sys.argv[1]
files = sorted(glob.glob(f"{folder}/*.parquet"))
rows = sum(pq.read_metadata(file).num_rows for file in files)


def timed(name, threads, work):
    shortest = computed = float("inf")
    for _ in range(3):
        begin, before = time.perf_counter(), time.process_time()
        work()
        shortest = min(shortest, time.perf_counter() - begin)
        computed = min(computed, time.process_time() - before)
    print(f"{name:<34} {threads} threads {shortest:8.3f} s {1e9 * shortest / rows:8.2f} ns a row "
          f"{1e9 * computed / rows:8.2f} ns computed", flush=True)


table = f"read_parquet('{folder}/*.parquet')"
for threads in (1, 2):
    base = duckdb.connect()
    base.execute(f"set threads to {threads}")
    ask = lambda sql: base.execute(sql).fetchall()
    timed("DuckDB scan", threads, lambda: ask(f"select sum(rate), sum(bridge_v), sum(contraction) from {table}"))
    timed("DuckDB regr_slope by sensor", threads, lambda: ask(
        f"select sensor, regr_slope(contraction, bridge_v), regr_intercept(contraction, bridge_v) from {table} group by sensor"))
    # normal equations of poly13: DuckDB sums 28 products and 7 right-hand sides per branch
    terms = ["1.0", "rate", "bridge_v", "rate*bridge_v", "bridge_v*bridge_v", "rate*bridge_v*bridge_v",
             "bridge_v*bridge_v*bridge_v"]
    sums = [f"sum({a}*{b})" for k, a in enumerate(terms) for b in terms[k:]] + [f"sum({a}*contraction)" for a in terms]
    timed("DuckDB normal equations by sensor", threads, lambda: ask(
        f"select sensor, rate < 0, {', '.join(sums)} from {table} group by all"))


def numpy_lines():
    read = pq.read_table(files, columns=["sensor", "bridge_v", "contraction"])
    sensor, v, x = (read[name].to_numpy() for name in ("sensor", "bridge_v", "contraction"))
    for start, end in zip(*bounds(sensor)):
        np.polynomial.polynomial.polyfit(v[start:end], x[start:end], 1)


def numpy_surfaces():
    read = pq.read_table(files, columns=["sensor", "rate", "bridge_v", "contraction"])
    sensor, r, v, x = (read[name].to_numpy() for name in ("sensor", "rate", "bridge_v", "contraction"))
    for start, end in zip(*bounds(sensor)):
        for side in (r[start:end] >= 0, r[start:end] < 0):
            rate, volts = r[start:end][side], v[start:end][side]
            design = np.stack([np.ones_like(rate), rate, volts, rate * volts, volts**2, rate * volts**2, volts**3], 1)
            np.linalg.lstsq(design, x[start:end][side], rcond=None)


def bounds(sensor):
    starts = np.flatnonzero(np.r_[True, sensor[1:] != sensor[:-1]])
    return starts, np.r_[starts[1:], len(sensor)]


timed("pyarrow + NumPy line by sensor", "all", numpy_lines)
timed("pyarrow + NumPy lstsq by sensor", "all", numpy_surfaces)
