"""Converts cases of the rig from another generator to the layout of a set, so that `challenge score` can score a run on them.

    python3 foreign_truth.py truth.json REPORTS RIG_SET OUT

`truth.json` holds {"seed", "cases": {name: {"kind", "effects", "stages", "excess"}}}, REPORTS the folder of the
files that `stretch diagnose --json=FILE` wrote, RIG_SET any rig set of the challenge (for the names of candidates).
Writes OUT, OUT-sealed and OUT.json, the submission. A kind is single, null, compound or out_of_catalogue. 
"""
import hashlib
import json
import sys
from pathlib import Path

import tomllib

from own import converted


def level(case):
    """Level in the challenge of a kind of case."""
    single = "faint" if case["excess"] < 1.0 else "strong"
    return {"single": single, "null": "none", "compound": "two", "out_of_catalogue": "foreign"}[case["kind"]]


def main():
    truth, reports, rig, out = (Path(a) for a in sys.argv[1:5])
    read = json.loads(truth.read_text())
    about = tomllib.loads((rig / "set.toml").read_text())
    places = {c["name"]: c["place"] for c in about["candidate"]}
    labels = {name: {"level": level(case), "effects": case["effects"], "places": case["stages"], "excess": case["excess"],
                     "oracle_closed": 0.0 if case["kind"] == "null" else 1.0, "family": "another generator"}
              for name, case in read["cases"].items()}
    sealed = Path(f"{out}-sealed")
    for folder in (out, sealed):
        folder.mkdir(parents=True)
    text = json.dumps({"schema": 1, "plant": "rig", "seed": read["seed"], "candidates": places, "cases": labels}, indent=2) + "\n"
    (sealed / "truth.json").write_text(text)
    seal = hashlib.sha256(text.encode()).hexdigest()
    (out / "seal.sha256").write_text(f"{seal}  truth.json\n")
    said = {name: json.loads((reports / f"{name}.json").read_text()) for name in labels}
    cases = {name: converted(report, places, report["runtime_s"]) for name, report in said.items()}
    answers = {"schema": 1, "method": "stretch", "setup": "reports of another generator's cases", "set": seal, "cases": cases}
    Path(f"{out}.json").write_text(json.dumps(answers, indent=1) + "\n")


if __name__ == "__main__":
    main()
