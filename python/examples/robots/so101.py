"""What a servo of first order lacks beside the joints of a hobby arm (SO101).

    python so101.py FOLDER [--joints rot,pitch] [--drop]

FOLDER holds NAME_commanded.csv and NAME_measured.csv of three motions. Two are fitted, the third is tested on: what is
named must foretell a motion that it never saw. With --drop every joint is diagnosed again on every second row; the
names should stay.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import stretch_gap

MOTIONS = ("step_response", "multisine", "friction_gravity")
TESTED = "friction_gravity"
JOINTS = ("rot", "pitch", "elbow", "wpitch", "wroll", "jaw")
RATE_HZ = 50.0
STEP_RAD = 2.0 * np.pi / 4096.0


def trials(folder, joint, every=1):
    """Commanded and measured position of a joint on one grid; a command holds until the next one."""
    made = []
    for motion in MOTIONS:
        read = [
            np.genfromtxt(Path(folder) / f"{motion}_{what}.csv", delimiter=",", names=True) for what in ("commanded", "measured")
        ]
        commanded, measured = read
        begin = max(commanded["time_s"][0], measured["time_s"][0])
        end = min(commanded["time_s"][-1], measured["time_s"][-1])
        time_s = np.arange(begin, end, every / RATE_HZ)
        held = np.searchsorted(commanded["time_s"], time_s, side="right") - 1
        columns = {
            "time_s": time_s - begin,
            "commanded_rad": commanded[f"{joint}_rad"][np.maximum(held, 0)],
            "measured_rad": np.interp(time_s, measured["time_s"], measured[f"{joint}_rad"]),
        }
        made.append(stretch_gap.Trial(columns, name=motion, test=motion == TESTED))
    return made


class Servo:
    """tau dy/dt = command + offset - y, every trial from the command that it begins with."""

    def __init__(self, dt_s):
        self.dt_s = dt_s

    def simulate(self, params, effects, inputs, trials):
        tau, offset = params[:, 0], params[:, 1]
        goal = inputs["commanded_rad"]
        taken = 1.0 - np.exp(-self.dt_s / tau)
        out = np.zeros((len(params), goal.shape[-1]))
        for part in trials:
            y = goal[..., part.samples.start] + offset
            for i in range(part.samples.start, part.samples.stop):
                y = y + taken * (goal[..., i] + offset - y)
                out[:, i] = y
        return out


def diagnosed(folder, joint, every):
    parameters = {
        "tau": stretch_gap.Parameter(0.1, relative=0.5, unit="s", least=0.005),
        "offset": stretch_gap.Parameter(0.0, tolerance=0.05, unit="rad"),
    }
    return stretch_gap.diagnose(
        Servo(every / RATE_HZ),
        trials(folder, joint, every),
        output="measured_rad",
        inputs=["commanded_rad"],
        parameters=parameters,
        noise={"measured_rad": STEP_RAD / 12**0.5},
        wrap="all",
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("--joints", default=",".join(JOINTS))
    parser.add_argument("--drop", action="store_true", help="again on every second row")
    parser.add_argument("--report", help="folder for the reports")
    args = parser.parse_args()
    for joint in args.joints.split(","):
        for every in (1, 2) if args.drop else (1,):
            found = diagnosed(args.folder, joint, every)
            print(f"\n{joint}{', every second row' if every == 2 else ''}: {found.sentence}")
            print("  named", found.named, "rivals", found.rivals)
            print("  parameters", {k: round(v, 4) for k, v in found.parameters.items()})
            print("  effects", found.effects)
            far = found.how_far
            print(
                "  error on the test motion, rad, in steps of the encoder's noise:",
                {k: round(next(iter(far[k].values())), 2) for k in ("as_shipped", "retuned", "with_effects")},
                f"closed {far['closed']:.2f} ({far['interval'][0]:.2f} to {far['interval'][1]:.2f})",
                "model runs",
                found.model_runs,
                flush=True,
            )
            if args.report:
                found.report(Path(args.report) / f"so101_{joint}_{every}.html")


if __name__ == "__main__":
    main()
