"""Calibrations: fitted to a signal and its reference, then applied to further signals."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _stretch, html
from .outputs import replaceable
from .recordings import Array, column, doubt, recordings, same_length, times

if TYPE_CHECKING:
    from .diagnosis import Diagnosis
    from .evaluation import Evaluation


@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimates of a recording, one per sample, identical to those of a live receptor.

    An estimate converts to a NumPy array: `np.asarray(estimate)` is `estimate.value`.

    Attributes
    ----------
    value : ndarray of shape (samples,)
        Estimate of the reference, in `unit`. NaN for samples without an estimate, because the rate estimator still warms up or
        because the sample is missing.
    rate : ndarray of shape (samples,)
        Rate of change of the estimate, in `unit` per second. NaN for samples without an estimate or without a rate.
    sd : ndarray of shape (samples,)
        Standard deviation of the estimate, in `unit`. NaN if the model does not estimate it.
    inside : ndarray of bool, of shape (samples,)
        Whether the sample lies in the range that was fitted. Outside this range, signal and rate are clamped to its ends,
        because a calibration is never extrapolated. False for samples without an estimate.
    faults : dict of str to int
        Number of faulty time stamps: `missing` counts samples that are not in the recording, `jittered` samples that are early or
        late by more than a fifth of the sample interval, and `backwards` time stamps that repeat or run backwards.
    unit : str
        Unit of the estimate.

    Examples
    --------
    >>> import numpy as np
    >>> import stretch_gap
    >>> angle_deg = 45 - 45 * np.cos(0.015 * np.arange(2000))
    >>> calibration = stretch_gap.calibrate(0.002 * angle_deg, angle_deg, 100.0, model="linear", reference_name="angle_deg")
    >>> estimate = calibration.apply(0.002 * angle_deg)
    >>> len(estimate), estimate.unit, bool(np.allclose(estimate, angle_deg))
    (2000, 'deg', True)
    """

    value: Array
    rate: Array
    sd: Array
    inside: NDArray[np.bool_]
    faults: dict[str, int]
    unit: str

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        array = self.value.astype(dtype) if dtype is not None else self.value
        return array.copy() if copy else array

    def __len__(self) -> int:
        return int(self.value.size)


class Calibration:
    """Calibration that converts the signal of a sensor to an estimate of its reference.

    `calibrate` fits a calibration; `Calibration.load` and `Calibration.from_json` read one. A calibration can be applied to
    recordings (`apply`), run live (`receptor`), and written for the program `stretch` and for boards (`save`). Two calibrations
    are equal if their calibration files are equal.

    Examples
    --------
    The examples of the methods use `calibration`, `gauge` and `angle_deg`.

    >>> import numpy as np
    >>> import stretch_gap
    >>> time_s = np.arange(0, 20, 0.01)
    >>> angle_deg = 45 - 45 * np.cos(1.5 * time_s)
    >>> gauge = 0.002 * angle_deg + 1e-4 * np.random.default_rng(0).normal(size=time_s.size)
    >>> calibration = stretch_gap.calibrate(gauge, angle_deg, time_s=time_s, model="linear", reference_name="angle_deg")
    >>> calibration.unit
    'deg'
    >>> stretch_gap.Calibration.from_json(calibration.to_json()) == calibration
    True
    """

    def __init__(self, record: _stretch.CalibrationRecord, made: dict[str, Any] | None = None) -> None:
        self._record = record
        self._made = made or {}

    @staticmethod
    def from_json(text: str) -> Calibration:
        """Create a calibration from JSON.

        Parameters
        ----------
        text : str
            JSON as returned by `to_json` or written by `stretch calibrate`.

        Returns
        -------
        Calibration
            The calibration. Its `model`, `models`, `fits` and `notes` are empty, because the file does not contain them.

        Raises
        ------
        StretchError
            If the text is not a calibration that can be used.

        Examples
        --------
        >>> stretch_gap.Calibration.from_json(calibration.to_json()).reference
        'angle_deg'
        """
        return Calibration(_stretch.CalibrationRecord.from_json(text))

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Calibration:
        """Read a calibration from a file.

        Parameters
        ----------
        path : str or path-like
            File to read. The format is postcard if the name ends in `.postcard`, and otherwise JSON.

        Returns
        -------
        Calibration
            The calibration. Its `model`, `models`, `fits` and `notes` are empty, because the file does not contain them.

        Raises
        ------
        StretchError
            If the file cannot be read, or is not a calibration that can be used.

        Examples
        --------
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     calibration.save(f"{folder}/gauge.json")
        ...     again = stretch_gap.Calibration.load(f"{folder}/gauge.json")
        >>> again == calibration
        True
        """
        return Calibration(_stretch.CalibrationRecord.load(path))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the calibration to a file.

        If writing fails, no partial file is left.

        Parameters
        ----------
        path : str or path-like
            File to write. The format is postcard, for a board, if the name ends in `.postcard`, and otherwise JSON. An existing
            file is replaced only if its name ends in `.json` or `.postcard`.

        Raises
        ------
        StretchError
            If the file exists under a name with another ending, or cannot be written.

        Examples
        --------
        >>> import os
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     calibration.save(f"{folder}/gauge.postcard")
        ...     os.listdir(folder)
        ['gauge.postcard']
        """
        self._record.save(replaceable(path, ".json", ".postcard"))

    def to_json(self) -> str:
        """Return the calibration as JSON.

        Returns
        -------
        str
            JSON that `Calibration.from_json` and the program `stretch` read (`stretch apply`, `stretch listen`, `stretch
            export`).

        Examples
        --------
        >>> import json
        >>> json.loads(calibration.to_json())["reference"]
        'angle_deg'
        """
        return self._record.to_json()

    @property
    def signal(self) -> str:
        """Name of the signal, str."""
        return self._record.signal

    @property
    def reference(self) -> str:
        """Name of the reference, str."""
        return self._record.reference

    @property
    def unit(self) -> str:
        """Unit of the estimate, str: the unit that is the last part of the reference's name."""
        return self._record.unit

    @property
    def rate_hz(self) -> float:
        """Sample rate of the calibration, float, in Hz."""
        return self._record.rate_hz

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest value of the reference in the fitted recordings, tuple of two floats, in `unit`."""
        return self._record.range

    @property
    def model(self) -> str:
        """Name of the fitted model, as in the argument `model` of `calibrate`.

        Empty if the calibration was read from a file or text.
        """
        return str(self._made.get("model", ""))

    @property
    def models(self) -> list[dict[str, Any]]:
        """Models that `model="auto"` compared, list of dicts, the best first.

        Each dict holds among others `model`, `rmse` (root mean square error on recordings that were left out of the fit, in
        `unit`), `worst` (greatest absolute error, in `unit`), `lag_s` (mean delay of the estimate, s) and `parameters` (number
        of fitted parameters). The list is empty if the model was given, or if the calibration was read from a file or text.
        """
        return list(self._made.get("models", []))

    @property
    def fits(self) -> list[dict[str, Any]]:
        """Statistics of each fit, list of dicts.

        Each dict holds among others `name`, `model`, `samples`, `r_squared`, `rmse` (in the normalised target), `coefficients`
        with 95 % bounds, and `orders` (fits of neighbouring degrees). The list is empty if the calibration was read from a file
        or text.
        """
        return list(self._made.get("fits", []))

    @property
    def notes(self) -> list[str]:
        """Notes of the fit, list of str: changes that were made to the data, and questions that the data cannot answer.

        The list is empty if the calibration was read from a file or text.
        """
        return list(self._made.get("notes", []))

    def apply(
        self,
        signal: ArrayLike,
        rate_hz: float | None = None,
        *,
        time_s: ArrayLike | None = None,
        pressure: ArrayLike | None = None,
    ) -> Estimate:
        """Estimate the reference of a recording, sample by sample, as a live receptor does.

        Give at most one of `rate_hz` and `time_s`. Without both, the recording is assumed to have the sample rate of the
        calibration.

        Parameters
        ----------
        signal : array_like of shape (samples,)
            Signal in the unit of the signal that was calibrated. NaN marks a missing sample.
        rate_hz : float, optional
            Sample rate of the recording in Hz.
        time_s : array_like of shape (samples,), optional
            Increasing time stamps in seconds, or an array of `datetime64` or `timedelta64`.
        pressure : array_like of shape (samples,), optional
            Pressure in kPa. Required if the gauge of this calibration depends on the pressure, and otherwise ignored.

        Returns
        -------
        Estimate
            Estimates, their rates and standard deviations, and the faults of the time stamps.

        Raises
        ------
        StretchError
            If a column does not hold one number per sample, if the time stamps do not increase, or if the pressure is missing.

        Warns
        -----
        DoubtWarning
            If the recording does not match the calibration: another sample rate, another unit, a constant signal, or many samples
            outside the fitted range.

        Examples
        --------
        >>> estimate = calibration.apply(gauge)
        >>> estimate.value.shape, estimate.unit
        ((2000,), 'deg')
        >>> bool(np.nanmax(np.abs(estimate.value - angle_deg)) < 1.0)
        True
        """
        values = column(signal, "signal")
        if rate_hz is None and time_s is None:
            rate_hz = self.rate_hz
        stamps = times(values.size, rate_hz, time_s, "the recording")
        wrong = np.flatnonzero(~np.isfinite(stamps))
        if wrong.size:
            raise _stretch.StretchError(f"time_s, sample {wrong[0]}: {stamps[wrong[0]]} is not a time; leave this sample out")
        pressures = None
        if self._record.needs_pressure:
            if pressure is None:
                raise _stretch.StretchError(
                    "pressure is missing: the gauge of this calibration depends on it; give pressure in kPa"
                )
            pressures = column(pressure, "pressure")
            same_length(pressures, values.size, "pressure", "signal")
        answer = self._record.apply(stamps, values, pressures)
        doubt(answer["doubts"])
        faults = {key: answer[key] for key in ("missing", "jittered", "backwards")}
        return Estimate(answer["estimate"], answer["rate"], answer["sd"], answer["inside"], faults=faults, unit=self.unit)

    def evaluate(
        self,
        signal: Any,
        reference: Any,
        rate_hz: float | None = None,
        *,
        time_s: Any = None,
    ) -> Evaluation:
        """Compute the errors of this calibration on recordings, and those of the raw signal for comparison.

        `stretch_gap.evaluate` compares several calibrations, and accepts a pressure and names of recordings.

        Parameters
        ----------
        signal : array_like, or list of array_like
            Signal of one recording, shape `(samples,)`, or a list with the signal of each recording.
        reference : array_like, or list of array_like
            Reference in the unit of the calibration, in the same form as `signal`.
        rate_hz : float, optional
            Sample rate of the recordings in Hz. Give either `rate_hz` or `time_s`.
        time_s : array_like, or list of array_like, optional
            Increasing time stamps in seconds: one array for all recordings, or one for each.

        Returns
        -------
        Evaluation
            Errors of the calibration and of the raw signal. The calibration is listed under its model, or as `"calibration"` if
            the model is not known.

        Raises
        ------
        StretchError
            If the columns or the time stamps are wrong.

        Warns
        -----
        DoubtWarning
            If there are reasons to doubt the errors. `stretch_gap.evaluate` lists them.

        Examples
        --------
        >>> evaluation = calibration.evaluate(gauge[::-1], angle_deg[::-1], 100.0)
        >>> evaluation.rmse < 0.1
        True
        """
        from .evaluation import evaluate

        return evaluate({self.model or "calibration": self}, signal, reference, rate_hz, time_s=time_s)

    def receptor(self) -> _stretch.Receptor:
        """Create a receptor that runs the calibration live, one sample at a time.

        Returns
        -------
        Receptor
            Receptor in its initial state. `step(time_s, signal)` returns the `Reading` of a sample, or None if there is none.

        Raises
        ------
        StretchError
            If the calibration cannot run live. A calibration with the rate estimator `central` cannot, because that estimator
            needs the next sample.

        Examples
        --------
        >>> receptor = calibration.receptor()
        >>> readings = [receptor.step(time_s, volt) for time_s, volt in zip(np.arange(100) / 100, gauge)]
        >>> bool(abs(readings[-1].estimate - angle_deg[99]) < 1.0)
        True
        """
        return self._record.receptor()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Calibration) and self.to_json() == other.to_json()

    def __hash__(self) -> int:
        return hash(self.to_json())

    def __reduce__(self) -> tuple[Any, ...]:
        return (_again, (self.to_json(), self._made))

    def __repr__(self) -> str:
        least, most = self.range
        model = f" {self.model}" if self.model else ""
        return (
            f"<Calibration{model} of {self.reference} on {self.signal}, {least:.4g} to {most:.4g} {self.unit},"
            f" at {self.rate_hz:.4g} Hz>"
        )

    def _repr_html_(self) -> str:
        parts = [f"<p><b>{escape(repr(self)[1:-1])}</b></p>"]
        if self.models:
            head = ["model", f"RMSE {self.unit}", "worst", "delay s", "numbers", ""]
            rows = [
                [
                    m["model"],
                    m["rmse"],
                    m["worst"],
                    m["lag_s"],
                    m["parameters"],
                    "chosen" if m["model"] == self.model else "",
                ]
                for m in self.models
            ]
            parts.append(html.table(head, rows, "on recordings left out of the fit"))
        if self.fits:
            head = ["fit", "model", "samples", "R²", "RMSE, of the range"]
            rows = [[f["name"], f["model"], f["samples"], f["r_squared"], f["rmse"]] for f in self.fits]
            parts.append(html.table(head, rows))
        return "<div>" + "".join(parts) + html.notes(self.notes) + "</div>"


def _again(text: str, made: dict[str, Any]) -> Calibration:
    return Calibration(_stretch.CalibrationRecord.from_json(text), made)


def calibrate(
    signal: Any,
    reference: Any,
    rate_hz: float | None = None,
    *,
    time_s: Any = None,
    model: str = "auto",
    signal_name: str = "signal",
    reference_name: str = "reference",
    rate: str | None = None,
    robust: str | None = None,
    signal_zero: float | None = None,
    rest_length: float | None = None,
    dead_band: float | None = None,
    paper: bool = False,
    pressure: Any = None,
    diagnosis: Diagnosis | str | None = None,
    names: list[str] | None = None,
    date: str = "",
) -> Calibration:
    """Fit a calibration to recordings of a signal and its reference.

    Give either `rate_hz` or `time_s`. Samples without a number in every column count as lost, with a warning.

    Parameters
    ----------
    signal : array_like, or list of array_like
        Signal of one recording, shape `(samples,)`, or a list with the signal of each recording.
    reference : array_like, or list of array_like
        Reference that the calibration estimates, in the same form as `signal`.
    rate_hz : float, optional
        Sample rate of the recordings in Hz.
    time_s : array_like, or list of array_like, optional
        Increasing time stamps in seconds, or arrays of `datetime64` or `timedelta64`: one array for all recordings, or one for
        each.
    model : str, default "auto"
        Model to fit:

        - `"auto"`: the simplest model that is as good as the best, by errors on recordings that were left out of the fit;
        - `"linear"`: one straight line;
        - `"curve"`: one polynomial of the signal, whose degree is chosen by cross-validation;
        - `"polyIJ"`, for example `"poly13"`: a surface of degree I in the rate and J in the signal for each direction of
          motion, up to `"poly55"`;
        - `"history"`: a polynomial of the signal and of its history, that is, the inverse of lag and hysteresis;
        - `"observer"`: a model of the gauge, inverted by a Kalman filter;
        - `"diagnosed"`: a model of the gauge built from the effects that `diagnosis` names.

        The last three may end in `+rest`, for example `"history+rest"`. They then track a drifting baseline of the resting
        signal.
    signal_name : str, default "signal"
        Name of the signal. The unit is the last part of the name, as in `"gauge_v"`.
    reference_name : str, default "reference"
        Name of the reference. The unit is the last part of the name, as in `"angle_deg"`. A reference whose name begins with
        `length`, as in `"length_mm"`, is calibrated as a contraction from `rest_length`.
    rate : str, optional
        Estimator of the signal's rate of change: `"savgol:WINDOW,DEGREE"` or `"savgol:WINDOW,DEGREE,DELAY"` in samples,
        `"difference:CUTOFF_HZ"`, `"tracker:INDEX"`, or `"central"`, which cannot run live. By default `"savgol:11,2"`.
    robust : {"bisquare", "lar"}, optional
        Weighting that reduces the influence of outliers: bisquare weights or least absolute residuals. By default least squares.
    signal_zero : float, optional
        Zero of the signal in the normalised fit, in the unit of the signal. By default the middle of the signal's range; for a
        signal `bridge_v` with values near 1.24 V it is 1.24 V.
    rest_length : float, optional
        Resting length in the unit of the reference. By default the greatest value of a reference whose name begins with
        `length`. Any other reference is calibrated as a contraction only if this value is given.
    dead_band : float, optional
        Rate below which the direction of motion does not change, in units of the signal per second. By default three standard
        deviations of the rate's noise.
    paper : bool, default False
        Whether to use the method exactly as published: central differences, a surface for each direction of motion fitted to
        whole recordings, and no dead band. `rate` and `dead_band` override these choices.
    pressure : array_like, or list of array_like, optional
        Pressure in kPa, in the same form as `signal`. Used by `model="diagnosed"` if the gauge depends on the pressure.
    diagnosis : Diagnosis or str, optional
        Diagnosis of the gauge, or its JSON, for `model="diagnosed"`.
    names : list of str, optional
        Names of the recordings in notes and warnings. By default they are numbered.
    date : str, default ""
        Date of the calibration, as free text for the calibration file.

    Returns
    -------
    Calibration
        The calibration, with the statistics of its fits.

    Raises
    ------
    StretchError
        If the columns, the time stamps or the options are wrong, or if the model cannot be fitted to the recordings.

    Warns
    -----
    DoubtWarning
        If samples count as lost because a column has no number there (code `missing_samples`), or if the time stamps seem to be
        in milliseconds (code `slow_clock`).

    Examples
    --------
    >>> import numpy as np
    >>> import stretch_gap
    >>> time_s = np.arange(0, 20, 0.01)
    >>> angle_deg = 45 - 45 * np.cos(1.5 * time_s)
    >>> gauge_v = 0.002 * np.interp(time_s - 0.05, time_s, angle_deg)  # a gauge with a delay of 50 ms
    >>> gauge_v += 1e-4 * np.random.default_rng(0).normal(size=time_s.size)
    >>> calibration = stretch_gap.calibrate(
    ...     gauge_v, angle_deg, rate_hz=100.0, model="poly13", signal_name="gauge_v", reference_name="angle_deg"
    ... )
    >>> estimate = calibration.apply(gauge_v)
    >>> bool(np.nanmax(np.abs(estimate.value - angle_deg)) < 3.0)
    True
    """
    columns = {signal_name: signal, reference_name: reference}
    if pressure is not None:
        columns["pressure_kpa"] = pressure
    diagnosed = diagnosis if diagnosis is None or isinstance(diagnosis, str) else diagnosis.to_json()
    choices = {
        "model": model,
        "signal": signal_name,
        "reference": reference_name,
        "paper": paper,
        "rate": rate,
        "robust": robust,
        "signal_zero": signal_zero,
        "rest_length": rest_length,
        "dead_band": dead_band,
        "date": date,
        "diagnosis": diagnosed,
    }
    record, made = _stretch.calibrate(recordings(columns, rate_hz, time_s, names), choices)
    return Calibration(record, json.loads(made))
