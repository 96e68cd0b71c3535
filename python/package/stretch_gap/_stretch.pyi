"""Native module of the package, written in Rust. Import its public names from `stretch_gap`."""

import os
from collections.abc import Callable, Sequence
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

__all__: list[str]
__version__: str

class StretchError(ValueError):
    """Error in the data or in the arguments.

    The message is one sentence that names the wrong value and says what to do.
    """

class Refused(StretchError):
    """Error that a simulator raises if it cannot simulate the requested values.

    A simulator that runs inside `stretch_gap.diagnose` raises this exception for values that it cannot simulate. The fit then
    continues with other values. Any other exception of the simulator ends the diagnosis.

    Examples
    --------
    >>> import stretch_gap
    >>> error = stretch_gap.Refused("the solver did not converge")  # a simulator raises this error
    >>> assert isinstance(error, stretch_gap.StretchError)
    """

@final
class Reading:
    """Estimate for one sample, as returned by `Receptor.step`."""

    @property
    def estimate(self) -> float:
        """Estimate, float, in the unit of the reference."""
    @property
    def rate(self) -> float:
        """Rate of change of the estimate, float, in the unit of the reference per second.

        The rate is NaN while the rate estimator of a line or of a curve still warms up, because these two models give estimates
        without a rate.
        """
    @property
    def branch(self) -> str:
        """Direction in which the reference moves, `"rising"` or `"falling"`."""
    @property
    def domain(self) -> str:
        """Position of the sample relative to the fitted range.

        The value is `"inside"`, `"signal_clamped"`, `"rate_clamped"`, `"both_clamped"` or `"estimate_clamped"`. A signal or a
        rate outside the fitted range is clamped to the end of the range, because a calibration is never extrapolated.
        `"estimate_clamped"` means that only the estimate was limited to the fitted range.
        """
    @property
    def sd(self) -> float | None:
        """Standard deviation of the estimate in the unit of the reference, or None if the model does not estimate it."""

@final
class Receptor:
    """Calibration that runs live, one sample at a time.

    `Calibration.receptor` creates a receptor. The receptor checks the time stamps of the samples and counts their faults.

    Examples
    --------
    >>> import numpy as np
    >>> import stretch_gap
    >>> time_s = np.arange(0, 20, 0.01)
    >>> angle_deg = 45 - 45 * np.cos(1.5 * time_s)
    >>> gauge_v = 0.002 * angle_deg + 1e-4 * np.random.default_rng(0).normal(size=time_s.size)
    >>> calibration = stretch_gap.calibrate(gauge_v, angle_deg, 100.0, model="linear", reference_name="angle_deg")
    >>> receptor = calibration.receptor()
    """

    def step(self, time_s: float, signal: float) -> Reading | None:
        """Process the next sample.

        Parameters
        ----------
        time_s : float
            Time of the sample in seconds. Time stamps must increase. If samples are missing, a short gap is bridged, and a longer
            gap restarts the warm-up.
        signal : float
            Value of the signal, in the unit of the signal that was calibrated.

        Returns
        -------
        Reading or None
            Estimate for the sample. None if there is no estimate, because the rate estimator still warms up or because the
            sample is not a number.

        Examples
        --------
        >>> readings = [receptor.step(time_s, volt) for time_s, volt in zip(time_s[:100], gauge_v)]
        >>> assert abs(readings[-1].estimate - angle_deg[99]) < 1.0
        """
    def set_pressure(self, pressure: float) -> None:
        """Set the pressure of the following samples.

        A calibration needs the pressure only if its gauge depends on the pressure.

        Parameters
        ----------
        pressure : float
            Pressure in kPa.

        Examples
        --------
        >>> receptor.set_pressure(101.3)
        """
    @property
    def faults(self) -> dict[str, int]:
        """Number of faulty time stamps so far, by kind.

        `missing` counts samples that did not arrive, `jittered` samples that were early or late by more than a fifth of the
        sample interval, and `backwards` time stamps that were repeated or ran backwards.
        """

@final
class CalibrationRecord:
    @staticmethod
    def from_json(text: str) -> CalibrationRecord: ...
    @staticmethod
    def load(path: str | os.PathLike[str]) -> CalibrationRecord: ...
    def save(self, path: str | os.PathLike[str]) -> None: ...
    def to_json(self) -> str: ...
    @property
    def signal(self) -> str: ...
    @property
    def reference(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def rate_hz(self) -> float: ...
    @property
    def range(self) -> tuple[float, float]: ...
    @property
    def needs_pressure(self) -> bool: ...
    def receptor(self) -> Receptor: ...
    def apply(
        self,
        time_s: NDArray[np.float64],
        signal: NDArray[np.float64],
        pressure: NDArray[np.float64] | None,
    ) -> dict[str, Any]: ...

def read_file(path: str, asked: dict[str, Any]) -> tuple[list[tuple[str, NDArray[np.float64]]], list[str]]: ...
def read_arrays(
    name: str, arrays: Sequence[tuple[str, list[int], NDArray[np.float64]]], notes: Sequence[str], asked: dict[str, Any]
) -> tuple[list[tuple[str, NDArray[np.float64]]], list[tuple[str, list[tuple[str, NDArray[np.float64]]]]], list[str]]: ...
def comment(text: str) -> str: ...
def identifier(text: str) -> str: ...
def tidy_column(name: str) -> str: ...
def unit_of(column: str) -> str: ...
def wrappers() -> list[tuple[str, str, str, str]]: ...
def calibrate(recordings: Sequence[dict[str, Any]], choices: dict[str, Any]) -> tuple[CalibrationRecord, str]: ...
def evaluate(
    calibrations: Sequence[tuple[str, CalibrationRecord]], recordings: Sequence[dict[str, Any]]
) -> tuple[str, list[tuple[str, str]]]: ...

@final
class Problem:
    def __new__(cls, entries: str, recordings: Sequence[tuple[dict[str, Any], float, bool]]) -> Problem: ...
    @staticmethod
    def read(path: str | os.PathLike[str], is_driven: bool) -> Problem: ...
    @staticmethod
    def compared(a: dict[str, Any], b: dict[str, Any], columns: Sequence[str]) -> Problem: ...
    @property
    def name(self) -> str: ...
    @property
    def session(self) -> str: ...
    @property
    def catalogue(self) -> list[str]: ...
    @property
    def columns(self) -> dict[str, NDArray[np.float64]]: ...
    def diagnose(
        self, simulator: Callable[..., NDArray[np.float64]] | None, how: str, progress: Callable[[str], Any] | None
    ) -> tuple[
        str, str, dict[str, list[NDArray[np.float64]]], dict[str, str], dict[str, NDArray[np.float64]] | None, Fixed | None
    ]: ...
    def predict(
        self,
        fitted: int,
        simulator: Callable[..., NDArray[np.float64]] | None,
        how: str,
        progress: Callable[[str], Any] | None,
    ) -> tuple[str, str, dict[str, list[NDArray[np.float64]]]]: ...

@final
class Fixed:
    def problem(self, recordings: Sequence[tuple[dict[str, Any], float, bool]], is_alone: bool) -> Problem: ...
    @property
    def fitted(self) -> tuple[int, float]: ...
    @property
    def columns(self) -> list[str]: ...
