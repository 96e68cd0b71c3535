"""From a signal and its reference to a calibration, and from a signal to estimates."""

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
    """Estimates of a recording, one a sample, as the calibration would give them live."""

    value: Array
    """The estimate, in the reference's unit; NaN where the rate estimator warms up."""
    rate: Array
    """Its rate, in that unit per second."""
    sd: Array
    """Standard deviation of the estimate; NaN where the model does not know it."""
    inside: NDArray[np.bool_]
    """Whether the sample lay where the calibration was fitted; outside it is clamped, not extrapolated."""
    faults: dict[str, int]
    """What was wrong with the time stamps: samples `missing`, `jittered` and running `backwards`."""
    unit: str
    """Unit of the estimate."""

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        array = self.value.astype(dtype) if dtype is not None else self.value
        return array.copy() if copy else array

    def __len__(self) -> int:
        return int(self.value.size)


class Calibration:
    """A calibration record: apply it to recordings, run it live, write it for the program and for boards."""

    def __init__(self, record: _stretch.CalibrationRecord, made: dict[str, Any] | None = None) -> None:
        self._record = record
        self._made = made or {}

    @staticmethod
    def from_json(text: str) -> Calibration:
        """From the JSON that `to_json` gives, or `stretch calibrate` writes."""
        return Calibration(_stretch.CalibrationRecord.from_json(text))

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Calibration:
        """From a file: postcard where its name ends in `.postcard`, else JSON."""
        return Calibration(_stretch.CalibrationRecord.load(path))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Into a file, whole or not at all: postcard for a board where its name ends in `.postcard`, else JSON."""
        self._record.save(replaceable(path, ".json", ".postcard"))

    def to_json(self) -> str:
        """The record that the program reads: `stretch apply`, `stretch listen`, `stretch export`."""
        return self._record.to_json()

    @property
    def signal(self) -> str:
        """Name of the signal."""
        return self._record.signal

    @property
    def reference(self) -> str:
        """Name of the reference."""
        return self._record.reference

    @property
    def unit(self) -> str:
        """Unit of the estimate: the last part of the reference's name."""
        return self._record.unit

    @property
    def rate_hz(self) -> float:
        """Samples a second at which it was fitted and runs."""
        return self._record.rate_hz

    @property
    def range(self) -> tuple[float, float]:
        """Least and greatest reference that was fitted."""
        return self._record.range

    @property
    def model(self) -> str:
        """The model that was fitted, as `calibrate` takes it; empty for a record that was read."""
        return str(self._made.get("model", ""))

    @property
    def models(self) -> list[dict[str, Any]]:
        """With `model="auto"`: every model with its errors on recordings left out of the fit, the best first."""
        return list(self._made.get("models", []))

    @property
    def fits(self) -> list[dict[str, Any]]:
        """What was fitted: coefficients with bounds, R squared, and neighbouring orders; empty for a record that was read."""
        return list(self._made.get("fits", []))

    @property
    def notes(self) -> list[str]:
        """What had to be done to the data, and what they cannot say."""
        return list(self._made.get("notes", []))

    def apply(
        self,
        signal: ArrayLike,
        rate_hz: float | None = None,
        *,
        time_s: ArrayLike | None = None,
        pressure: ArrayLike | None = None,
    ) -> Estimate:
        """Estimates of a recording, sample by sample, as they would come live.

        Without `rate_hz` and `time_s` the recording is taken to be at the calibration's own rate. `pressure` is needed by a
        calibration whose gauge depends on it. A `DoubtWarning` says where the recording does not look like one of that sensor.
        """
        values = column(signal, "signal")
        if rate_hz is None and time_s is None:
            rate_hz = self.rate_hz
        stamps = times(values.size, rate_hz, time_s, "the recording")
        pressures = None
        if self._record.needs_pressure:
            if pressure is None:
                raise _stretch.StretchError("the gauge of this calibration depends on the pressure: give pressure, in kPa")
            pressures = column(pressure, "pressure")
            same_length(pressures, values.size, "pressure")
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
        """Errors on recordings, next to those of the raw signal; `stretch_gap.evaluate` takes several calibrations."""
        from .evaluation import evaluate

        return evaluate({self.model or "calibration": self}, signal, reference, rate_hz, time_s=time_s)

    def receptor(self) -> _stretch.Receptor:
        """It runs live: `step(time_s, signal)` answers a `Reading`, or None while it warms up."""
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
    """Fits a calibration to recordings of a signal and its reference.

    `signal` and `reference` are one array each, or lists of arrays, one a recording; with either the samples a second or
    the time stamps in seconds.

    `model`: `linear`, `polyIJ` (a surface of degree I in the rate and J in the signal, a branch each way),
    `history` or `observer`, the last two also with `+rest`; `auto` takes the best on recordings left out of the fit;
    `diagnosed` builds on the effects that a diagnosis of the gauge names.

    `reference_name` carries the unit as its last part (`angle_deg`); a length (`length_mm`) is calibrated as contraction
    from `rest_length`, by default its greatest value. `rate` spells the rate estimator (`savgol:11,2`), `robust` weighs
    outliers down (`bisquare`, `lar`), `paper` is the method exactly as published.
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
