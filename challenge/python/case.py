"""A case of the challenge for a method: its trials, candidates and fits; and the writing of answers for `challenge score`."""
import importlib
import json
import sys
import time
from pathlib import Path

import numpy as np
import tomllib
from scipy.optimize import least_squares

import operators

# arguments of each kind: (scale, value that switches the effect off, start of a fit, largest value). Times are in sample times,
# shares are dimensionless, and all others are relative to the range of the channel.
KINDS = {
    "delay": [("time", 0.0, 2.0, 12.0)], "lag": [("time", 0.0, 3.0, 20.0)],
    "dead_zone": [("span", 0.0, 0.04, 0.3)], "saturation": [("top", 1.02, 0.8, 0.2)],
    "backlash": [("span", 0.0, 0.01, 0.2)], "drift": [("span", 0.0, 0.02, 0.3)],
    "relaxation": [("share", 0.0, 0.05, 0.5), ("time", 30.0, 50.0, 300.0)],
    "hysteresis": [("share", 0.0, 0.1, 0.8), ("span", 0.06, 0.08, 0.4)],
}
OWN = {"friction": (0.0, 4.0, 40.0), "drag": (0.0, 8.0, 80.0), "radiation": (0.0, 0.5, 4.0), "fan": (0.0, 0.1, 0.8)}


class Case:
    """A case that was read from a folder with problem.toml. `runs` counts the simulated stages."""

    stages = range(2)

    def __init__(self, folder, plant, candidates):
        self.folder, self.plant, self.places, self.runs = Path(folder), plant, candidates, 0
        problem = tomllib.loads((self.folder / "problem.toml").read_text())
        self.trials = [(trial["split"], np.genfromtxt(self.folder / trial["file"], delimiter=",", names=True))
                       for trial in problem["trial"]]
        self.columns = (plant.INPUT, *plant.OUTPUTS)
        self.p0 = np.array(list(plant.PARAMETERS.values()))
        self.tolerance = np.array(list(plant.TOLERANCES.values()))
        total, before, self.starts = sum(len(rows) for _, rows in self.trials), 0, []
        for _, rows in self.trials:
            self.starts.append((before / total, 1.0 / total))
            before += len(rows)
        self.fit = [i for i, (split, _) in enumerate(self.trials) if split == "fit"]
        self.test = [i for i, (split, _) in enumerate(self.trials) if split == "test"]

    def stage_of(self, name):
        return self.plant.STAGES.index(self.places[name])

    def nominal(self, stage):
        """Parameters of a stage and their tolerances."""
        return self.p0, self.tolerance

    def centre(self, stage):
        """Mean and standard deviation of the parameters of random simulations."""
        return self.p0, 0.7 * self.tolerance

    def is_signed(self, name):
        """Whether the first argument of a candidate may also be below its off value."""
        return False

    def free(self, name):
        """Number of fitted numbers of a candidate."""
        return len(self.arguments(name))

    def in_noise(self, stage, gap, trials):
        """A difference of outputs in multiples of the noise."""
        return gap / self.plant.NOISE[stage]

    def noisy(self, stage, values, random):
        """Simulated outputs of the fit trials, with noise."""
        return values + self.plant.NOISE[stage] * random.normal(size=len(values))

    def trial_lengths(self, stage):
        """Number of residuals of each fit trial."""
        return [len(self.trials[i][1]) for i in self.fit]

    def arguments(self, name):
        """(off, start, most) of each argument of a candidate, in its unit."""
        if name in OWN:
            return [OWN[name]]
        stage, (_, side, kind) = self.stage_of(name), name.split(".")
        column = self.columns[stage if side == "input" else stage + 1]
        values = np.concatenate([self.trials[i][1][column] for i in self.fit])
        unit = {"time": self.plant.DT_S, "share": 1.0, "span": np.ptp(values), "top": np.abs(values).max()}
        return [tuple(unit[scale] * x for x in triple) for scale, *triple in KINDS[kind]]

    def simulate(self, stage, p, effects, trials):
        """Outputs of a stage for some trials, driven by the measured input. `effects` is {name: arguments}."""
        self.runs += 1
        inside = np.array([effects[e][0] if e in effects else 0.0 for e in self.plant.EFFECTS])
        around = [(*name.split("."), values) for name, values in effects.items() if name not in OWN]
        out = []
        for i in trials:
            x = np.ascontiguousarray(self.trials[i][1][self.columns[stage]])
            for place, side, kind, values in around:
                if side == "input" and place == self.plant.STAGES[stage]:
                    x = getattr(operators, kind)(x, self.plant.DT_S, self.starts[i], *values)
            y = self.plant.SIMULATE[stage](x, np.asarray(p, dtype=float), inside)
            for place, side, kind, values in around:
                if side == "output" and place == self.plant.STAGES[stage]:
                    y = getattr(operators, kind)(y, self.plant.DT_S, self.starts[i], *values)
            out.append(y)
        return np.concatenate(out)

    def measured(self, stage, trials):
        return np.concatenate([self.trials[i][1][self.columns[stage + 1]] for i in trials])

    def residual(self, stage, p, effects, trials):
        """Measured minus simulated output, in multiples of the noise."""
        gap = self.measured(stage, trials) - self.simulate(stage, p, effects, trials)
        return self.in_noise(stage, gap, trials)

    def retune(self, stage, names=(), trials=None, start=None):
        """Best fit of parameters, with their tolerances as prior, and arguments: (p, effects, sum of squares)."""
        trials, names = self.fit if trials is None else trials, list(names)
        triples = [triple for name in names for triple in self.arguments(name)]
        off, begin, most = (np.array([t[k] for t in triples]) for k in range(3))
        p0, tolerance = self.nominal(stage)
        span, n, least = most - off, len(p0), self.least(names)

        def effects_at(z):
            return self.shared_out(names, off + span * z[n:])

        def cost(z):
            gap = self.residual(stage, p0 + tolerance * z[:n], effects_at(z), trials)
            return np.concatenate([gap, z[:n]])

        z0 = np.concatenate([np.zeros(n), (begin - off) / span]) if start is None else start
        bounds = (np.r_[-3.0 * np.ones(n), least], np.r_[3.0 * np.ones(n), np.ones(len(span))])
        found = least_squares(cost, np.clip(z0, bounds[0] + 1e-6, bounds[1] - 1e-6), bounds=bounds,
                              diff_step=1e-3, x_scale=np.r_[np.ones(n), 0.1 * np.ones(len(span))], max_nfev=25)
        self.last = found
        return p0 + tolerance * found.x[:n], effects_at(found.x), float(2.0 * found.cost)

    def shared_out(self, names, values):
        """Splits a list of arguments into {name: arguments}."""
        at, out = 0, {}
        for name in names:
            count = len(self.arguments(name))
            out[name], at = values[at : at + count], at + count
        return out

    def search(self, stage, names):
        """For any optimiser: the cost as a function of parameters and arguments, the start, and the lower and upper bounds."""
        off, most = (np.array([t[k] for n in names for t in self.arguments(n)]) for k in (0, 2))
        p0, tolerance = self.nominal(stage)
        n = len(p0)

        def cost(z):
            z = np.asarray(z)
            effects = self.shared_out(names, off + (most - off) * z[n:])
            gap = self.residual(stage, p0 + tolerance * z[:n], effects, self.fit)
            return float(gap @ gap + z[:n] @ z[:n])

        begin = np.r_[np.zeros(n), 0.2 * np.ones(len(off))]
        return cost, begin, np.r_[-3.0 * np.ones(n), self.least(names)], np.r_[3.0 * np.ones(n), np.ones(len(off))]

    def least(self, names):
        """Lower bound of each argument, as a share of its range: -1 for the first argument of a candidate with either sign, else 0."""
        return np.array([-1.0 if k == 0 and self.is_signed(n) else 0.0 for n in names for k in range(len(self.arguments(n)))])

    def closed(self, names):
        """Share of the gap on the test trials that these effects close: 1 - (excess with them)/(excess without), both re-tuned."""
        before = after = 0.0
        for stage in self.stages:
            count = len(self.measured(stage, self.test))
            for mine in ((), [n for n in names if self.stage_of(n) == stage]):
                p, effects, _ = self.retune(stage, mine)
                left = max(0.0, np.sum(self.residual(stage, p, effects, self.test) ** 2) / count - 1.0)
                before, after = (before + left, after) if mine == () else (before, after + left)
        return float(1.0 - after / before) if before > 0 else 0.0


def load(folder):
    """Reads a set: (set.toml, module of the plant, names of the cases, stage of each candidate)."""
    about = tomllib.loads((Path(folder) / "set.toml").read_text())
    places = {c["name"]: c["place"] for c in about["candidate"]}
    return about, importlib.import_module(about["plant"]), about["cases"], places


def asked(folder, case, method, plant, places):
    """Runs a method on one case of a set, and returns the answer in the layout of a submission. A method takes a Case and
    returns (list of (effects, probability), verdict, place or None, closed share)."""
    began, kind = time.process_time(), Case
    if plant.NAME == "rig":
        from rig_case import RigCase as kind
    one = kind(Path(folder) / case, plant, places)
    believed, verdict, place, closed = method(one)
    total = sum(p for _, p in believed)
    return {"probabilities": [{"effects": sorted(e), "probability": float(p / total)} for e, p in believed],
            "verdict": verdict, "place": place, "closed_share": float(min(1.0, closed)),
            "seconds": time.process_time() - began, "simulations": one.runs}


def solve(folder, method, name, setup, out, limit=None):
    """Runs a method on every case, and writes the submission after each case."""
    about, plant, names, places = load(folder)
    cases = {}
    for case in names[:limit]:
        cases[case] = asked(folder, case, method, plant, places)
        if sys.stderr.isatty():
            print(f"{case}: {cases[case]['verdict']}, {cases[case]['seconds']:.1f} s", file=sys.stderr)
        hand_in({"schema": 1, "method": name, "setup": setup, "set": about["set"], "cases": cases}, out)


def hand_in(answers, out):
    """Writes a submission completely or not at all. If the program is stopped, the file holds all cases answered so far."""
    draft = Path(f"{out}.draft")
    draft.write_text(json.dumps(answers, indent=1) + "\n")
    draft.replace(out)
