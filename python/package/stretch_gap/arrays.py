"""Named arrays that were read from a file, and notes on what was left out."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _stretch
from ._stretch import StretchError

LISTED = 4
"""Largest number of names that a note lists. Further names are only counted."""
PER_SECOND = {"ms": 1e3, "us": 1e6, "ns": 1e9}
"""Time units per second, by the last part of the name of a time array."""
EPOCH_S = 1e8
"""Smallest time stamp that is interpreted as a time since 1970, s.

A time since the start of a recorder is smaller, because no recorder runs for three years.
"""


def library(module: str, extra: str) -> Any:
    """Import a module that reads a file format.

    If it is not installed, raise a `StretchError` with the command that installs the extra.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        missing = error.name or module
        raise StretchError(f'the package {missing} is not installed: pip install "stretch-gap[{extra}]"') from None


def with_unit(name: str, unit: Any) -> str:
    """Return the name of a column with the unit as its last part, if the unit is known."""
    if isinstance(unit, bytes):
        unit = unit.decode("utf-8", "replace")
    return _stretch.tidy_column(f"{name} ({unit})" if isinstance(unit, str) and unit.strip() else name)


def listed(names: Sequence[str]) -> str:
    """Return the first names and the number of further names as text."""
    if len(names) > LISTED + 1:
        return f"{', '.join(names[:LISTED])} and {len(names) - LISTED} more"
    return ", ".join(names)


class Arrays:
    """Numeric arrays of a file by their paths, and notes on what was left out.

    `convert` returns this class.

    Attributes
    ----------
    file : str
        Path of the file.
    numbers : dict of str to ndarray
        Arrays of numbers by their path in the file.
    notes : list of str
        Sentences on assumptions and on parts of the file that were left out.
    """

    def __init__(self, file: str) -> None:
        self.file = file
        self.numbers: dict[str, NDArray[Any]] = {}
        self.notes: list[str] = []
        self._left_out: list[str] = []
        self._stamps: dict[str, NDArray[np.int64]] = {}

    def cannot(self, what: str, why: object, todo: str) -> StretchError:
        """Return the error that this file cannot be read. `why` is the reason, and `todo` tells the user what to do."""
        return StretchError(f"{self.file}: this {what} cannot be read: {why}; {todo}")

    def leave(self, path: str, why: str) -> None:
        """Record that `path` is left out, with the reason."""
        self._left_out.append(f"{path} ({why})")

    def take(self, path: str, values: Any) -> None:
        """Store an array of numbers or dates.

        Each field of a structured array is stored separately. Other arrays are left out with a note.
        """
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
        """Store time stamps in nanoseconds since 1970 or since the start of a recorder.

        They stay integers until `finish`, because double precision cannot represent nanoseconds since 1970.
        """
        self._stamps[path] = stamps_ns

    def finish(self) -> None:
        """Convert the time stamps to seconds, and note what was left out.

        Stamps since 1970 are counted from the first stamp of all.
        """
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
