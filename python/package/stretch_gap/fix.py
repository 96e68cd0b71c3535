"""Changes that a simulator needs according to a diagnosis, and predictions of the fixed simulator."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from html import escape
from types import NoneType
from typing import Any

import numpy as np

from . import figures, html
from . import problem as entries
from ._stretch import Fixed, StretchError, comment, identifier
from .around import Around, around
from .recordings import Array, unknown
from .simulator import Asked, Named

COPIED = "a copy or a pickle does not contain the simulator; use the original object, or diagnose again"
"""Reason why a copied fix cannot be run."""


@dataclass(frozen=True)
class Again:
    """Inputs of a run of the fixed simulator.

    `fixed` is the fixed problem, None if only a parameter was corrected that is far outside its tolerance, `asked` the user's
    simulator, `how` the options and `session` the session of the diagnosis. `nominal` holds the parameters as given, and `off`
    the values at which the simulator's own effects do nothing.
    """

    fixed: Fixed | None
    asked: Asked | None
    how: dict[str, Any]
    session: dict[str, Any]
    nominal: dict[str, float]
    off: dict[str, float]


@dataclass(frozen=True)
class Fix:
    """Changes that the simulator needs: re-tuned parameters and the named effects.

    `Diagnosis.fix` returns this class. A fix is also a simulator: call it in place of the user's own.

    Attributes
    ----------
    parameters : dict of str to float
        Values of the nominal parameters that have a tolerance, re-tuned together with the named effects.
    effects : dict of str to dict of str to float
        Values of the named effects, by effect and argument. A fix of a fixed simulator also has the effects of the earlier fix.
    code : str
        The same as Python code to paste into the simulator: the parameters, a function for each effect around the simulator,
        and the values of each effect that the simulator itself implements.

    Examples
    --------
    A spring is softer than the simulator assumes, and its length is measured 60 ms late. The examples of the methods use
    `found` and `fix`.

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
    >>> fix = found.fix()
    >>> round(fix.effects["output.delay"]["delay_s"], 3)
    0.06
    >>> "def output_delay(" in fix.code
    True
    """

    parameters: dict[str, float]
    effects: dict[str, dict[str, float]]
    code: str = field(repr=False)
    _again: Again | None = field(default=None, repr=False)
    _written: tuple[Sequence[Mapping[str, Any]], Mapping[str, str]] = field(default=((), {}), repr=False)
    _why_not: str = field(default="", repr=False)

    def __post_init__(self) -> None:
        asked = self._again and self._again.asked
        if asked:  # `Asked` looks here for the form of a simulator, and finds that of the user's
            vars(self).update({"simulate": self, "batch": asked.batch} if asked.many else {}, __signature__=asked.signature)

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy or a pickle contains: everything except the simulator, which often cannot be pickled."""
        return {**{one.name: getattr(self, one.name) for one in fields(self)}, "_again": None, "_why_not": COPIED}

    def __call__(self, params: Any = None, effects: Any = None, *more: Any, **named: Any) -> Any:
        """Run the fixed simulator: the user's simulator with the re-tuned parameters, and the named effects around it.

        A fix is called as the user's simulator is: if that is an object with a method `simulate`, so is the fix. `diagnose`
        takes a fix as its simulator, but `Fix.diagnose` is faster, and only its fix also lists the effects of this one. The
        sample time must be that of the diagnosis. An effect around the simulator begins at rest in each recording, at the first
        value of its column.

        Parameters
        ----------
        params : dict of str to float, or array_like of shape (n, parameters), optional
            Parameters in place of the re-tuned ones. A dict need not contain all of them.
        effects : dict of str to float, or array_like of shape (n, effects), optional
            Effects that the simulator itself implements. By default they do nothing. A named effect always has its fitted values.
        *more, **named : Any
            Further arguments of the user's simulator, such as `inputs`. The named effects at the inputs alter `inputs`.

        Returns
        -------
        ndarray, or dict of str to ndarray
            What the user's simulator returns, altered by the named effects at the outputs.

        Raises
        ------
        StretchError
            If an effect cannot be applied from outside the simulator, because it depends on more than the column that it alters.
            If the fix cannot be run, because the diagnosis was read from text, has the verdict `"unknown"`, found an error of the
            recording, or ran the simulator of a `problem.toml`. If an argument is unknown or missing.

        Examples
        --------
        >>> length = fix(inputs={"force_N": np.linspace(0, 30, 301)})
        >>> softer = fix({"compliance": 3.0}, inputs={"force_N": np.linspace(0, 30, 301)})
        >>> np.round([length[-1], softer[-1]], 1)
        array([61.7, 88.2])
        >>> stretch_gap.diagnose(fix, data, **question).verdict
        'no_gap'
        """
        again, asked = self._called()
        named.update(zip(list(asked.signature.parameters)[2:], more))
        values = {**again.nominal, **self.parameters, **_by_name("parameter", params, asked.parameters)}
        own = {**again.off, **_by_name("effect", effects, asked.effects)}
        for effect, found in self.effects.items():
            own.update({key: x for name, x in found.items() for key in (effect, f"{effect}.{name}") if key in asked.effects})
        for what, table, names, todo in (
            ("params", values, asked.parameters, "its value"),
            ("effects", own, asked.effects, "the value at which it does nothing"),
        ):
            for name in names:
                if name not in table:
                    raise StretchError(f"{what}: there is no value of {name}; give {todo}")
        if asked.many and "inputs" in named:  # a simulator of many models takes one row per model
            named["inputs"] = {name: np.atleast_2d(values) for name, values in named["inputs"].items()}
        spans = [trial.samples for trial in named.get("trials", [] if asked.is_called_once_a_trial else asked.spans)]
        for one in self._around:
            if one.is_in_front and "inputs" not in named:
                raise StretchError(f"{one.name} alters {one.columns[0]}, but there are no inputs; give the argument inputs")
            if one.is_in_front:
                if one.columns[0] not in named["inputs"]:
                    raise unknown("column", one.columns[0], named["inputs"], "inputs: ")
                named["inputs"] = one.act(named["inputs"], spans)
        try:
            asked.signature.bind({}, {}, **named)
        except TypeError as error:
            takes = ", ".join(list(asked.signature.parameters)[2:]) or "nothing else"
            raise StretchError(f"fix: {error}; after params and effects, the simulator takes {takes}") from error
        if asked.many:
            models = next((len(table) for table in (params, effects) if not isinstance(table, (Mapping, NoneType))), 1)
            given: tuple[Any, Any] = (_table(values, asked.parameters, models), _table(own, asked.effects, models))
        else:
            given = (values, own)
        try:
            answer = asked.called(*given, **named)
        except KeyError as error:
            missing = error.args[0] if error.args else None
            if missing in asked.columns and missing not in named.get("inputs", {missing}):
                raise unknown("column", missing, named["inputs"], "inputs: ") from error
            raise
        outputs = answer if isinstance(answer, dict) else {again.session["stages"][named.get("stage", 0)]["output"]: answer}
        for one in self._around:
            if not one.is_in_front:
                outputs = one.act(outputs, spans)
        return outputs if isinstance(answer, dict) else next(iter(outputs.values()))

    def begin(self, session: Mapping[str, Any]) -> None:
        """Take new recordings. `diagnose` calls this before it calls the fix.

        Parameters
        ----------
        session : dict
            What stays the same for all models, as for the method `begin` of the user's simulator.

        Raises
        ------
        StretchError
            If the fix cannot be called.

        Examples
        --------
        >>> stages = [{"inputs": ["force_N"], "output": "length_mm"}]
        >>> trials = [{"name": "tuesday", "samples": 3000, "start_s": 0.0}]
        >>> columns = {"force_N": force[:3000], "length_mm": length[:3000]}
        >>> fix.begin({"columns": columns, "stages": stages, "trials": trials})
        """
        again, asked = self._called()
        asked.bind({**session, "parameters": again.session["parameters"], "effects": again.session["effects"]})

    @cached_property
    def _around(self) -> list[Around]:
        return around(*self._written, self._runnable().session["stages"])

    def _called(self) -> tuple[Again, Asked]:
        again = self._runnable()
        if again.asked is None:
            raise StretchError(
                "the simulator of the problem.toml runs in another process and cannot be called; diagnose with its object or "
                "function in place of None, or use the methods predict and diagnose of the fix"
            )
        _ = self._around  # effects that cannot be applied are refused first
        return again, again.asked

    def predict(
        self, data: entries.Data, *, rate_hz: float | None = None, progress: Callable[[str], Any] | None = None
    ) -> Prediction:
        """Simulate new recordings with the fix and without it, and compare the errors. Nothing is fitted to the new recordings.

        Parameters
        ----------
        data : dict of str to array_like, data frame, Trial, str, path-like, or list of these
            New recordings, as in `diagnose`. They contain the inputs and the measured outputs.
        rate_hz : float, optional
            Sample rate in Hz of recordings that have neither `time_s` nor a rate.
        progress : callable, optional
            Function that is called with a short text at each step. By default a notebook shows the progress if tqdm is
            installed.

        Returns
        -------
        Prediction
            Errors and curves with the fix and without it. Without the fix, the parameters are re-tuned without the effects.

        Raises
        ------
        StretchError
            If the fix cannot be run, because the diagnosis was read from text or has the verdict `"unknown"` or `"record"`. If
            the recordings are wrong. If the simulator takes neither `inputs` nor `first` nor `trials` and has no method `begin`.

        Warns
        -----
        DoubtWarning
            If samples count as lost, or if the time stamps seem to be in milliseconds.

        Examples
        --------
        >>> new = {"time_s": time_s, "force_N": -force, "length_mm": -length}
        >>> predicted = fix.predict(new)
        >>> predicted.ratio < 0.1
        True
        >>> round(predicted.times_noise)
        1
        """
        again, fixed, recorded = self._recorded(data, rate_hz)
        fitted, begins_s = fixed.fitted
        later = [(columns, begins_s + start_s, True) for columns, start_s, _ in recorded]
        checked = fixed.problem(later, False)
        session = json.loads(checked.session)
        if again.asked is not None:
            again.asked.bind({**session, "columns": checked.columns})
        with figures.shown(progress, again.asked) as report:
            made = checked.predict(fitted, again.asked, json.dumps(again.how), report)
        return Prediction(*made, dt_s=float(session["dt_s"]))

    def diagnose(
        self,
        data: entries.Data | None = None,
        *,
        rate_hz: float | None = None,
        progress: Callable[[str], Any] | None = None,
    ) -> Any:
        """Diagnose the fixed simulator.

        Parameters
        ----------
        data : dict of str to array_like, data frame, Trial, str, path-like, or list of these, optional
            Recordings, as in `diagnose`. By default the recordings of the first diagnosis.
        rate_hz : float, optional
            Sample rate in Hz of recordings that have neither `time_s` nor a rate.
        progress : callable, optional
            Function that is called with a short text at each step. By default a notebook shows the progress if tqdm is
            installed.

        Returns
        -------
        Diagnosis
            Diagnosis of the simulator with the re-tuned parameters and the named effects.

        Raises
        ------
        StretchError
            If the fix cannot be run, because the diagnosis was read from text or has the verdict `"unknown"` or `"record"`. If
            the recordings are wrong. If the simulator takes neither `inputs` nor `first` nor `trials` and has no method `begin`.

        Warns
        -----
        DoubtWarning
            If samples count as lost, or if the time stamps seem to be in milliseconds.

        Examples
        --------
        >>> again = fix.diagnose()
        >>> again.verdict, again.named
        ('no_gap', [])
        >>> list(again.fix().effects)  # the effects of both diagnoses
        ['output.delay']
        """
        from .diagnosis import run

        again, fixed, others = (*self._fixed(), []) if data is None else self._recorded(data, rate_hz)
        problem = fixed.problem(others, data is not None)
        return run(problem, json.loads(problem.session), again.asked, again.how, progress, [], again.nominal, again.off, self)

    def _recorded(
        self, data: entries.Data, rate_hz: float | None
    ) -> tuple[Again, Fixed, list[tuple[dict[str, Any], float, bool]]]:
        """Return new recordings, if the simulator can be driven by them."""
        again, fixed = self._fixed()
        if again.asked and again.asked.optional <= {"stage"} and not hasattr(again.asked.simulator, "begin"):
            raise StretchError(
                "the simulator does not take the argument inputs, so it can only repeat the recordings that were fitted; let it "
                "take the columns of a recording, as in simulate(params, effects, inputs), and diagnose again"
            )
        return again, fixed, entries.recorded(data, rate_hz, fixed.columns)

    def _fixed(self) -> tuple[Again, Fixed]:
        again = self._runnable()
        if again.fixed is None:
            raise StretchError(
                "this fix can be called, but it cannot predict or diagnose, because a parameter is far outside its tolerance; "
                "diagnose again with the value in fix.parameters"
            )
        return again, again.fixed

    def _runnable(self) -> Again:
        if self._again is None:
            raise StretchError(f"this fix cannot be run, because {self._why_not}")
        return self._again

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.code)}</pre>"


class Prediction:
    """Predictions of recordings that were not fitted, with a fix of the simulator and without it.

    `Fix.predict` returns this class.

    Attributes
    ----------
    sentence : str
        Result in plain English.

    Examples
    --------
    A spring is softer than the simulator assumes, and its length is measured 60 ms late. The examples of the methods use
    `predicted`.

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
    >>> predicted = found.fix().predict({"time_s": time_s, "force_N": -force, "length_mm": -length})
    >>> predicted.ratio < 0.1
    True
    """

    def __init__(self, text: str, sentence: str, curves: Mapping[str, Sequence[Array]], dt_s: float) -> None:
        self._answer: dict[str, Any] = json.loads(text)
        self.sentence = sentence
        self._curves = curves
        self._dt_s = dt_s

    @property
    def ratio(self) -> float:
        """Error with the fix divided by error without it, float, as geometric mean over all recordings and outputs.

        Below 1 the fix helps. The parameters without the fix are re-tuned without the effects.
        """
        return float(self._answer["ratio"])

    @property
    def times_noise(self) -> float:
        """Largest error with the fix of any output and recording, float, in multiples of the noise. Noise alone gives 1."""
        return float(self._answer["largest_times_noise"])

    @property
    def holds(self) -> bool:
        """Whether the fix holds for the recordings, bool.

        It holds if the error of each output is at most 1.5 times that on the recordings of the diagnosis that were not fitted,
        in multiples of the noise, and below the error without the effects.
        """
        return bool(self._answer["holds"])

    @property
    def outputs(self) -> list[dict[str, Any]]:
        """Errors, list of dicts, one for each recording and output.

        Each dict holds `trial` (the recording), `stage`, `column`, `unit`, `noise`, `rmse` and `rmse_without` (root mean square
        error with the fix and without it, in `unit`), `times_noise` (`rmse` in multiples of the noise) and `ratio` (`rmse`
        divided by `rmse_without`).
        """
        return [{"trial": trial["name"], **one} for trial in self._answer["trials"] for one in trial["outputs"]]

    @property
    def notes(self) -> list[str]:
        """Notes, list of str: columns and rates of the recordings outside the fitted range, and observations in the recordings.

        Do not trust a prediction outside the fitted range.
        """
        outside = [f"{trial['name']}: {words}" for trial in self._answer["trials"] for words in trial["extrapolated"]]
        return outside + list(self._answer["notes"])

    def curves(self, output: str | None = None) -> dict[str, Array]:
        """Return the measured and the predicted curves of one output, all new recordings end to end.

        Parameters
        ----------
        output : str, optional
            Column of the output. By default the output of the first stage.

        Returns
        -------
        dict of str to ndarray of shape (samples,)
            `measured`, `without` (without the fix) and `with_effects` (with the fix), in the unit of the output.

        Raises
        ------
        StretchError
            If there is no such output.

        Examples
        --------
        >>> list(predicted.curves("length_mm"))
        ['measured', 'without', 'with_effects']
        """
        three = self._curves[figures.output_of(self._curves, output)]
        return dict(zip(("measured", "without", "with_effects"), three))

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
            If there is no such output, or if matplotlib is not installed.

        Examples
        --------
        >>> curves, residuals = predicted.plot()
        >>> curves.get_ylabel()
        'length_mm'
        """
        return figures.draw(self.curves(output), self._dt_s, figures.output_of(self._curves, output), self.sentence)

    def to_json(self) -> str:
        """Return the prediction as JSON, without the curves.

        Returns
        -------
        str
            JSON as written by `stretch predict --json`.

        Examples
        --------
        >>> import json
        >>> json.loads(predicted.to_json())["effects"]
        ['output.delay']
        """
        return json.dumps(self._answer, indent=2)

    def __repr__(self) -> str:
        return f"<Prediction: {self.sentence}>"

    def _repr_html_(self) -> str:
        head = ["recording", "output", "error without", "error with the fix", "unit", "times the noise"]
        keys = ("trial", "column", "rmse_without", "rmse", "unit", "times_noise")
        rows = [[one[key] for key in keys] for one in self.outputs]
        return f"<p><b>{escape(self.sentence)}</b></p>" + html.table(head, rows) + html.notes(self.notes)


def _by_name(what: str, given: Any, names: Sequence[str]) -> dict[str, Any]:
    """Return values by name, from a dict, from a table with a column for each name, or from None."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        given = dict(zip(getattr(given, "names", names), np.asarray(given).T))
    for name in given:
        if name not in names:
            raise unknown(what, name, names)
    return dict(given)


def _table(values: Mapping[str, Any], names: Sequence[str], models: int) -> Named:
    """Return the values as a table with a row for each model."""
    columns = [np.broadcast_to(values[name], models) for name in names]
    return Named.of(np.array(columns, dtype=np.float64).reshape(len(names), models).T, names)


def fix(
    parameters: Mapping[str, float],
    found: Mapping[str, dict[str, float]],
    implement: Sequence[Mapping[str, Any]],
    functions: Mapping[str, str],
    again: Again | None,
    why_not: str,
    earlier: Fix | None,
) -> Fix:
    """Return the fix.

    `found` holds the values of the named effects, `implement` their descriptions, and `functions` their code. `why_not` is the
    reason why the fix cannot be run, if `again` is None. `earlier` is the fix that was diagnosed again; its effects act too.
    """
    if earlier:
        found = {**earlier.effects, **found}
        implement, functions = [*earlier._written[0], *implement], {**earlier._written[1], **functions}
    described = {one["effect"]: one for one in implement}
    lines = ["# parameters, re-tuned together with the named effects", "parameters = {"]
    lines += [f"    {name!r}: {value!r}," for name, value in parameters.items()]
    lines.append("}")
    for name, values in found.items():
        if name in functions:
            lines += ["", "", functions[name].rstrip()]
            continue
        one = described.get(name, {})
        words = [f"{name}: {one.get('words', '')}", f"  {one.get('equation', '')}"]
        lines += ["", *map(comment, words), f"{identifier(name)} = {values!r}"]
    return Fix(dict(parameters), dict(found), "\n".join(lines) + "\n", again, (implement, functions), why_not)
