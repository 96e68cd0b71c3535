"""How good calibrations are, by the usual measures."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from . import _stretch, html
from .calibration import Calibration
from .frames import frame
from .recordings import doubt, recordings


class Evaluation:
    """Errors of calibrations and of the raw signal, over all recordings and one by one."""

    def __init__(self, answer: dict[str, Any]) -> None:
        self._answer = answer

    @property
    def unit(self) -> str:
        """Unit of the reference and of the errors."""
        return str(self._answer["unit"])

    @property
    def pooled(self) -> dict[str, dict[str, Any]]:
        """Errors over all recordings, by method: `raw` is the signal laid on the reference's extremes."""
        return {row["method"]: row for row in self._answer["pooled"]}

    @property
    def recordings(self) -> dict[str, dict[str, dict[str, Any]]]:
        """Errors of each recording, by method."""
        return {t["trial"]: {row["method"]: row for row in t["methods"]} for t in self._answer["trials"]}

    @property
    def comparisons(self) -> list[dict[str, Any]]:
        """Paired tests between methods: whether a difference is more than chance."""
        return list(self._answer["comparisons"])

    @property
    def rmse(self) -> float:
        """Root mean square error of the last calibration."""
        return float(self._answer["pooled"][-1]["rmse"])

    def to_json(self) -> str:
        """As `stretch evaluate --json` prints it."""
        return json.dumps(self._answer, indent=2)

    def to_frame(self) -> Any:
        """One row a method and recording, as a pandas frame; a dict of columns where there is no pandas."""
        rows = [{"recording": "all", **row} for row in self.pooled.values()]
        rows += [{"recording": name, **row} for name, all_ in self.recordings.items() for row in all_.values()]
        return frame(rows)

    def __repr__(self) -> str:
        errors = ", ".join(f"{name} {row['rmse']:.4g}" for name, row in self.pooled.items())
        return f"<Evaluation, RMSE in {self.unit}: {errors}>"

    def _repr_html_(self) -> str:
        head = ["method", f"RMSE {self.unit}", "% of range", f"worst {self.unit}", "R²", "delay s", "outside"]
        keys = ["method", "rmse", "rmse_percent", "max", "r_squared", "lag_s", "clamped"]
        return html.table(head, [[row[key] for key in keys] for row in self.pooled.values()])


def evaluate(
    calibrations: Calibration | Mapping[str, Calibration],
    signal: Any,
    reference: Any,
    rate_hz: float | None = None,
    *,
    time_s: Any = None,
    pressure: Any = None,
    names: list[str] | None = None,
) -> Evaluation:
    """Judges calibrations of one signal against the reference of recordings that they were not fitted on.

    A `DoubtWarning` says what makes one doubt the errors: another rate or unit, recordings that were fitted, a reference at rest.
    """
    named = {"calibration": calibrations} if isinstance(calibrations, Calibration) else dict(calibrations)
    if not named:
        raise _stretch.StretchError("there is no calibration to judge; give at least one")
    first = next(iter(named.values()))
    columns = {first.signal: signal, first.reference: reference}
    if pressure is not None:
        columns["pressure_kpa"] = pressure
    records = [(name, calibration._record) for name, calibration in named.items()]
    # arrays without names are known again by their samples, not by the name that a fitted one has
    trials = recordings(columns, rate_hz, time_s, names, "judged recording")
    answer, doubts = _stretch.evaluate(records, trials)
    doubt(doubts)
    return Evaluation(json.loads(answer))
