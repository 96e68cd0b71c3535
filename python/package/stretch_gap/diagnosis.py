"""Why a simulator and a recording disagree."""

from __future__ import annotations

import json
import os
import textwrap
from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Any

from . import _stretch, figures, html, timeline
from . import problem as entries
from ._stretch import StretchError
from .fix import Again, Fix, fix
from .frames import frame
from .outputs import replaceable
from .recordings import Array
from .simulator import Asked

SHOWN = 5
"""Rows of each list that `repr` shows."""


class Diagnosis:
    """What is missing in a simulator, how sure that is, where it sits, and how far naming it closes the gap."""

    def __init__(
        self,
        answer: dict[str, Any],
        page: str = "",
        curves: Mapping[str, Sequence[Array]] | None = None,
        functions: Mapping[str, str] | None = None,
        experiment: Mapping[str, Array] | None = None,
        session: Mapping[str, Any] | None = None,
        again: Again | None = None,
    ) -> None:
        self._answer = answer
        self._page = page
        self._curves = curves or {}
        self._functions = functions or {}
        self._experiment = experiment
        self._session = session or {}
        self._again = again

    @staticmethod
    def from_json(text: str) -> Diagnosis:
        """From what `to_json` or `stretch diagnose --json=FILE` wrote; figures are not in there."""
        return Diagnosis(json.loads(text))

    @property
    def verdict(self) -> str:
        """`no_gap`, `parameters`, `effect`, `partial`, `record` or `unknown`."""
        return str(self._answer["verdict"])

    @property
    def sentence(self) -> str:
        """The answer in a sentence."""
        return str(self._answer["sentence"])

    @property
    def named(self) -> list[str]:
        """The effects that are missing, the strongest first; empty where none is named."""
        return list(self._answer["named"])

    @property
    def answer(self) -> dict[str, Any]:
        """The finding as a value: `kind` (`agrees`, `retuned`, `faint`, `missing`, `partly`, `wrong_record`, `unknown`,
        `at_bounds` or `too_little`) and its numbers."""
        return dict(self._answer.get("answer") or {})

    @property
    def not_examined(self) -> list[str]:
        """Effects that were not examined because all of their runs failed, or because the budget of runs was spent."""
        return [*self._answer.get("not_examined", []), *(self._answer.get("cut_short") or [])]

    @property
    def probabilities(self) -> dict[str, float]:
        """Probability of every candidate that was weighed, the most probable set first. After the
        sets come `nothing` (nothing is missing) and `unknown` (a cause that was not listed)."""
        weighed = self._answer["candidates"]
        return {" + ".join(c["effects"]) or "nothing": c["probability"] for c in weighed}

    @property
    def stability(self) -> dict[str, float]:
        """Share of resampled records in which the most probable set holds an effect, by effect."""
        return {s["effect"]: s["stability"] for s in self._answer.get("stabilities", [])}

    @property
    def detection_limits(self) -> dict[str, dict[str, Any]]:
        """How strong each effect would have to be to be named on these data: `parameter`, `strength` (None where no
        strength in its range would do) and `unit`, by effect; empty where something is named."""
        limits = self._answer.get("detection_limits", [])
        return {limit["effect"]: {k: v for k, v in limit.items() if k != "effect"} for limit in limits}

    @property
    def where(self) -> dict[str, float]:
        """Share of the gap in each output."""
        return {s["channel"]: s["share"] for s in self._answer["where"]["stages"]}

    @property
    def how_far(self) -> dict[str, Any]:
        """How far the named effects close the gap on samples that were not fitted: `closed`, its 95 % interval, and what
        is left by output, in the output's noise: 1 is noise alone."""
        best = self._answer["candidates"][0] if self._answer["candidates"] else {}

        def left(key: str) -> dict[str, float]:
            return {s["channel"]: max(1.0 + s[key], 0.0) ** 0.5 for s in self._answer["where"]["stages"]}

        return {
            "closed": best.get("closed", 0.0),
            "interval": tuple(best.get("closed_ci", (0.0, 0.0))),
            "as_shipped": left("raw"),
            "retuned": left("excess"),
            "with_effects": left("after"),
        }

    @property
    def parameters(self) -> dict[str, float]:
        """Every nominal parameter as it is with the named effects in."""
        return {p["name"]: p["fitted"] for p in self._answer["parameters"]}

    @property
    def effects(self) -> dict[str, dict[str, float]]:
        """Values of the named effects."""
        found: dict[str, dict[str, float]] = {name: {} for name in self.named}
        for value in self._best_values():
            if value["effect"] in found:
                found[value["effect"]][value["name"]] = value["value"]
        return found

    def _best_values(self) -> list[dict[str, Any]]:
        candidates = self._answer["candidates"]
        return list(candidates[0]["parameter_values"]) if candidates and self.named else []

    @property
    def rivals(self) -> list[str]:
        """Further effects that these data cannot rule out."""
        return [effect for effect in self._answer["ambiguous"] if effect not in self.named]

    @property
    def families(self) -> list[dict[str, Any]]:
        """Effects that these data cannot tell apart, with what they agree on: "late by 0.10 to 0.14 s"."""
        return list(self._answer.get("families", []))

    @property
    def next_experiment(self) -> dict[str, Any] | None:
        """The experiment that would tell rivals apart, where it was looked for: name, why, minutes, and `columns` to command."""
        found = self._answer.get("next_experiment")
        return {**found, "columns": dict(self._experiment or {})} if found else None

    @property
    def proposed(self) -> dict[str, Any] | None:
        """The equation that is proposed where no effect of the list explains the gap."""
        proposed = self._answer.get("proposed")
        return dict(proposed) if proposed else None

    @property
    def identifiability(self) -> list[dict[str, Any]]:
        """Which nominal parameters these data determine and which not, with what they look like."""
        return list(self._answer.get("identifiability", []))

    @property
    def notes(self) -> list[str]:
        """What was done to the recordings, what they cannot say, and what to look at."""
        return list(self._answer["notes"])

    @property
    def model_runs(self) -> int:
        """Models that the simulator was asked for."""
        runs = self._answer.get("model_runs")
        return int(runs["count"]) if isinstance(runs, dict) else int(self._answer["simulations"])

    def curves(self, output: str | None = None) -> dict[str, Array]:
        """One output over all trials end to end: `measured`, `as_shipped`, `retuned` and `with_effects`."""
        if not self._curves:
            raise StretchError("a diagnosis that was read from text has no curves; diagnose again")
        name = output or next(iter(self._curves))
        if name not in self._curves:
            raise StretchError(f"there is no output {name}; there are {', '.join(self._curves)}")
        return dict(zip(("measured", "as_shipped", "retuned", "with_effects"), self._curves[name]))

    def plot(self, output: str | None = None) -> Any:
        """Draws one output with matplotlib: measured, as shipped, re-tuned and with the named effects, and below it measured
        minus simulated. Returns the two axes."""
        values = self.curves(output)
        name = output or next(iter(self._curves))
        return figures.curves(values, float(self._session.get("dt_s", 1.0)), name, self.sentence)

    def fix(self) -> Fix:
        """The changes to the simulator: parameters re-tuned, and the named effects as Python code. The fix can
        `predict` new recordings, and `diagnose` the fixed simulator.

        A diagnosis that was read from text has equations and values in place of functions, and runs nothing.
        """
        return fix(self.parameters, self.effects, self._answer.get("implement", []), self._functions, self._again)

    def apply(self, spec: Any) -> list[str]:
        """Writes what was found into a MuJoCo specification (`MjSpec`); gives the named effects that have no place in it, for
        which `fix().code` has functions. For diagnoses of `stretch_gap.mujoco.problem`."""
        from . import mujoco

        return mujoco.apply(self, spec)

    def to_rerun(self, path: str | os.PathLike[str]) -> None:
        """Writes a recording for Rerun's viewer (`rerun why.rrd`): by trial and output the measured curve, the simulated ones
        as shipped, re-tuned and with the named effects, and what is left of each, on one time line. Needs rerun-sdk."""
        if not self._curves or not self._session:
            raise StretchError("a diagnosis that was read from text has no curves; diagnose again")
        spans = [(trial["name"], trial["samples"], trial["start_s"]) for trial in self._session["trials"]]
        timeline.write(path, self._curves, spans, self._session["dt_s"], self.sentence)

    def to_json(self) -> str:
        """Everything, as `stretch diagnose --json` writes it and `stretch calibrate --from` reads it."""
        return json.dumps(self._answer, indent=2)

    def to_frame(self) -> Any:
        """One row a candidate, as a pandas frame; a dict of columns where there is no pandas."""
        rows = [
            {
                "effects": " + ".join(c["effects"]) or "nothing",
                "probability": c["probability"],
                "closed": c["closed"],
                "closed_low": c["closed_ci"][0],
                "closed_high": c["closed_ci"][1],
                "gap_before": c["gap_before"],
                "gap_after": c["gap_after"],
                "parameters": dict(c["parameters"]),
            }
            for c in self._answer["candidates"]
        ]
        return frame(rows)

    def report(self, path: str | os.PathLike[str] | None = None) -> str:
        """The report with all figures, one HTML file that needs no network; written where a path is given."""
        if not self._page:
            raise StretchError("a diagnosis that was read from text has no figures; diagnose again")
        if path is not None:
            with open(replaceable(path, ".html"), "w", encoding="utf-8") as file:
                file.write(self._page)
        return self._page

    def __repr__(self) -> str:
        lines = textwrap.wrap(self.sentence, 100)
        shares = sorted(self.where.items(), key=lambda item: -item[1])[:SHOWN]
        lines += ["", "share of the gap:"] + [f"  {channel:<40} {100 * share:3.0f} %" for channel, share in shares]
        likely = sorted(self.probabilities.items(), key=lambda item: -item[1])[:SHOWN]
        lines += ["probability:"] + [f"  {name:<40} {p:.2f}" for name, p in likely]
        values = [f"{effect}: {name} = {x:.4g}" for effect, own in self.effects.items() for name, x in own.items()]
        lines += ["values:"] * bool(values) + [f"  {value}" for value in values]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        sentence = f"<p><b>{escape(self.sentence)}</b></p>"
        if self._page:
            # its own document: the page's style stays in it, and the notebook's out of it
            return f'{sentence}<iframe srcdoc="{escape(self._page)}" style="width:100%;height:40em;border:0"></iframe>'
        rows = [[name, f"{p:.3f}"] for name, p in self.probabilities.items()]
        return sentence + html.table(["candidate", "probability"], rows) + html.notes(self.notes)


def diagnose(
    simulator: Any,
    data: entries.Data,
    *,
    output: str | None = None,
    inputs: Sequence[str] = (),
    stages: Sequence[entries.Stage] | None = None,
    parameters: Mapping[str, entries.ParameterLike] | None = None,
    effects: Mapping[str, entries.EffectLike] | None = None,
    wrap: str | Sequence[str] | None = "all",
    rate_hz: float | None = None,
    units: Mapping[str, str] | None = None,
    noise: Mapping[str, float] | None = None,
    velocity: str | None = None,
    position: str | None = None,
    beside: Sequence[str] = (),
    without: Sequence[str] = (),
    reference: str | None = None,
    experiment: bool = False,
    budget: int | None = None,
    depth: int = 4,
    seed: int = 1,
    threads: int = 0,
    name: str = "data",
    progress: Callable[[str], Any] | None = None,
) -> Diagnosis:
    """Says why a simulator and a recording disagree: which effect is missing, how sure that is, and where it acts.

    `simulator` is an object with `simulate(params, effects) -> [n, samples]`, asked for n models at once: `params` is an
    array `[n, p]` in the order of `parameters`, `effects` `[n, e]` in that of theirs; both give a column by its name, too:
    `effects["delay_s"]`. Or it is a function of one model, `f(params, effects) -> [samples]`, with dicts of floats. With
    several outputs it returns a dict of arrays by output. It may take more arguments by name: `inputs`, a dict of columns
    that it is to be driven by (without it nothing is looked for on the input's side), and `first`, the measured first value
    of each column; with one of these it is called once a recording. With `trials`, the slices of the recordings, it is
    called once for all of them, end to end; with `stage` it answers for one stage at a time. A method
    `begin(session)` is called once with everything that stays the same. The same object can be named in a problem.toml. An
    exception of the simulator comes out as it is; `stretch_gap.Refused` says that values cannot be simulated.

    `data`: a dict of arrays by column, a frame, a `Trial`, the path of a recording (as `stretch_gap.read` takes it), or a
    list of these; with `rate_hz` or a column `time_s`. Or the path of a problem.toml, which says all of the following; without
    a simulator (None) the file's own is run.

    `output` is the column that the simulation is compared with, `inputs` those that drive it; `stages` says the same of
    several. `velocity` or `position` is the column by which friction rubs. `parameters` by name: a `Parameter`,
    `(value, tolerance)` or an exact number. `effects` that the simulator has itself: an `Effect`, an `Argument`, `(least,
    greatest)`, or `(least, greatest, off)`. `wrap`: effects around the simulator, as `"input.delay"`, `"output.backlash"`,
    or all of them; `without` leaves some out, by name or by kind. `units` and `noise` by column. `reference` is the column that
    the output senses: the diagnosis then reports what a calibration of that output loses by the gap. With `experiment` the
    experiment is looked for that would tell rivals apart, where the simulator takes `inputs`.
    `budget` is the most models that may be run.
    """
    if depth < 1:
        raise StretchError(f"depth: {depth} effects cannot be named; give 1 or more")
    asked = None if simulator is None else Asked(simulator)
    notes: list[str] = []
    if isinstance(data, (str, os.PathLike)) and os.fspath(data).endswith(".toml"):
        if output is not None or stages is not None or parameters or effects:
            raise StretchError(
                f"{os.fspath(data)} says what is diagnosed; give a simulator in addition to it, or None for the file's own"
            )
        checked = _stretch.Problem.read(data, asked is None or asked.takes_inputs)
        name = checked.name if name == "data" else name
    else:
        if asked is None:
            raise StretchError("there is no simulator; give one, or the path of a problem.toml that names it")
        if (output is None) == (stages is None):
            raise StretchError("say what is compared with the measurement: output, a column's name, or stages")
        listed = list(stages or [entries.Stage(str(output), tuple(inputs), velocity=velocity, position=position)])
        units, noise = units or {}, noise or {}
        driven = list(dict.fromkeys(c for one in listed for c in one.inputs))
        wrappers = [wrap] if isinstance(wrap, str) else list(wrap or ())
        if not asked.takes_inputs:
            wrappers, noise_in = _behind(wrappers, driven, notes), {}
        else:
            noise_in = dict(noise)
        problem = {
            "stage": [entries.stage(one, i, units, noise) for i, one in enumerate(listed)],
            "input": [{"column": c, "unit": units.get(c, ""), "noise": float(noise_in.get(c, 0.0))} for c in driven],
            "parameter": [entries.parameter(key, value) for key, value in (parameters or {}).items()],
            "effect": [entries.effect(key, value) for key, value in (effects or {}).items()],
            "wrap": wrappers,
            "without": list(without),
            "beside": list(beside),
            "reference": reference,
            "signal": (output or listed[-1].output) if reference else None,
        }
        wanted = entries.wanted(listed, [*beside, *([reference] if reference else [])])
        checked = _stretch.Problem(json.dumps(problem), entries.recorded(data, rate_hz, wanted))
    how = {
        "name": name,
        "depth": depth,
        "seed": seed,
        "threads": threads,
        "baselines": False,
        "budget": budget,
        "batch": 1 if asked is None else asked.batch,
        "answers_all": asked is not None and asked.answers_all,
        "takes_inputs": asked is None or asked.takes_inputs,
        "experiment": experiment,
    }
    return run(checked, asked, how, progress, notes)


def run(
    checked: _stretch.Problem,
    asked: Asked | None,
    how: dict[str, Any],
    progress: Callable[[str], Any] | None,
    notes: list[str],
) -> Diagnosis:
    """Diagnoses a checked problem; `notes` are put before its own."""
    session = json.loads(checked.session)
    if asked is not None:
        asked.bind({**session, "columns": checked.columns})
    with figures.shown(progress) as report:
        text, page, curves, functions, trial, fixed = checked.diagnose(asked, json.dumps(how), report)
    answer = json.loads(text)
    answer["notes"] = notes + answer["notes"]
    again = None if fixed is None else Again(fixed, asked, how)
    return Diagnosis(answer, page, curves, functions, trial, session, again)


def wrappers() -> Any:
    """Effects that can be wrapped around a simulator, as a pandas frame (a dict of columns without pandas): `kind`; `wrap`, the
    sides on which `wrap="all"` looks for it; `words`; and `equation`, in which x becomes y."""
    keys = ("kind", "wrap", "words", "equation")
    return frame([dict(zip(keys, one)) for one in _stretch.wrappers()])


def _behind(wrappers: list[str], driven: list[str], notes: list[str]) -> list[str]:
    """Wrappers that act behind the simulator: it cannot be driven by other inputs than it has."""
    sides = ("input", *driven)
    for one in wrappers:
        if one.split(".", 1)[0] in sides:
            raise StretchError(
                f"wrap, {one}: the simulator must take the argument inputs to be driven by altered ones, as simulate(params, "
                "effects, inputs)"
            )
    if "all" in wrappers and driven:
        notes.append("nothing was looked for on the input's side: the simulator takes no argument inputs")
    return ["output.all" if one == "all" else one for one in wrappers]
