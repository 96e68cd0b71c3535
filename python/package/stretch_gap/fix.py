"""The changes that a diagnosis asks for: parameters re-tuned, the named effects as code, and the fixed simulator itself."""

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
    """What runs the fixed simulator: the fixed problem, the user's simulator, and the options of the diagnosis."""

    fixed: Fixed
    asked: Asked | None
    how: dict[str, Any]


@dataclass(frozen=True)
class Fix:
    """Parameters re-tuned and effects added."""

    parameters: dict[str, float]
    """Every nominal parameter, re-tuned together with the named effects."""
    effects: dict[str, dict[str, float]]
    """Values of the named effects, by effect."""
    code: str
    """The same as Python code to paste: the parameters, a function for each effect around the simulator, and the values of
    effects that the simulator has itself."""
    _again: Again | None = field(default=None, repr=False)

    def predict(
        self, data: entries.Data, *, rate_hz: float | None = None, progress: Callable[[str], Any] | None = None
    ) -> Prediction:
        """Simulates new recordings with the fix and without, and scores both. The new recordings are not fitted.

        `data` are as in `stretch_gap.diagnose`: they hold the inputs and the measured outputs.
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
        """Diagnoses the fixed simulator with the same recordings, or with others."""
        from .diagnosis import run

        again = self._runnable()
        others = [] if data is None else entries.recorded(data, rate_hz, again.fixed.columns)
        return run(again.fixed.problem(others, data is not None), again.asked, again.how, progress, [])

    def _runnable(self) -> Again:
        if self._again is None:
            raise StretchError(
                "there is no simulator to run: the diagnosis was read from text, or names no effect; diagnose again"
            )
        return self._again

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.code)}</pre>"


class Prediction:
    """What the fixed simulator predicts of recordings that were not fitted."""

    def __init__(self, text: str, sentence: str, curves: Mapping[str, Sequence[Array]], dt_s: float) -> None:
        self._answer: dict[str, Any] = json.loads(text)
        self.sentence = sentence
        """The result in a sentence."""
        self._curves = curves
        self._dt_s = dt_s

    @property
    def ratio(self) -> float:
        """Error with the fix over error without, parameters re-tuned: below 1 the fix helps. Geometric mean of all outputs."""
        return float(self._answer["ratio"])

    @property
    def times_noise(self) -> float:
        """The largest error with the fix of any output, in multiples of its noise: 1 is noise alone."""
        return float(self._answer["largest_times_noise"])

    @property
    def outputs(self) -> list[dict[str, Any]]:
        """By recording and output: `rmse` and `rmse_without` in the output's unit, `ratio`, and `times_noise`."""
        return [{"trial": trial["name"], **one} for trial in self._answer["trials"] for one in trial["outputs"]]

    @property
    def notes(self) -> list[str]:
        """Where the new recordings leave the range that was fitted, and what was noticed in them."""
        return [words for trial in self._answer["trials"] for words in trial["extrapolated"]] + list(self._answer["notes"])

    def curves(self, output: str | None = None) -> dict[str, Array]:
        """One output over all new recordings end to end: `measured`, `without` the fix, and `with_effects`."""
        name = output or next(iter(self._curves))
        if name not in self._curves:
            raise StretchError(f"there is no output {name}; there are {', '.join(self._curves)}")
        return dict(zip(("measured", "without", "with_effects"), self._curves[name]))

    def plot(self, output: str | None = None) -> Any:
        """Draws one output with matplotlib: measured, without and with the fix, and below it measured minus simulated. Returns
        the two axes."""
        return figures.curves(self.curves(output), self._dt_s, output or next(iter(self._curves)), self.sentence)

    def to_json(self) -> str:
        """Everything but the curves, as `stretch predict --json` writes it."""
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
    """The fix from re-tuned parameters, and the values, descriptions and functions of the named effects."""
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
