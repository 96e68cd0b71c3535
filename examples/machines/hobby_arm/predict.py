"""Tests whether the effects that are named on three motions of an arm predict the other motions.

    python predict.py FOLDER [--joints rot,pitch] [--drop]

FOLDER is the authors' `output/real/so101/custom`, with one folder per motion. Three motions are fitted. The simulator with the
fix of the diagnosis (parameters and functions) is run on all others. The script prints, for the motions in which a joint is
commanded to move, the error with the fix divided by the error of the simulator that was only re-tuned on the same three motions.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import record
import simulator
import stretch_gap
from scipy.optimize import least_squares

NOISE_RAD = 2.0 * np.pi / 4096.0 / 12**0.5


class Fixed:
    """The simulator with the parameters and the functions of a fix."""

    def __init__(self, fix: stretch_gap.Fix, dt_s: float) -> None:
        self.parameters, self.dt_s = fix.parameters, dt_s
        self.functions: dict[str, object] = {}
        exec(fix.code, self.functions)
        self.names = {"input": [], "output": []}
        for name in fix.effects:
            if f"{name.replace('.', '_')}_start" not in self.functions:
                raise SystemExit(f"{name} has no function in the fix; it cannot be run here")
            self.names[name.split(".")[0]].append(name.replace(".", "_"))

    def _through(self, side: str, values: np.ndarray) -> np.ndarray:
        for name in self.names[side]:
            state, step = self.functions[f"{name}_start"](float(values[0])), self.functions[name]
            values = np.array([step(state, x) for x in values.tolist()])
        return values

    def __call__(self, command: np.ndarray) -> np.ndarray:
        return self._through("output", servo(list(self.parameters.values()), self._through("input", command), self.dt_s))


def servo(parameters, command: np.ndarray, dt_s: float) -> np.ndarray:
    """Runs the simulator of the problem for one command."""
    made = simulator.Servo()
    made.begin({"dt_s": dt_s})
    part = SimpleNamespace(samples=slice(0, len(command)))
    return made.simulate(np.array([parameters]), None, {"commanded_rad": command[np.newaxis]}, [part])[0]


def retuned(motions: list[dict[str, np.ndarray]], dt_s: float) -> np.ndarray:
    """Returns the least-squares time constant and offset for the fitted motions."""

    def left(z):
        return np.concatenate([servo(z, m["commanded_rad"], dt_s) - m["measured_rad"] for m in motions])

    return least_squares(left, [0.1, 0.0], bounds=([0.005, -0.3], [1.0, 0.3]), x_scale=[0.05, 0.02], diff_step=1e-4).x


def diagnosed(motions: dict[str, dict[str, np.ndarray]], joint: str) -> stretch_gap.Diagnosis:
    return stretch_gap.diagnose(
        simulator.Servo(),
        [stretch_gap.Trial(columns, name=name) for name, columns in motions.items()],
        output="measured_rad",
        inputs=["commanded_rad"],
        parameters={
            "tau": stretch_gap.Parameter(0.1, relative=0.5, unit="s", least=0.005),
            "offset": stretch_gap.Parameter(0.0, tolerance=0.05, unit="rad"),
        },
        noise={"measured_rad": NOISE_RAD},
        wrap="all",
        name=joint,
    )


def predicted(data: Path, joint: str, every: int = 1) -> tuple[stretch_gap.Diagnosis, dict[str, float], float]:
    """Returns the diagnosis of a joint, the error ratio (fix over re-tuning) of each motion, and the seconds of the diagnosis."""
    dt_s = every / record.RATE_HZ
    fitted = {name: record.motion(data, name, joint, every) for name in record.FITTED}
    begun = time.monotonic()
    found = diagnosed(fitted, joint)
    seconds = time.monotonic() - begun
    plain, fixed = retuned(list(fitted.values()), dt_s), Fixed(found.fix(), dt_s)
    shares = {}
    for folder in sorted(data.iterdir()):
        if folder.name in record.FITTED or not (folder / "control.csv").is_file():
            continue
        columns = record.motion(data, folder.name, joint, every)
        command, measured = columns["commanded_rad"], columns["measured_rad"]
        if np.ptp(command) > 0.0:
            left = [np.sqrt(np.mean((y - measured) ** 2)) for y in (fixed(command), servo(plain, command, dt_s))]
            shares[folder.name] = float(left[0] / left[1])
    return found, shares, seconds


def text(shares: list[float]) -> str:
    values = np.array(shares)
    mean = np.exp(np.mean(np.log(values)))
    below = 100 * np.mean(values < 1)
    return f"{len(values)} motions, geometric mean {mean:.3f}, below 1 in {below:.0f} %, greatest {values.max():.2f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--joints", default=",".join(record.JOINTS))
    parser.add_argument("--drop", action="store_true", help="again on every second row")
    args = parser.parse_args()
    for every in (1, 2) if args.drop else (1,):
        all_shares: list[float] = []
        for joint in args.joints.split(","):
            found, shares, seconds = predicted(args.data, joint, every)
            all_shares += shares.values()
            print(f"{joint}{', every second row' if every == 2 else ''}: {found.sentence}")
            print(f"  named {found.named}, not ruled out {found.rivals}, runs {found.model_runs}, {seconds:.0f} s")
            print(
                f"  parameters {found.parameters}\n  effects {found.effects}\n  probabilities "
                f"{dict(list(found.probabilities.items())[:4])}"
            )
            print(f"  {text(list(shares.values()))}")
            worst = sorted(shares.items(), key=lambda item: -item[1])[:8]
            print(f"  worst predicted: {', '.join(f'{name} {share:.2f}' for name, share in worst)}", flush=True)
        print(f"all joints{', every second row' if every == 2 else ''}: {text(all_shares)}", flush=True)


if __name__ == "__main__":
    main()
