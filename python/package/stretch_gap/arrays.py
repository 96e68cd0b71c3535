"""Named arrays as they are found in a file."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _stretch
from ._stretch import StretchError

Array = NDArray[np.float64]
LISTED = 4
"""Names that a note lists; more are counted."""
PER_SECOND = {"ms": 1e3, "us": 1e6, "ns": 1e9}
"""Counts in a second, by the last part of the name of a time."""
EPOCH_S = 1e8
"""Times above this count from 1970, s: no recorder runs for three years."""


def library(module: str, extra: str) -> Any:
    """A library that reads a format, or the sentence that says how to install it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        missing = error.name or module
        raise StretchError(f'the package {missing} is not installed: pip install "stretch-gap[{extra}]"') from None


def with_unit(name: str, unit: Any) -> str:
    """The name of a column with its unit as the last part, where it is a unit that the program knows."""
    if isinstance(unit, bytes):
        unit = unit.decode("utf-8", "replace")
    return _stretch.tidy_column(f"{name} ({unit})" if isinstance(unit, str) and unit.strip() else name)


def listed(names: Sequence[str]) -> str:
    """A few names, and how many more there are."""
    if len(names) > LISTED + 1:
        return f"{', '.join(names[:LISTED])} and {len(names) - LISTED} more"
    return ", ".join(names)


class Arrays:
    """The arrays of numbers of a file by their paths, and notes on what is left out."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.numbers: dict[str, NDArray[Any]] = {}
        self.notes: list[str] = []
        self._left_out: list[str] = []
        self._stamps: dict[str, NDArray[np.int64]] = {}

    def cannot(self, what: str, why: object, todo: str) -> StretchError:
        """The error that this file cannot be read."""
        return StretchError(f"{self.file}: this {what} cannot be read: {why}; {todo}")

    def leave(self, path: str, why: str) -> None:
        """Says that something is left out."""
        self._left_out.append(f"{path} ({why})")

    def take(self, path: str, values: Any) -> None:
        """Takes an array where it is one of numbers or dates; the fields of a table of numbers each for itself."""
        array = np.asarray(values)
        kind = array.dtype.kind
        if array.dtype.names:
            for field in array.dtype.names:
                self.take(f"{path}.{field}" if path else field, array[field])
        elif kind in "biuf":
            self.numbers[path] = array
        elif kind == "M":
            self.take_stamps(path, array.astype("datetime64[ns]").astype(np.int64))
        elif kind == "m":
            self.numbers[path] = array.astype("timedelta64[ns]").astype(np.int64) / 1e9 * _per_second(path)
        else:
            self.leave(path, {"c": "complex numbers", "O": "no numbers", "V": "no numbers"}.get(kind, "text"))

    def take_stamps(self, path: str, stamps_ns: NDArray[np.int64]) -> None:
        """Takes times in nanoseconds since 1970, or since a recorder began; double precision does not hold the former."""
        self._stamps[path] = stamps_ns

    def finish(self) -> None:
        """Counts times from the first of all, and notes what was left out."""
        first = min((int(stamps[0]) for stamps in self._stamps.values() if stamps.size), default=0)
        if first >= EPOCH_S * 1e9:
            self.notes.append(f"time counts from the first sample, {np.datetime64(first, 'ns')}Z")
        else:
            first = 0
        for path, stamps in self._stamps.items():
            missing = stamps == np.iinfo(np.int64).min
            self.numbers[path] = np.where(missing, np.nan, (stamps - first) / 1e9 * _per_second(path))
        self._stamps.clear()
        if self._left_out:
            self.notes.append(f"left out: {listed(self._left_out)}")
            self._left_out.clear()


def _per_second(path: str) -> float:
    return PER_SECOND.get(path.rsplit("_", 1)[-1], 1.0)
