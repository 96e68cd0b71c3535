"""Answers a set with the program stretch: `python3 own.py SET STRETCH submission.json [cases]`

runs `stretch diagnose`, as it ships, on every problem.toml.
"""
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import tomllib

from case import hand_in

VERDICTS = {"no_gap": "none", "parameters": "parameters", "record": "unknown", "effect": "effect", "partial": "effect",
            "unknown": "unknown"}
SETUP = "as shipped, no option but one thread; its thresholds were calibrated on development seeds of the rig alone"


def used_s():
    """Processor time of all child processes that have ended, including workers."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def answer(case, program, places):
    """Runs one diagnosis, and returns the answer in the layout of a submission."""
    with tempfile.TemporaryDirectory() as folder:
        out, began = Path(folder) / "d.json", used_s()
        command = [program, "diagnose", str(case / "problem.toml"), f"--json={out}", "--quiet"]
        alone = {**os.environ, "RAYON_NUM_THREADS": "1"}
        run = subprocess.run(command, env=alone, capture_output=True, text=True, check=False)
        seconds = used_s() - began
        if not out.is_file():
            raise SystemExit(f"{case}: {run.stderr}")
        said = json.loads(out.read_text())
    return converted(said, places, seconds)


def converted(said, places, seconds):
    believed, verdict = {}, VERDICTS[said["verdict"]]
    for candidate in said["candidates"]:
        known = [n for n in candidate["effects"] if n in places] or (["unknown"] if candidate["effects"] else [])
        key = tuple(sorted(known))
        believed[key] = believed.get(key, 0.0) + candidate["probability"]
    total = sum(believed.values()) or 1.0
    believed = believed or {(): 1.0}
    probabilities = [{"effects": list(k), "probability": p / total} for k, p in believed.items()]
    named = sorted(n for n in said["named"] if n in places)
    chosen = next((c for c in said["candidates"] if sorted(c["effects"]) == named), {"closed": 0.0})
    place = places.get(named[0]) if named else None
    closed = min(1.0, max(0.0, chosen["closed"]))
    return {"probabilities": probabilities, "verdict": verdict, "named": named,
            "tied": [n for n in said.get("tied") or [] if n in places], "place": place, "closed_share": closed,
            "seconds": seconds, "simulations": said.get("simulations") or 0}


def main():
    folder, program, out = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
    about = tomllib.loads((folder / "set.toml").read_text())
    places = {c["name"]: c["place"] for c in about["candidate"]}
    names = about["cases"][: int(sys.argv[4]) if len(sys.argv) > 4 else None]
    cases = {}
    for name in names:
        cases[name] = answer(folder / name, program, places)
        hand_in({"schema": 1, "method": "stretch", "setup": SETUP, "set": about["set"], "cases": cases}, out)


if __name__ == "__main__":
    main()
