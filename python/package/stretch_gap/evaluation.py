"""Errors of calibrations on recordings."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from . import _stretch, html
from .calibration import Calibration
from .frames import frame
from .recordings import doubt, recordings


class Evaluation:
    """Errors of calibrations and of the raw signal, over all recordings and for each recording.

    `evaluate` and `Calibration.evaluate` return this class. A method in this class is a calibration by its name, or `"raw"`:
    the signal, scaled such that its least and greatest value are those of the reference.

    Errors are dicts with the keys `method`, `samples`, `withheld` (samples without an estimate), `clamped` (samples outside the
    fitted range), `rmse`, `bias`, `mae`, `max` (in `unit`), `rmse_percent`, `average_error_percent`,
    `average_error_percent_of_reference`, `signed_error_percent`, `r_squared`, and `lag_s` (delay of the estimate in seconds, or
    None).

    Examples
    --------
    The examples of the methods use `evaluation`.

    >>> import numpy as np
    >>> import stretch_gap
    >>> time_s = np.arange(0, 40, 0.01)
    >>> angle_deg = 45 - 45 * np.cos(1.5 * time_s + 0.4 * np.sin(0.37 * time_s))
    >>> gauge_v = 0.5 + 0.002 * angle_deg + 1e-4 * np.random.default_rng(0).normal(size=time_s.size)
    >>> calibration = stretch_gap.calibrate(gauge_v[:2000], angle_deg[:2000], 100.0, model="linear", reference_name="angle_deg")
    >>> evaluation = calibration.evaluate(gauge_v[2000:], angle_deg[2000:], 100.0)
    >>> evaluation.rmse < 0.1 and evaluation.unit == "deg"
    True
    """

    def __init__(self, answer: dict[str, Any]) -> None:
        self._answer = answer

    @property
    def unit(self) -> str:
        """Unit of the reference and of the errors, str."""
        return str(self._answer["unit"])

    @property
    def pooled(self) -> dict[str, dict[str, Any]]:
        """Errors over all recordings, dict by method.

        The first method is `"raw"`; the calibrations follow in the order given.
        """
        return {row["method"]: row for row in self._answer["pooled"]}

    @property
    def recordings(self) -> dict[str, dict[str, dict[str, Any]]]:
        """Errors of each recording, dict by the name of the recording, then by method."""
        return {t["trial"]: {row["method"]: row for row in t["methods"]} for t in self._answer["trials"]}

    @property
    def comparisons(self) -> list[dict[str, Any]]:
        """Paired t tests between the absolute errors of two methods, list of dicts.

        Each dict holds `first` and `second` (the methods), `mean_difference` (first minus second, in `unit`), `p_samples` (p
        value if samples are assumed to be independent), `p_blocks` (p value for means of half-second blocks), `blocks` (their
        number) and `interval_95` (95 % interval of the mean difference, from blocks).
        """
        return list(self._answer["comparisons"])

    @property
    def rmse(self) -> float:
        """Root mean square error of the last calibration over all recordings, float, in `unit`."""
        return float(self._answer["pooled"][-1]["rmse"])

    def to_json(self) -> str:
        """Return the evaluation as JSON.

        Returns
        -------
        str
            JSON as printed by `stretch evaluate --json`.

        Examples
        --------
        >>> import json
        >>> json.loads(evaluation.to_json())["unit"]
        'deg'
        """
        return json.dumps(self._answer, indent=2)

    def to_frame(self) -> Any:
        """Return the errors as a table with one row for each recording and method.

        Returns
        -------
        pandas.DataFrame or dict of str to list
            The table. A dict of columns if pandas is not installed. The recording `"all"` holds the errors over all recordings.

        Examples
        --------
        >>> list(evaluation.to_frame()["method"])[:2]
        ['raw', 'linear']
        """
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
    """Compute the errors of calibrations on recordings that were not fitted.

    Give either `rate_hz` or `time_s`. Samples without a number in every column count as lost, with a warning.

    Parameters
    ----------
    calibrations : Calibration, or dict of str to Calibration
        One calibration, or several by name. All must have the signal and the reference of the first.
    signal : array_like, or list of array_like
        Signal of one recording, shape `(samples,)`, or a list with the signal of each recording.
    reference : array_like, or list of array_like
        Measured reference in the unit of the calibrations, in the same form as `signal`.
    rate_hz : float, optional
        Sample rate of the recordings in Hz.
    time_s : array_like, or list of array_like, optional
        Increasing time stamps in seconds, or arrays of `datetime64` or `timedelta64`: one array for all recordings, or one for
        each.
    pressure : array_like, or list of array_like, optional
        Pressure in kPa, in the same form as `signal`. Required if the gauge of a calibration depends on the pressure.
    names : list of str, optional
        Names of the recordings. By default they are numbered.

    Returns
    -------
    Evaluation
        Errors of each calibration, and of the raw signal for comparison.

    Raises
    ------
    StretchError
        If there is no calibration, or if the columns or the time stamps are wrong.

    Warns
    -----
    DoubtWarning
        If there are reasons to doubt the errors: another sample rate or unit, a constant signal, many samples outside the
        fitted range, recordings that were fitted, a constant error, errors worse than those of the mean, or a constant
        reference. Also if samples count as lost, or if the time stamps seem to be in milliseconds.

    Examples
    --------
    >>> import numpy as np
    >>> import stretch_gap
    >>> time_s = np.arange(0, 60, 0.01)
    >>> angle_deg = 45 - 45 * np.cos(1.5 * time_s + 0.4 * np.sin(0.37 * time_s))
    >>> noise_v = 1e-4 * np.random.default_rng(0).normal(size=time_s.size)
    >>> gauge_v = 0.5 + 0.002 * np.interp(time_s - 0.05, time_s, angle_deg) + noise_v
    >>> calibrations = {
    ...     model: stretch_gap.calibrate(gauge_v[:3000], angle_deg[:3000], 100.0, model=model, reference_name="angle_deg")
    ...     for model in ["linear", "poly13"]
    ... }
    >>> evaluation = stretch_gap.evaluate(calibrations, gauge_v[3000:], angle_deg[3000:], 100.0)
    >>> list(evaluation.pooled)
    ['raw', 'linear', 'poly13']
    >>> evaluation.rmse < evaluation.pooled["linear"]["rmse"]
    True
    """
    named = {"calibration": calibrations} if isinstance(calibrations, Calibration) else dict(calibrations)
    if not named:
        raise _stretch.StretchError("calibrations is empty; give at least one calibration")
    first = next(iter(named.values()))
    columns = {first.signal: signal, first.reference: reference}
    if pressure is not None:
        columns["pressure_kpa"] = pressure
    records = [(name, calibration._record) for name, calibration in named.items()]
    # The default names differ from those of fitted recordings, so that fitted recordings are recognised by their samples only.
    trials = recordings(columns, rate_hz, time_s, names, "judged recording")
    answer, doubts = _stretch.evaluate(records, trials)
    doubt(doubts)
    return Evaluation(json.loads(answer))
