"""Changes that a simulator needs according to a diagnosis, and predictions of the fixed simulator."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Any

from . import figures, html
from . import problem as entries
from ._stretch import Fixed, StretchError, comment, identifier
from .recordings import Array
from .simulator import Asked


@dataclass(frozen=True)
class Again:
    """Inputs of a run of the fixed simulator: the fixed problem, the user's simulator, and the options of the diagnosis."""

    fixed: Fixed
    asked: Asked | None
    how: dict[str, Any]


@dataclass(frozen=True)
class Fix:
    """Changes that the simulator needs: re-tuned parameters and the named effects.

    `Diagnosis.fix` returns this class.

    Attributes
    ----------
    parameters : dict of str to float
        Values of all nominal parameters, re-tuned together with the named effects.
    effects : dict of str to dict of str to float
        Values of the named effects, by effect and argument.
    code : str
        The same as Python code to paste into the simulator: the parameters, a function for each effect around the simulator,
        and the values of each effect that the simulator itself implements.
    """

    parameters: dict[str, float]
    effects: dict[str, dict[str, float]]
    code: str
    _again: Again | None = field(default=None, repr=False)

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
            Function that is called with a short text at each step. By default a notebook shows a progress bar if tqdm is
            installed.

        Returns
        -------
        Prediction
            Errors and curves with the fix and without it. Without the fix, the parameters are re-tuned without the effects.

        Raises
        ------
        StretchError
            If there is no simulator to run, because the diagnosis was read from text or names no effect, or if the recordings
            are wrong.
        """
        again = self._runnable()
        fitted, begins_s = again.fixed.fitted
        recorded = entries.recorded(data, rate_hz, again.fixed.columns)
        later = [(columns, begins_s + start_s, True) for columns, start_s, _ in recorded]
        checked = again.fixed.problem(later, False)
        session = json.loads(checked.session)
        if again.asked is not None:
            again.asked.bind({**session, "columns": checked.columns})
        with figures.shown(progress) as report:
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
            Function that is called with a short text at each step. By default a notebook shows a progress bar if tqdm is
            installed.

        Returns
        -------
        Diagnosis
            Diagnosis of the simulator with the re-tuned parameters and the named effects.

        Raises
        ------
        StretchError
            If there is no simulator to run, because the diagnosis was read from text or names no effect, or if the recordings
            are wrong.
        """
        from .diagnosis import run

        again = self._runnable()
        others = [] if data is None else entries.recorded(data, rate_hz, again.fixed.columns)
        return run(again.fixed.problem(others, data is not None), again.asked, again.how, progress, [])

    def _runnable(self) -> Again:
        if self._again is None:
            raise StretchError(
                "there is no simulator to run, because the diagnosis was read from text or names no effect; diagnose again"
            )
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
        return [words for trial in self._answer["trials"] for words in trial["extrapolated"]] + list(self._answer["notes"])

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
        """
        return figures.draw(self.curves(output), self._dt_s, figures.output_of(self._curves, output), self.sentence)

    def to_json(self) -> str:
        """Return the prediction as JSON, without the curves.

        Returns
        -------
        str
            JSON as written by `stretch predict --json`.
        """
        return json.dumps(self._answer, indent=2)

    def __repr__(self) -> str:
        return f"<Prediction: {self.sentence}>"

    def _repr_html_(self) -> str:
        head = ["recording", "output", "error without", "error with the fix", "unit", "times the noise"]
        keys = ("trial", "column", "rmse_without", "rmse", "unit", "times_noise")
        rows = [[one[key] for key in keys] for one in self.outputs]
        return f"<p><b>{escape(self.sentence)}</b></p>" + html.table(head, rows) + html.notes(self.notes)


def fix(
    parameters: Mapping[str, float],
    found: Mapping[str, dict[str, float]],
    implement: Sequence[Mapping[str, Any]],
    functions: Mapping[str, str],
    again: Again | None,
) -> Fix:
    """Return the fix.

    `found` holds the values of the named effects, `implement` their descriptions, and `functions` their code.
    """
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
    return Fix(dict(parameters), dict(found), "\n".join(lines) + "\n", again)
