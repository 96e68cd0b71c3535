"""Runs all methods on some sets, case by case, so that all have answered the same cases if the program is stopped. Continues a stopped run.

    python3 field.py OUT STRETCH SET... [--methods stretch,bic]

writes OUT/SET.METHOD.json. Run neural.py and ratio.py before the methods `neural` and `ratio`. Times are processor times and include reading the case.
"""
import argparse
import json
from pathlib import Path

import neural
import own
import ratio
import rivals
import simulated
from case import asked, hand_in, load

RIVALS = rivals.METHODS | simulated.METHODS | neural.METHODS | ratio.METHODS


def put(folder, case, method, program):
    about, plant, _, places = load(folder)
    if method == "stretch":
        return own.answer(folder / case, program, places)
    return asked(folder, case, RIVALS[method][0], plant, places)


def submission(folder, method):
    name, setup = "stretch", own.SETUP
    if method != "stretch":
        function, name = RIVALS[method]
        setup = " ".join(function.__doc__.split())
    return {"schema": 1, "method": name, "setup": setup, "set": load(folder)[0]["set"], "cases": {}}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=Path)
    parser.add_argument("program")
    parser.add_argument("sets", type=Path, nargs="+")
    parser.add_argument("--methods", default=",".join(["stretch", *RIVALS]))
    given = parser.parse_args()
    wanted = [(folder, method) for folder in given.sets for method in given.methods.split(",")]
    files = {(f, m): given.out / f"{f.name}.{m}.json" for f, m in wanted}
    answers = {k: json.loads(p.read_text()) if p.exists() else submission(*k) for k, p in files.items()}
    for number in range(max(len(load(folder)[2]) for folder in given.sets)):
        for folder, method in wanted:
            name, done = f"case-{number:03}", answers[folder, method]
            if name in load(folder)[2] and name not in done["cases"]:
                done["cases"][name] = put(folder, name, method, given.program)
                hand_in(done, files[folder, method])


if __name__ == "__main__":
    main()
