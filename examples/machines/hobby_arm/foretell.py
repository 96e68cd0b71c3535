"""What is named on three motions of an arm foretells the others.

    python foretell.py FOLDER [--joints rot,pitch] [--drop]

<<<<<<< HEAD
FOLDER is the authors' `output/real/so101/custom`: a folder a motion. Three motions are fitted, the others are looked at once the fit has ended.
For every motion in which a joint is commanded to move: the error with what is named, over that of the re-tuned simulator.
=======
FOLDER is the authors' `output/real/so101/custom`: a folder a motion. Three motions are fitted, and the fix that the diagnosis
gives (parameters and functions) is run on all others. For every motion in which a joint is commanded to move: the error with
the fix, over that of the simulator whose parameters were re-tuned on the same three motions.
>>>>>>> 55a1142 (Python: lines and types of the new modules; the gate looks at the machines as well)
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import record
import simulator
import stretch_gap

STEP_RAD = 2.0 * np.pi / 4096.0


def trials(data: Path, joint: str, every: int) -> tuple[list[stretch_gap.Trial], list[str]]:
    """The fitted motions, then those in which the joint is commanded to move."""
    others = sorted(p.name for p in data.iterdir() if (p / "control.csv").is_file() and p.name not in record.FITTED)
    made, moving = [], []
    for name in (*record.FITTED, *others):
        columns = record.motion(data, name, joint, every)
        if name in record.FITTED or np.ptp(columns["commanded_rad"]) > 0.0:
            made.append(stretch_gap.Trial(columns, name=name, test=name not in record.FITTED))
            moving += [] if name in record.FITTED else [name]
    return made, moving


def diagnosed(data: Path, joint: str, every: int = 1) -> tuple[stretch_gap.Diagnosis, dict[str, float]]:
    """The diagnosis of a joint, and by motion the share of the re-tuned simulator's error that is left."""
    given, moving = trials(data, joint, every)
    found = stretch_gap.diagnose(
        simulator.Servo(),
        given,
        output="measured_rad",
        inputs=["commanded_rad"],
        parameters={
            "tau": stretch_gap.Parameter(0.1, relative=0.5, unit="s", least=0.005),
            "offset": stretch_gap.Parameter(0.0, tolerance=0.05, unit="rad"),
        },
        noise={"measured_rad": STEP_RAD / 12**0.5},
        wrap="all",
        name=joint,
    )
    curves, shares, first = found.curves(), {}, 0
    for trial in given:
        part = slice(first, first := first + len(trial.columns["measured_rad"]))
        measured = curves["measured"][part]
        left = {name: float(np.sqrt(np.mean((curves[name][part] - measured) ** 2))) for name in ("retuned", "with_effects")}
        if trial.name in moving:
            shares[trial.name] = left["with_effects"] / left["retuned"]
    return found, shares


def text(shares: list[float]) -> str:
    values = np.array(shares)
    mean = np.exp(np.mean(np.log(values)))
<<<<<<< HEAD
    return f"{len(values)} motions, geometric mean {mean:.3f}, below 1 in {100 * np.mean(values < 1):.0f} %, worst {values.max():.2f}"
=======
    below = 100 * np.mean(values < 1)
    return f"{len(values)} motions, geometric mean {mean:.3f}, below 1 in {below:.0f} %, greatest {values.max():.2f}"
>>>>>>> 55a1142 (Python: lines and types of the new modules; the gate looks at the machines as well)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--joints", default=",".join(record.JOINTS))
    parser.add_argument("--drop", action="store_true", help="again on every second row")
    args = parser.parse_args()
    every_share: list[float] = []
    for every in (1, 2) if args.drop else (1,):
        for joint in args.joints.split(","):
            begun = time.monotonic()
            found, shares = diagnosed(args.data, joint, every)
            every_share += shares.values() if every == 1 else []
            print(f"{joint}{', every second row' if every == 2 else ''}: {found.sentence}")
<<<<<<< HEAD
            print(f"  named {found.named}, not ruled out {found.rivals}, runs {found.model_runs}, {time.monotonic() - begun:.0f} s")
            print(f"  parameters {found.parameters}\n  effects {found.effects}\n  probabilities {dict(list(found.probabilities.items())[:4])}")
=======
            print(f"  named {found.named}, not ruled out {found.rivals}, runs {found.model_runs}, {seconds:.0f} s")
            print(
                f"  parameters {found.parameters}\n  effects {found.effects}\n  probabilities "
                f"{dict(list(found.probabilities.items())[:4])}"
            )
>>>>>>> 55a1142 (Python: lines and types of the new modules; the gate looks at the machines as well)
            print(f"  {text(list(shares.values()))}")
            worst = sorted(shares.items(), key=lambda item: -item[1])[:6]
            print(f"  least foretold: {', '.join(f'{name} {share:.2f}' for name, share in worst)}", flush=True)
    print(f"all joints: {text(every_share)}")


if __name__ == "__main__":
    main()
