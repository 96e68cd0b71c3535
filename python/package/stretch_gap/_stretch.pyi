"""The native part of the package: use `stretch_gap`."""

import os
from collections.abc import Callable, Sequence
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

__all__: list[str]
__version__: str

class StretchError(ValueError):
    """What is wrong with the data or the question, and what to do about it, in a sentence."""

class Refused(StretchError):
    """Raised by a simulator that cannot simulate these values: the fit turns back and goes on elsewhere."""

@final
class Reading:
    """What a receptor answers for one sample."""

    @property
    def estimate(self) -> float:
        """The estimate, in the reference's unit."""
    @property
    def rate(self) -> float:
        """Its rate, in that unit per second."""
    @property
    def branch(self) -> str:
        """Which way it moves: `rising` or `falling`."""
    @property
    def domain(self) -> str:
        """Whether the sample lay where the calibration was fitted: `inside`, else what was clamped."""
    @property
    def sd(self) -> float | None:
        """Standard deviation of the estimate, where the model knows it."""

@final
class Receptor:
    """A calibration that takes one sample after the other and minds their time stamps."""

    def step(self, time_s: float, signal: float) -> Reading | None:
        """The reading of the next sample; None while the rate estimator warms up, and where a sample is not a number."""
    def set_pressure(self, pressure: float) -> None:
        """The pressure of the samples to come, for a calibration that needs it."""
    @property
    def faults(self) -> dict[str, int]:
        """What was wrong with the time stamps so far: samples missing, jittered, and running backwards."""

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
