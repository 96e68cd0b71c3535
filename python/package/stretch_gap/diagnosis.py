"""Diagnosis of the gap between a simulator and recordings."""

from __future__ import annotations

import difflib
import json
import os
import textwrap
from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from . import _stretch, figures, html, timeline
from . import problem as entries
from ._stretch import Refused, StretchError
from .fix import COPIED, Again, Fix, fix
from .frames import frame
from .outputs import replaceable
from .recordings import Array, unknown
from .simulator import Asked

SCHEMA = 2
"""Version of the JSON of a diagnosis."""

SHOWN = 5
"""Largest number of rows of each list that `repr` shows."""


class Diagnosis:
    """Result of a diagnosis: the missing effects, their probabilities, and the part of the gap that they close.

    `diagnose` returns this class. The *gap* is the mean square error of the simulator beyond the noise of the measurement. A
    *named* effect is one that the diagnosis reports as missing. *Re-tuned* means that the nominal parameters were fitted within
    their tolerances. A notebook displays the report of a diagnosis.

    Examples
    --------
    A spring is softer than the simulator assumes, and its length is measured 60 ms late. The examples of the methods use
    `found`.

    >>> import numpy as np
    >>> import stretch_gap
    >>> time_s = np.arange(0, 60, 0.01)
    >>> force = 20 * np.sin(1.3 * time_s) + 10 * np.sin(3.1 * time_s)
    >>> length = 2.1 * np.interp(time_s - 0.06, time_s, force) + 0.01 * np.random.default_rng(0).normal(size=time_s.size)
    >>> data = {"time_s": time_s, "force_N": force, "length_mm": length}
    >>> def spring(params, effects, inputs):
    ...     return params["compliance"] * inputs["force_N"]
    >>> question = {"output": "length_mm", "inputs": "force_N", "wrap": ["output.delay", "output.saturation"]}
    >>> found = stretch_gap.diagnose(spring, data, parameters={"compliance": (2.0, 0.2)}, **question)
    >>> found.verdict, found.named
    ('effect', ['output.delay'])
    """

    def __init__(
        self,
        answer: dict[str, Any],
        page: str = "",
        curves: Mapping[str, Sequence[Array]] | None = None,
        functions: Mapping[str, str] | None = None,
        experiment: Mapping[str, Array] | None = None,
        session: Mapping[str, Any] | None = None,
        again: Again | None = None,
        earlier: Fix | None = None,
    ) -> None:
        self._answer = answer
        self._page = page
        self._curves = curves or {}
        self._functions = functions or {}
        self._experiment = experiment
        self._session = session or {}
        self._again = again
        self._earlier = earlier
        self._is_copy = False

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy or a pickle contains: everything except the simulator, which often cannot be pickled."""
        return {**vars(self), "_again": None, "_is_copy": True}

    @staticmethod
    def from_json(text: str) -> Diagnosis:
        """Create a diagnosis from JSON.

        The JSON contains neither curves nor the report nor the simulator. `curves`, `plot`, `report` and `to_rerun` therefore
        raise a `StretchError`, and `fix` returns a fix that cannot be run.

        Parameters
        ----------
        text : str
            JSON as returned by `to_json` or written by `stretch diagnose --json=FILE`.

        Returns
        -------
        Diagnosis
            The diagnosis.

        Raises
        ------
        json.JSONDecodeError
            If the text is not JSON.
        StretchError
            If another version of the package wrote the text.

        Examples
        --------
        >>> stretch_gap.Diagnosis.from_json(found.to_json()).named
        ['output.delay']
        """
        answer = json.loads(text)
        if not isinstance(answer, dict) or answer.get("schema") != SCHEMA:
            raise StretchError(f"this is not a diagnosis of schema {SCHEMA}, which this release reads: diagnose again")
        return Diagnosis(answer)

    @property
    def verdict(self) -> str:
        """Kind of the result, str.

        - `"no_gap"`: simulator and recording agree within the noise.
        - `"parameters"`: they agree after the parameters are re-tuned within their tolerances.
        - `"effect"`: effects are missing and are named.
        - `"partial"`: effects are missing and are named, but they leave a part of the gap.
        - `"record"`: the recording itself is wrong, for example a column, or a parameter of the simulator is far outside its
          tolerance.
        - `"unknown"`: there is a gap that no effect of the list explains.
        """
        return str(self._answer["verdict"])

    @property
    def sentence(self) -> str:
        """Result in plain English, str."""
        return str(self._answer["sentence"])

    @property
    def named(self) -> list[str]:
        """Names of the missing effects, list of str, the strongest first. Empty if no effect is named."""
        return list(self._answer["named"])

    @property
    def answer(self) -> dict[str, Any]:
        """Result as a dict, for programs.

        `kind` is one of the following; the other keys depend on it.

        - `"agrees"`: simulator and recording agree within the noise.
        - `"retuned"`: they agree after re-tuning.
        - `"faint"`: the gap is larger than noise usually is, but too small to name a cause.
        - `"missing"`: effects are missing; the key `rest` exists if more than noise is left with them.
        - `"wrong_record"`: the recording itself is wrong.
        - `"unknown"`: no effect of the list explains the gap.
        - `"at_bounds"`: parameters are at the ends of their tolerances, and beyond them would explain as much as effects do.
        - `"too_little"`: the recording is not sufficient to name an effect.
        """
        return dict(self._answer["answer"])

    @property
    def not_examined(self) -> list[str]:
        """Effects that were not examined, list of str.

        All of their runs failed, the budget of runs was spent, or a first test left them out of an open answer (verdict
        `"partial"` or `"unknown"`).
        """
        keys = ("not_examined", "cut_short", "not_fitted")
        return [name for key in keys for name in self._answer.get(key) or []]

    @property
    def probabilities(self) -> dict[str, float]:
        """Probabilities of the candidates, dict of str to float.

        A candidate is a set of effects; the name of a set joins its effects by `" + "`. The sets come first, the most probable
        first. Then follow `"nothing"` (no effect is missing) and `"unknown"` (the cause is not in the list).
        """
        weighed = self._answer["candidates"]
        return {" + ".join(c["effects"]) or "nothing": c["probability"] for c in weighed}

    @property
    def stability(self) -> dict[str, float]:
        """Share of resampled recordings in which the most probable set contains the effect, dict by effect, 0 to 1."""
        return {s["effect"]: s["stability"] for s in self._answer.get("stabilities", [])}

    @property
    def detection_limits(self) -> dict[str, dict[str, Any]]:
        """Strength from which each effect would be named on these data, dict of dicts by effect.

        Each dict holds `parameter` (the parameter that is the strength of the effect), `strength` (its value, or None if no
        value in the range would suffice), `unit`, and `others` (values of the other parameters). `seen` is the strength from
        which something would be seen, and `like` the most similar effect, if it makes `strength` larger than `seen`. The dict is
        empty if an effect is named, or if the recording is not sufficient to name one.
        """
        limits = self._answer.get("detection_limits", [])
        return {limit["effect"]: {k: v for k, v in limit.items() if k != "effect"} for limit in limits}

    @property
    def where(self) -> dict[str, float]:
        """Share of the gap whose cause lies in each output, dict by output column, 0 to 1."""
        return {s["channel"]: s["share"] for s in self._answer["where"]["stages"]}

    @property
    def how_far(self) -> dict[str, Any]:
        """Part of the gap that the named effects close on samples that were not fitted.

        If no effect is named, the numbers are those of the most probable candidate.

        Returns
        -------
        dict
            `closed` is the closed share of the gap, at most 1, and `interval` its 95 % interval, a tuple of two floats.
            `as_shipped`, `retuned` and `with_effects` are dicts by output column with the root mean square error in multiples
            of the noise, for the simulator as it is, with re-tuned parameters, and with the effects. Noise alone gives 1.
        """
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
        """Values of the nominal parameters that have a tolerance, dict by name, re-tuned together with the named effects.

        A parameter that is far outside its tolerance (verdict `"record"`) has the value with which the simulator agrees.
        """
        return {p["name"]: p["fitted"] for p in self._answer["parameters"]} | _corrected(self._answer)

    @property
    def effects(self) -> dict[str, dict[str, float]]:
        """Fitted values of the named effects, dict by effect of dicts by argument."""
        found: dict[str, dict[str, float]] = {name: {} for name in self.named}
        for value in self._best_values():
            if value["effect"] in found:
                found[value["effect"]][value["name"]] = value["value"]
        return found

    @property
    def parameter_intervals(self) -> dict[str, tuple[float, float]]:
        """95 % intervals of the values in `parameters`, dict by name, in the unit of the parameter.

        An interval is the value plus and minus 1.96 standard deviations. It accounts for the uncertainty of all other values that
        are fitted together with it, and assumes that the simulator with the named effects is correct. The two ends are equal if
        the parameter is exact.
        """
        shifts = self._answer["parameters"]
        reach = {p["name"]: 1.96 * p.get("sd", 0.0) for p in shifts}
        return {name: (value - reach[name], value + reach[name]) for name, value in self.parameters.items()}

    @property
    def effect_intervals(self) -> dict[str, dict[str, tuple[float, float]]]:
        """95 % intervals of the values in `effects`, dict by effect of dicts by argument, within the ranges of the arguments."""
        found: dict[str, dict[str, tuple[float, float]]] = {name: {} for name in self.named}
        for value in self._best_values():
            if value["effect"] in found and "interval" in value:
                found[value["effect"]][value["name"]] = (value["interval"][0], value["interval"][1])
        return found

    def _best_values(self) -> list[dict[str, Any]]:
        candidates = self._answer["candidates"]
        return list(candidates[0]["parameter_values"]) if candidates and self.named else []

    @property
    def rivals(self) -> list[str]:
        """Further effects that these data cannot rule out, list of str."""
        return [effect for effect in self._answer["ambiguous"] if effect not in self.named]

    @property
    def families(self) -> list[dict[str, Any]]:
        """Groups of effects that these data cannot distinguish, list of dicts.

        The effects of a group agree on one property, for example the delay at the output. Each dict holds `names` (the effects,
        the named one first), `titles` (their kinds in words), `property` (`late` or `loop`), `place`, and `range` and `unit`
        (least and greatest value of the property).
        """
        effects = self._answer["answer"].get("effects", [])
        return [effect["family"] for effect in effects if effect.get("family")]

    @property
    def next_experiment(self) -> dict[str, Any] | None:
        """Experiment that would distinguish the effects that these data cannot, or None.

        The experiment is searched only if `diagnose` is called with `experiment=True`. The dict holds among others `name`,
        `why` (a sentence that describes the experiment), `minutes` (its duration), `separates` (the effects that it
        distinguishes; empty if no experiment is likely to) and `columns` (a dict of arrays with the commands and `time_s`). The
        commands begin at the first recorded values and are no faster than the recorded ones.
        """
        found = self._answer.get("next_experiment")
        return {**found, "columns": dict(self._experiment or {})} if found else None

    @property
    def proposed(self) -> dict[str, Any] | None:
        """Proposed equation for a gap that the effects of the list do not explain, or None.

        The dict holds among others `equation` (empty if none was found), `sentence`, `channel` (the output to which the
        equation is added) and `closes_test` (share of the gap that the equation closes on test trials).
        """
        proposed = self._answer.get("proposed")
        return dict(proposed) if proposed else None

    @property
    def identifiability(self) -> list[dict[str, Any]]:
        """How well these data determine each nominal parameter, list of dicts.

        Each dict holds among others `name`, `unit`, `knowledge` (how well the parameter is determined), `tolerance` and `sd`
        (standard deviations without and with the data), `like` (parameters that have the same effect on these data) and
        `at_bound` (whether the value is at the end of its tolerances or of its range).
        """
        return list(self._answer.get("identifiability", []))

    @property
    def notes(self) -> list[str]:
        """Notes, list of str: changes that were made to the recordings, limits of the data, and columns to check."""
        return [note["text"] for note in self._answer["notes"]]

    @property
    def compared(self) -> list[dict[str, Any]]:
        """Differences of two recordings, list of dicts by column. Empty unless `compare` returned the diagnosis.

        Each dict holds `a` and `b` (the columns), `sentence`, and dicts with the `value` and the 95 % `interval` of `gain`,
        `offset`, `delay_s` (in the middle of the common time) and `clock_rate` (s/s). `units` are the units of both columns if
        these explain the gain, else None. `difference`, `left`, `noise` and `range` are in the unit of `b`: root mean square
        before and after gain, offset and clock are fitted, one standard deviation of the noise, and the range of the column.
        `octaves` lists what is left by frequency, in multiples of the noise.
        """
        return list(self._answer.get("compared", []))

    @property
    def note_codes(self) -> list[str]:
        """Codes of the `notes` for programs, list of str in the same order, for example `"budget_spent"`."""
        return [note["code"] for note in self._answer["notes"]]

    @property
    def model_runs(self) -> int:
        """Number of simulator runs, int. One run simulates one set of values."""
        runs = self._answer.get("model_runs")
        return int(runs["count"]) if isinstance(runs, dict) else int(self._answer["simulations"])

    def curves(self, output: str | None = None) -> dict[str, Array]:
        """Return the measured and the simulated curves of one output, all trials end to end.

        Parameters
        ----------
        output : str, optional
            Column of the output. By default the output of the first stage.

        Returns
        -------
        dict of str to ndarray of shape (samples,)
            `measured`, `as_shipped` (the simulator as it is), `retuned` (with re-tuned parameters) and `with_effects` (with the
            best effects as well), in the unit of the output.

        Raises
        ------
        StretchError
            If there is no such output, or if the diagnosis was read from text.

        Examples
        --------
        >>> curves = found.curves("length_mm")
        >>> {name: curve.shape for name, curve in curves.items()}
        {'measured': (6000,), 'as_shipped': (6000,), 'retuned': (6000,), 'with_effects': (6000,)}
        >>> bool(np.std(curves["measured"] - curves["with_effects"]) < 0.02)
        True
        """
        four = self._held(self._curves, "curves")[figures.output_of(self._curves, output)]
        return dict(zip(("measured", "as_shipped", "retuned", "with_effects"), four))

    def plot(self, output: str | None = None) -> Any:
        """Draw the curves of one output, and measured minus simulated below them. Requires matplotlib.

        Parameters
        ----------
        output : str, optional
            Column of the output. By default the output of the first stage.

        Returns
        -------
        ndarray of matplotlib.axes.Axes
            The upper and the lower axes.

        Raises
        ------
        StretchError
            If there is no such output, if the diagnosis was read from text, or if matplotlib is not installed.

        Examples
        --------
        >>> curves, residuals = found.plot()
        >>> curves.get_ylabel()
        'length_mm'
        """
        values = self.curves(output)
        return figures.draw(values, self._session["dt_s"], figures.output_of(self._curves, output), self.sentence)

    def _held(self, value: Any, what: str) -> Any:
        """Return a value that a diagnosis from text does not have."""
        if not value:
            raise StretchError(f"this diagnosis was read from text, which contains no {what}; diagnose again")
        return value

    def fix(self) -> Fix:
        """Return the changes that the simulator needs.

        Returns
        -------
        Fix
            Re-tuned parameters, values of the named effects, and both as Python code. The fix is called in place of the
            simulator. `Fix.predict` predicts new recordings, and `Fix.diagnose` diagnoses the fixed simulator. If the diagnosis
            was read from text, the code contains equations instead of functions, and the fix cannot be run. If the fixed
            simulator was diagnosed, the effects of the earlier fix come first.

        Examples
        --------
        >>> fix = found.fix()
        >>> round(fix.parameters["compliance"], 2), round(fix.effects["output.delay"]["delay_s"], 3)
        (2.1, 0.06)
        >>> fixed = fix(inputs={"force_N": np.ones(200)})  # called in place of `spring`
        >>> round(float(fixed[-1]), 2)
        2.1
        """
        implement = self._answer.get("implement", [])
        return fix(self.parameters, self.effects, implement, self._functions, self._again, self._why_not(), self._earlier)

    def draw(self, count: int, seed: int = 0) -> list[dict[str, float]]:
        """Draw simulators for domain randomisation.

        The values of a simulator are drawn together, because the data often determine a combination of parameters better than
        each of them. If the data cannot tell which effect is missing, the simulators have different effects, in proportion to
        the probabilities.

        Parameters
        ----------
        count : int
            Number of simulators.
        seed : int, default 0
            Seed of the random numbers.

        Returns
        -------
        list of dict of str to float
            For each simulator the re-tuned parameters by name, and the parameters of its effects by `effect.parameter`.

        Raises
        ------
        StretchError
            If the recording is wrong or the gap is not explained: the ranges would not contain the real machine.

        Examples
        --------
        >>> simulators = found.draw(100)
        >>> list(simulators[0])
        ['compliance', 'output.delay.delay_s', 'output.delay.empty']
        >>> bool(np.std([one["output.delay.delay_s"] for one in simulators]) < 1e-4)
        True
        """
        ranges = self._answer.get("ranges")
        if not ranges:
            raise StretchError(f"there are no ranges to draw from, because the verdict is {self.verdict!r}: {self.sentence}")
        random = np.random.default_rng(seed)
        sets = ranges["sets"]
        chosen = random.choice(len(sets), count, p=[one["probability"] for one in sets])
        return [_drawn(sets[at], random) for at in chosen]

    def _why_not(self) -> str:
        """Return the reason why the fix cannot be run, if it cannot."""
        if not self._session:
            return "the diagnosis was read from text, which does not contain the simulator; diagnose again"
        if self._is_copy:
            return COPIED
        if self.verdict == "record":
            return "the recording is wrong, so nothing was fitted to it; correct the recording, and diagnose again"
        return (
            f"the verdict is {self.verdict!r}: the diagnosis names no effect and re-tunes no parameter; read the attributes "
            "sentence and notes of the diagnosis, or examine more effects (arguments wrap and effects of diagnose)"
        )

    def apply(self, spec: Any) -> list[str]:
        """Write the result into a MuJoCo specification, a URDF or an SDF. `stretch_gap.mujoco.apply` describes what is written.

        Parameters
        ----------
        spec : mujoco.MjSpec or xml.etree.ElementTree.Element
            Specification of the model, usually `problem.spec`, or the root element of a URDF or an SDF. It is changed in place.

        Returns
        -------
        list of str
            Parameters and named effects that the description cannot represent. `fix().code` contains functions for the effects.

        Raises
        ------
        StretchError
            If the description does not contain a joint or an actuator of the diagnosis, or is of another kind.

        Examples
        --------
        >>> left = found.apply(problem.spec)  # doctest: +SKIP
        """
        from . import mujoco

        return mujoco.apply(self, spec)

    def to_rerun(self, path: str | os.PathLike[str]) -> None:
        """Write the curves and their residuals as a recording for the Rerun viewer. Requires rerun-sdk.

        For each trial and output the recording contains the curves of `curves`, and for each simulated curve the residual, that
        is, measured minus simulated. All are on the time line `session`, in seconds.

        Parameters
        ----------
        path : str or path-like
            File to write. An existing file is replaced only if its name ends in `.rrd`.

        Raises
        ------
        StretchError
            If the diagnosis was read from text, if rerun-sdk is not installed, or if the file exists under a name with another
            ending.

        Examples
        --------
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     found.to_rerun(f"{folder}/why.rrd")
        """
        self._held(self._curves, "curves")
        spans = [(trial["name"], trial["samples"], trial["start_s"]) for trial in self._session["trials"]]
        timeline.write(path, self._curves, spans, self._session["dt_s"], self.sentence)

    def to_json(self) -> str:
        """Return the diagnosis as JSON, without curves and report.

        Returns
        -------
        str
            JSON as written by `stretch diagnose --json` and read by `Diagnosis.from_json` and `stretch calibrate --from`.

        Examples
        --------
        >>> import json
        >>> json.loads(found.to_json())["named"]
        ['output.delay']
        """
        return json.dumps(self._answer, indent=2)

    def to_frame(self) -> Any:
        """Return the candidates as a table with one row for each.

        Returns
        -------
        pandas.DataFrame or dict of str to list
            The table, with the columns `effects`, `probability`, `closed` (closed share of the gap, with its 95 % interval from
            `closed_low` to `closed_high`), `gap_before` and `gap_after` (gap without and with the effects, in multiples of the
            noise variance), and `parameters` (values of the effects). A dict of columns if pandas is not installed.

        Examples
        --------
        >>> list(found.to_frame()["effects"])[0]
        'output.delay'
        """
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
        """Return the report with its figures as one HTML page that needs no network, and optionally write it.

        Parameters
        ----------
        path : str or path-like, optional
            File to write. An existing file is replaced only if its name ends in `.html`. By default no file is written.

        Returns
        -------
        str
            The HTML page.

        Raises
        ------
        StretchError
            If the diagnosis was read from text, or if the file exists under a name with another ending.

        Examples
        --------
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     page = found.report(f"{folder}/spring.html")
        >>> page[:15]
        '<!DOCTYPE html>'
        """
        self._held(self._page, "report")
        if path is not None:
            with open(replaceable(path, ".html"), "w", encoding="utf-8") as file:
                file.write(self._page)
        return self._page

    def __repr__(self) -> str:
        lines = [line for one in (*(c["sentence"] for c in self.compared), self.sentence) for line in textwrap.wrap(one, 100)]
        shares = sorted(self.where.items(), key=lambda item: -item[1])[:SHOWN]
        lines += ["", "share of the gap:"] + [f"  {channel:<40} {100 * share:3.0f} %" for channel, share in shares]
        likely = sorted(self.probabilities.items(), key=lambda item: -item[1])[:SHOWN]
        lines += ["probability:"] + [f"  {name:<40} {p:.2f}" for name, p in likely]
        values = [f"{effect}: {name} = {x:.4g}" for effect, own in self.effects.items() for name, x in own.items()]
        lines += ["values:"] * bool(values) + [f"  {value}" for value in values]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        if self._page:
            # An iframe keeps the styles of the page and of the notebook apart. It takes the height of its content. The page
            # begins with the sentence.
            fit = "this.style.height=this.contentDocument.documentElement.scrollHeight+'px'"
            style = "width:100%;height:40em;border:0"
            return f'<iframe srcdoc="{escape(self._page)}" style="{style}" onload="{fit}"></iframe>'
        rows = [[name, f"{p:.3f}"] for name, p in self.probabilities.items()]
        sentence = f"<p><b>{escape(self.sentence)}</b></p>"
        return sentence + html.table(["candidate", "probability"], rows) + html.notes(self.notes)


def diagnose(
    simulator: Any,
    data: entries.Data,
    *,
    output: str | None = None,
    inputs: str | Sequence[str] = (),
    stages: Sequence[entries.Stage] | None = None,
    parameters: Mapping[str, entries.ParameterLike] | None = None,
    effects: Mapping[str, entries.EffectLike] | None = None,
    wrap: str | Sequence[str] | None = "all",
    rate_hz: float | None = None,
    units: Mapping[str, str] | None = None,
    noise: Mapping[str, float] | None = None,
    velocity: str | None = None,
    position: str | None = None,
    beside: str | Sequence[str] = (),
    without: str | Sequence[str] = (),
    reference: str | None = None,
    experiment: bool = False,
    budget: int | None = None,
    depth: int = 4,
    seed: int = 1,
    threads: int = 0,
    name: str = "data",
    progress: Callable[[str], Any] | None = None,
) -> Diagnosis:
    """Compare a simulator with recordings, and find the effects that the simulator lacks.

    The nominal parameters are re-tuned within their tolerances first. An effect is named only if the re-tuned simulator cannot
    explain the recordings.

    Parameters
    ----------
    simulator : object, callable or None
        Simulator in one of two forms:

        - an object with a method `simulate(params, effects)`, which simulates n models per call. `params` is an array of shape
          `(n, parameters)` and `effects` of shape `(n, effects)`, in the order of the arguments `parameters` and `effects`.
          Both also return a column by its name: `effects["delay_s"]` has the shape `(n,)`. The method returns an array of shape
          `(n, samples)`. The attribute `batch` of the object is the largest n, by default 64.
        - a function `f(params, effects)` of one model. Both arguments are dicts of floats. It returns an array of shape
          `(samples,)`.

        With several outputs, the simulator returns a dict of arrays by output column. It may take further arguments by name:

        - `inputs`: dict of arrays by column, with all columns that the problem uses, and with `time_s`, the time since the
          start of the recording. The samples are evenly spaced, so `time_s[1]` is the sample time. An effect at an input alters
          the column of this input; the others are as measured. The arrays have the shape `(n, samples)`, and `(samples,)` for a
          function. If the simulator does not take this argument, effects at the inputs are not examined.
        - `first`: dict of floats by column, the first measured value of each column in the recording. Use it as the initial
          state, unless every recording starts at rest.
        - `trials`: list with the `name`, `samples` (a slice), `start_s` and `first` of each requested recording.
        - `stage`: number of the requested stage, from 0. The simulator then returns the output of this stage only.

        A simulator that takes `inputs` or `first`, but not `trials`, is called once per recording. Any other simulator is
        called once for all recordings end to end. If the simulator has a method `begin(session)`, it is called once, before the
        first simulation, with everything that stays the same, such as the sample time `session["dt_s"]`. None runs the
        simulator that a `problem.toml` names.
    data : dict of str to array_like, data frame, Trial, str, path-like, or list of these
        Recordings: arrays or a data frame by column (the index of a data frame may be the time), a `Trial`, the path of a
        recording (see `read`), or a list of these. Or the path of a `problem.toml`, which defines the problem completely. The
        arguments `output`, `stages`, `parameters` and `effects` are then errors, and the arguments from `inputs` to `reference`
        have no effect.
    output : str, optional
        Column of the measurement that the simulation is compared with. Give either `output` or `stages`.
    inputs : str or sequence of str, default ()
        Columns that drive the simulator. Ignored if `stages` is given.
    stages : sequence of Stage, optional
        Stages of a simulator with several outputs.
    parameters : dict of str to Parameter, tuple or float, optional
        Nominal parameters by name: a `Parameter`, a tuple `(value, tolerance)`, or a number that is exact. By default there are
        none.
    effects : dict of str to Effect, Argument or tuple, optional
        Effects that the simulator itself implements, by name: an `Effect`, an `Argument`, a tuple `(least, greatest)` of an
        effect that does nothing at 0, or a tuple `(least, greatest, off)`. By default there are none.
    wrap : str, sequence of str, or None, default "all"
        Effects to examine around the simulator, such as `"input.delay"`, `"output.backlash"` or `"output.all"`. With several
        stages the name of the stage or of the output column comes first: `"gear.output.curve"`, `"shaft_deg.lag"`. `"all"`
        examines all usual effects, None or `()` none. `wrappers` lists the kinds.
    rate_hz : float, optional
        Sample rate in Hz of recordings that have neither `time_s` nor a rate.
    units : dict of str to str, optional
        Units by column. By default the unit is the last part of the column's name.
    noise : dict of str to float, optional
        Noise by column, one standard deviation in the unit of the column. By default the noise of outputs is estimated from the
        recordings, and that of inputs is 0. Noise of inputs is ignored if the simulator does not take the argument `inputs`.
    velocity : str, optional
        Column of the velocity at which parts with friction move. Ignored if `stages` is given.
    position : str, optional
        Column of the position from which this velocity is computed. Ignored if `stages` is given.
    beside : str or sequence of str, default ()
        Further columns that effects may depend on: channels with possible cross-talk, or loads of a contact.
    without : str or sequence of str, default ()
        Effects that are not examined, by name (`"output.backlash"`), kind (`"backlash"`) or place (`"output.all"`).
    reference : str, optional
        Column of the quantity that the output measures, if the output is the signal of a sensor. With `stages` this output is
        that of the last stage. The diagnosis then reports how much the gap degrades a calibration of the sensor.
    experiment : bool, default False
        Whether to search for an experiment that would distinguish the effects that these data cannot. The simulator must take
        `inputs`.
    budget : int, optional
        Largest number of simulator runs. One run simulates one model. By default the number is not limited, or limited by the
        `problem.toml`.
    depth : int, default 4
        Largest number of effects that are named together, at least 1.
    seed : int, default 1
        Seed of the random resampling from which intervals and `Diagnosis.stability` are computed.
    threads : int, default 0
        Number of threads for the computation, at most one per core. 0 uses the environment variable `RAYON_NUM_THREADS`, or
        else all cores. The result does not depend on it. The simulator always runs on the calling thread.
    name : str, default "data"
        Name of the problem in the report. A `problem.toml` provides the default.
    progress : callable, optional
        Function that is called with a short text at each step. An exception that it raises ends the diagnosis. By default a
        notebook shows the progress if tqdm is installed.

    Returns
    -------
    Diagnosis
        Named effects, probabilities, re-tuned parameters, curves and report.

    Raises
    ------
    StretchError
        If the data, the arguments or the arrays that the simulator returns are wrong. The message says what to do.
    Exception
        Any exception of the simulator or of `progress`. From Python 3.11 on, a note of the exception says with which values the
        simulator was called. Only `Refused` is handled: it tells the fit that these values cannot be simulated.

    Warns
    -----
    DoubtWarning
        If samples count as lost because a column has no number there (code `missing_samples`), if the time stamps seem to be in
        milliseconds (`slow_clock`), or if a tuple of a parameter may be a range (`large_tolerance`).

    Examples
    --------
    A spring is softer than the simulator assumes, and its length is measured 60 ms late.

    >>> import numpy as np
    >>> import stretch_gap
    >>> time_s = np.arange(0, 60, 0.01)
    >>> force = 20 * np.sin(1.3 * time_s) + 10 * np.sin(3.1 * time_s)
    >>> noise = 0.01 * np.random.default_rng(0).normal(size=time_s.size)
    >>> length = 2.1 * np.interp(time_s - 0.06, time_s, force) + noise
    >>> def spring(params, effects):
    ...     return params["compliance"] * force + effects["bend"] * force**2
    >>> found = stretch_gap.diagnose(
    ...     spring,
    ...     {"time_s": time_s, "force_N": force, "length_mm": length},
    ...     output="length_mm",
    ...     inputs=["force_N"],
    ...     parameters={"compliance": stretch_gap.Parameter(2.0, relative=0.1, unit="mm/N")},
    ...     effects={"bend": (-0.01, 0.01)},
    ...     wrap=["output.delay", "output.backlash", "output.saturation"],
    ... )
    >>> found.named
    ['output.delay']
    >>> round(found.effects["output.delay"]["delay_s"], 3), round(found.parameters["compliance"], 2)
    (0.06, 2.1)
    """
    if depth == 0:
        raise StretchError("depth is 0, the largest number of effects that may be named; give 1 or more")
    asked = None if simulator is None else Asked(simulator)
    notes: list[str] = []
    nominal: dict[str, float] = {}
    off: list[float] = []
    if isinstance(data, (str, os.PathLike)) and os.fspath(data).endswith(".toml"):
        if output is not None or stages is not None or parameters or effects:
            raise StretchError(f"{os.fspath(data)} defines output, stages, parameters and effects; leave these arguments out")
        checked = _stretch.Problem.read(data, asked is None or asked.takes_inputs)
        name = checked.name if name == "data" else name
    else:
        if asked is None:
            raise StretchError(
                "there is no simulator, because simulator is None; give one, or give the path of a problem.toml as data"
            )
        trials = entries.trials(data, rate_hz)
        if (output is None) == (stages is None):
            raise StretchError(f"give either output, the name of the measured column, or stages{_example(data, trials)}")
        listed = list(stages or [entries.Stage(str(output), inputs, velocity=velocity, position=position)])
        units = entries.by_name("units", units, '{"force": "N"}')
        noise = entries.by_name("noise", noise, '{"length_mm": 0.1}')
        beside = entries.texts("beside", beside)
        wanted = entries.wanted(listed, [*beside, *([reference] if reference else [])])
        trials = entries.trials(trials, rate_hz, [*wanted, *units, *noise])
        asked.recorded = frozenset(str(column) for trial in trials for column in trial.columns)
        units = _by_column("units", units, asked.recorded, entries.text)
        noise = _by_column("noise", noise, asked.recorded, entries.deviation)
        wrappers = _wrappers(entries.texts("wrap", wrap), listed, asked, notes)
        own = [entries.effect(key, value) for key, value in entries.by_name("effects", effects, EFFECTS).items()]
        off = [a["range"][0] if a["off"] is None else a["off"] for effect in own for a in effect["argument"]]
        shipped = [entries.parameter(key, value) for key, value in entries.by_name("parameters", parameters, PARAMETERS).items()]
        nominal = {one["name"]: one["value"] for one in shipped}
        for one in own:
            if one["name"] in nominal:
                raise StretchError(f"effects: {one['name']} is also the name of a parameter; give the effect another name")
        problem = {
            "stage": [entries.stage(one, i, units, noise) for i, one in enumerate(listed)],
            "input": _inputs(listed, units, noise if asked.takes_inputs else {}),
            "parameter": shipped,
            "effect": own,
            "wrap": wrappers,
            "without": entries.texts("without", without),
            "beside": beside,
            "reference": reference,
            "signal": (output or listed[-1].output) if reference else None,
        }
        checked = _stretch.Problem(json.dumps(problem), entries.recorded(trials, rate_hz, wanted))
    how = {
        "name": name,
        "depth": entries.whole("depth", depth, 1),
        "seed": entries.whole("seed", seed, 0),
        "threads": entries.whole("threads", threads, 0),
        "budget": None if budget is None else entries.whole("budget", budget, 1),
        "batch": 1 if asked is None else asked.batch,
        "answers_all": asked is not None and asked.answers_all,
        "takes_inputs": asked is None or asked.takes_inputs,
        "experiment": experiment,
    }
    session = json.loads(checked.session)
    return run(checked, session, asked, how, progress, notes, nominal, dict(zip(session["effects"], off)))


def _corrected(answer: Mapping[str, Any]) -> dict[str, float]:
    """Return the parameters that are far outside their tolerances, if nothing else is wrong, with the values that fit."""
    errors = answer["answer"].get("errors", [])
    values = {one["parameter"]: one["found"] for one in errors if one["what"] == "parameter"}
    return values if len(values) == len(errors) else {}


EFFECTS = '{"friction": (0.0, 5.0)}, with the least and the greatest value; effects around the simulator belong in wrap'
PARAMETERS = '{"mass": stretch_gap.Parameter(10.0, relative=0.1)}'


def _drawn(one: Mapping[str, Any], random: np.random.Generator) -> dict[str, float]:
    """Draw the values of one simulator with a set of effects."""
    moved = np.array(one["factor"]) @ random.standard_normal(len(one["parameters"]))
    values: dict[str, float] = dict(one["fixed"])
    for p, d in zip(one["parameters"], moved):
        value = p["value"] * np.exp(d) if p["is_log"] else p["value"] + d
        values[p["name"]] = float(np.clip(value, p["least"], p["greatest"]))
    return values


def _example(data: Any, trials: Sequence[entries.Trial]) -> str:
    """Return an example of a call with the columns of the recording, for a message."""
    columns = [str(column) for column in trials[0].columns if column not in entries.CLOCKS] if trials else []
    if not columns:
        return ""
    shown = repr(os.fspath(data)) if isinstance(data, (str, os.PathLike)) else "data"
    driven = f', inputs=["{columns[0]}"]' if len(columns) > 1 else ""
    call = f'stretch_gap.diagnose(simulator, {shown}, output="{columns[-1]}"{driven}, parameters={PARAMETERS})'
    return f"; the columns are {', '.join(columns)}, so an example is {call}"


def _by_column(
    what: str, values: Mapping[str, Any], columns: frozenset[str], value_of: Callable[[str, Any], Any]
) -> dict[str, Any]:
    """Return values by column that the user gave. Columns that no recording has are refused."""
    for column in values:
        if column not in {*columns, *entries.CLOCKS}:
            raise unknown("column", column, sorted(columns), f"{what}: ")
    return {column: value_of(f"{what} of {column}", value) for column, value in values.items()}


def _inputs(stages: Sequence[entries.Stage], units: Mapping[str, str], noise: Mapping[str, float]) -> list[dict[str, Any]]:
    """Return the inputs of all stages in the form of the native module."""
    driven = dict.fromkeys(column for one in stages for column in one.inputs)
    return [{"column": c, "unit": units.get(c, ""), "noise": noise.get(c, 0.0)} for c in driven]


def run(
    checked: _stretch.Problem,
    session: dict[str, Any],
    asked: Asked | None,
    how: dict[str, Any],
    progress: Callable[[str], Any] | None,
    notes: list[str],
    nominal: dict[str, float],
    off: dict[str, float],
    earlier: Fix | None = None,
) -> Diagnosis:
    """Diagnose a checked problem with its parsed session. `notes` precede the notes of the diagnosis.

    For `nominal` and `off` see `Again`. `earlier` is the fix that is in the problem.
    """
    if asked is not None:
        asked.bind({**session, "columns": checked.columns})
    with figures.shown(progress, asked, how["budget"]) as report:
        try:
            text, page, curves, functions, trial, fixed = checked.diagnose(asked, json.dumps(how), report)
        except StretchError as error:
            if asked is None or asked.answers or not isinstance(asked.refusal, Refused):
                raise
            raise StretchError(
                f"the simulator refused every request, the nominal values included: {error}; raise stretch_gap.Refused only for "
                "values that cannot be simulated"
            ) from asked.refusal
    answer = json.loads(text)
    answer["notes"] = [{"code": "recording", "text": note} for note in notes] + answer["notes"]
    again = Again(fixed, asked, how, session, nominal, off) if fixed or _corrected(answer) else None
    return Diagnosis(answer, page, curves, functions, trial, session, again, earlier)


def wrappers() -> Any:
    """List the kinds of effects that can be wrapped around a simulator.

    Returns
    -------
    pandas.DataFrame or dict of str to list
        Table with one row for each kind and these columns: `kind` (its name, as used in the argument `wrap` of `diagnose`),
        `words` (a description), `equation` (in which x is the signal before and y the signal after the effect) and `wrap` (sides
        of the simulator, `input` or `output`, at which `wrap="all"` searches for it). A dict of columns if pandas is not
        installed.

    Examples
    --------
    >>> import stretch_gap
    >>> kinds = stretch_gap.wrappers()
    >>> "delay" in list(kinds["kind"])
    True
    """
    # pandas prints the first and the last columns of a wide table.
    keys = ("kind", "words", "equation", "wrap")
    return frame([dict(zip(keys, (kind, *words, sides))) for kind, sides, *words in _stretch.wrappers()])


def _wrappers(names: list[str], stages: Sequence[entries.Stage], asked: Asked, notes: list[str]) -> list[str]:
    """Return the wrappers to examine. Wrappers at inputs are refused if the simulator does not take altered inputs."""
    driven = list(dict.fromkeys(column for one in stages for column in one.inputs))
    sides = [] if asked.takes_inputs else ["input", *driven]
    places = (
        [one.output for one in stages] if len(stages) > 1 else ["input", "output"][0 if asked.takes_inputs and driven else 1 :]
    )
    kinds = [kind for kind, *_ in _stretch.wrappers()]
    for one in names:
        kind = next(iter(difflib.get_close_matches(one, kinds, 1)), "") if "." not in one and one != "all" else ""
        if kind:
            named = " or ".join(f"{place}.{kind}" for place in places)
            raise StretchError(f"wrap: {one} has no place; did you mean {named}? wrap='all' examines all usual effects")
        if one.split(".", 1)[0] in sides:
            raise StretchError(
                f"wrap: {one} alters an input, so the simulator must take the argument inputs, as in simulate(params, effects, "
                "inputs); add this argument, or leave the wrapper out"
            )
    if asked.takes_inputs:
        return names
    if "all" in names and driven:
        notes.append("effects at the inputs were not examined, because the simulator does not take the argument inputs")
    return ["output.all" if one == "all" else one for one in names]
