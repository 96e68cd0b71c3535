"""Two methods without a diagnosis: re-tuning alone, and a fit of all candidates at once (as in `mujoco.sysid`).

Both are least-squares fits to the fitted trials that start from the simulator as shipped. The candidates are textbook forms, a
few for each signal: delay, lag, backlash, dead zone, saturation, friction. No candidate is selected; all are fitted together.
"""

from __future__ import annotations

import importlib
import inspect
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tomllib
from scipy.optimize import least_squares


@dataclass
class Span:
    name: str
    samples: slice
    start_s: float


@dataclass
class Free:
    """A number that is fitted: its start value, its bounds, and the scale of a step."""

    name: str
    start: float
    low: float
    high: float
    scale: float


class Table(np.ndarray):
    """An array whose columns can be read by name, as in the calls that the program makes."""

    def __getitem__(self, at):
        return np.asarray(self)[:, self.names.index(at)] if isinstance(at, str) else np.asarray(self)[at]


def table(rows, names):
    made = np.array(rows, dtype=float).reshape(len(rows), -1).view(Table)
    made.names = list(names)
    return made


class Problem:
    """A problem file, its recordings joined end to end, and its simulator."""

    def __init__(self, path: Path) -> None:
        self.file = tomllib.loads(path.read_text())
        self.stage = self.file["stage"][0]
        trials = [np.genfromtxt(path.parent / t["file"], delimiter=",", names=True) for t in self.file["trial"]]
        self.dt_s = float(np.median(np.diff(trials[0]["time_s"])))
        self.columns = {name: np.concatenate([t[name] for t in trials]) for name in trials[0].dtype.names}
        ends = np.cumsum([len(t) for t in trials])
        self.spans = [Span(t["file"], slice(int(e) - len(r), int(e)), 0.0) for t, r, e in zip(self.file["trial"], trials, ends)]
        self.is_test = np.zeros(int(ends[-1]), dtype=bool)
        for trial, span in zip(self.file["trial"], self.spans):
            self.is_test[span.samples] = trial.get("split") == "test"
        if not self.is_test.any():  # the last quarter of each recording is for testing, as in the program
            for span in self.spans:
                self.is_test[span.samples.start + 3 * (span.samples.stop - span.samples.start) // 4 : span.samples.stop] = True
        module, _, name = self.file["simulator"]["python"].partition(":")
        sys.path.insert(0, str(path.parent))
        sys.modules.pop(module, None)
        self.simulator = getattr(importlib.import_module(module), name)
        sys.path.pop(0)
        if hasattr(self.simulator, "begin"):
            self.simulator.begin({"dt_s": self.dt_s})
        arguments = [(e["name"], a) for e in self.file.get("effect", []) for a in e.get("argument", [e])]
        self.own = [(e if a["name"] == e else f"{e}.{a['name']}", a) for e, a in arguments]
        self.off = [a.get("off", 0.5 * sum(a["range"])) for _, a in self.own]

    def parameters(self) -> list[Free]:
        made = []
        for p in self.file["parameter"]:
            given = p["tolerance"]
            size = abs(p["value"]) * float(given.rstrip("% ")) / 100.0 if isinstance(given, str) else given
            low, high = max(p["value"] - 3.0 * size, p.get("least", -np.inf)), p["value"] + 3.0 * size
            made.append(Free(p["name"], p["value"], low, high, size))
        return made

    def simulate(self, params, effects, inputs):
        """Returns the outputs of the first stage, `[n, samples]`, for `n` sets of parameters and effects."""
        params = table(params, [p["name"] for p in self.file["parameter"]])
        effects = table(effects, [name for name, _ in self.own])
        method = getattr(self.simulator, "simulate", None)
        if method is None:
            rows = zip(params, effects, range(len(params)))
            return np.stack(
                [
                    self.simulator(dict(zip(params.names, p)), dict(zip(effects.names, e)), {k: v[i] for k, v in inputs.items()})
                    for p, e, i in rows
                ]
            )
        more = {"trials": self.spans} if "trials" in inspect.signature(method).parameters else {}
        answer = method(params, effects, inputs=inputs, **more)
        return answer[self.stage["output"]] if isinstance(answer, dict) else answer


def delay(x, by, dt_s):
    at = np.arange(x.shape[-1]) - by[:, None] / dt_s
    low = np.clip(np.floor(at).astype(int), 0, x.shape[-1] - 2)
    part = np.clip(at - low, 0.0, 1.0)
    return np.take_along_axis(x, low, -1) * (1.0 - part) + np.take_along_axis(x, low + 1, -1) * part


def lag(x, tau, dt_s):
    taken = 1.0 - np.exp(-dt_s / np.maximum(tau, 1e-9))
    y, out = x[:, 0].copy(), np.empty_like(x)
    for i in range(x.shape[-1]):
        y += taken * (x[:, i] - y)
        out[:, i] = y
    return out


def backlash(x, w, dt_s):
    y, out = x[:, 0].copy(), np.empty_like(x)
    for i in range(x.shape[-1]):
        y = np.clip(y, x[:, i] - w, x[:, i] + w)
        out[:, i] = y
    return out


def dead_zone(x, w, dt_s):
    return x - np.clip(x, -w[:, None], w[:, None])


def saturation(x, cut, dt_s):
    reach = (1.0 - cut[:, None]) * np.max(np.abs(x), axis=-1, keepdims=True)
    return np.clip(x, -reach, reach)


KINDS = {"delay": delay, "lag": lag, "backlash": backlash, "dead_zone": dead_zone, "saturation": saturation}


class Model:
    """The simulator with its parameters and effects, and with candidates at every input and at the output."""

    def __init__(self, problem: Problem, with_candidates: bool) -> None:
        self.problem, self.free = problem, problem.parameters()
        self.places = []
        if not with_candidates:
            return
        for (name, argument), off in zip(problem.own, problem.off):
            low, high = argument["range"]
            start = min(max(off, low + 1e-3 * (high - low)), high - 1e-3 * (high - low))
            self.free.append(Free(name, start, low, high, 0.1 * (high - low)))
        output = problem.stage["output"]
        for column in (*problem.stage["inputs"], output):
            span = float(np.ptp(problem.columns[column][~problem.is_test]))
            greatest = {"delay": 5.0 * problem.dt_s, "lag": 20.0 * problem.dt_s, "saturation": 0.5}
            for kind in KINDS:
                high = greatest.get(kind, 0.25 * span)
                place = "output" if column == output else column
                self.places.append((column, kind))
                self.free.append(Free(f"{place}.{kind}", 0.02 * high, 0.0, high, 0.1 * high))
        if "velocity" in problem.stage:
            span = float(np.ptp(problem.columns[output][~problem.is_test]))
            self.free += [Free(f"output.{k}", 0.0, -0.5 * span, 0.5 * span, 0.1 * span) for k in ("coulomb", "viscous")]

    def _around(self, columns, values, at, column):
        for place, kind in self.places:
            if place == column:
                for span in self.problem.spans:
                    columns[:, span.samples] = KINDS[kind](columns[:, span.samples], values[:, at], self.problem.dt_s)
            at += 1
        return columns

    def outputs(self, values):
        """Returns the outputs, `[n, samples]`, for `n` rows of values."""
        p, problem = len(self.problem.file["parameter"]), self.problem
        own = values[:, p : p + len(problem.own)] if len(self.free) > p else np.tile(problem.off, (len(values), 1))
        first = p + (len(problem.own) if len(self.free) > p else 0)
        inputs = {
            name: np.tile(column, (len(values), 1))
            if name in problem.stage["inputs"]
            else np.broadcast_to(column, (len(values), len(column)))
            for name, column in problem.columns.items()
        }
        for name in problem.stage["inputs"] if self.places else ():
            inputs[name] = self._around(inputs[name], values, first, name)
        out = np.array(problem.simulate(values[:, :p], own, inputs))
        if self.places and "velocity" in problem.stage:
            velocity = problem.columns[problem.stage["velocity"]]
            size = np.max(np.abs(velocity))
            out += values[:, -2:-1] * np.tanh(velocity / (0.02 * size)) + values[:, -1:] * velocity / size
        return self._around(out, values, first, problem.stage["output"]) if self.places else out

    def fit(self):
        """Returns the least-squares values on the fitted samples, and the number of simulated models."""
        free, problem, runs = self.free, self.problem, 0
        scale = np.array([f.scale for f in free])
        low, high = np.array([f.low for f in free]), np.array([f.high for f in free])
        measured = problem.columns[problem.stage["output"]]
        unit = float(np.std(measured[~problem.is_test]))

        def residuals(rows):
            nonlocal runs
            runs += len(rows)
            return ((self.outputs(rows) - measured)[:, ~problem.is_test]) / unit

        def slope(z):
            steps = np.where(z * scale + 1e-4 * scale <= high, 1e-4, -1e-4)
            rows = np.vstack([z, z + np.diag(steps)]) * scale
            found = residuals(rows)
            return ((found[1:] - found[0]) / steps[:, None]).T

        start = np.clip([f.start for f in free], low + 1e-9 * scale, high - 1e-9 * scale)
        done = least_squares(
            lambda z: residuals((z * scale)[None])[0],
            start / scale,
            slope,
            (low / scale, high / scale),
            x_scale=1.0,
            max_nfev=100,
        )
        return done.x * scale, runs

    def error(self, values) -> float:
        """Returns the root mean square error on the samples that were not fitted."""
        left = self.outputs(np.asarray(values)[None])[0] - self.problem.columns[self.problem.stage["output"]]
        return float(np.sqrt(np.mean(left[self.problem.is_test] ** 2)))


def text(path: Path) -> str:
    """Returns a text of a few lines about both fits of a problem."""
    problem, lines, retuned = Problem(path), [], None
    for name, with_candidates in (("re-tuning alone", False), ("all candidates free", True)):
        model = Model(problem, with_candidates)
        values, runs = model.fit()
        error = model.error(values)
        retuned = retuned or error
        shown = ", ".join(f"{f.name} {v:.4g}" for f, v in zip(model.free, values))
        lines.append(f"{name}: {error:.4g} on the test, {error / retuned:.3f} of re-tuning alone, {runs} runs\n  {shown}")
    return "\n".join(lines)


if __name__ == "__main__":
    print(text(Path(sys.argv[1])))
