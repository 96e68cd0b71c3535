"""Checks of the arrays and time stamps that users pass."""

from __future__ import annotations

import difflib
import sys
import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._stretch import StretchError

Array = NDArray[np.float64]


class DoubtWarning(UserWarning):
    """Warning about a reason to doubt the data or a result.

    Parameters
    ----------
    text : str
        Sentence for the user.
    code : str
        Name of the reason for programs. It is stable between releases: `missing_samples`, `slow_clock`, `large_tolerance`,
        `other_rate`, `other_unit`, `other_sensor`, `constant_signal`, `clipped_signal`, `outside_range`, `fitted_trials`,
        `other_reference`, `constant_error`, `delayed`, `worse_than_the_mean`, `constant_reference` or `without_estimate`.

    Attributes
    ----------
    code : str
        Name of the reason for programs.

    Examples
    --------
    >>> import stretch_gap
    >>> stretch_gap.DoubtWarning("the recording has another sample rate", "other_rate").code
    'other_rate'
    """

    def __init__(self, text: str, code: str) -> None:
        super().__init__(text)
        self.code = code


def doubt(doubts: Iterable[tuple[str, str]]) -> None:
    """Issue a `DoubtWarning` for each pair of code and sentence, at the line that called this package."""
    level, caller = 2, sys._getframe(1)
    while caller.f_globals.get("__package__") == __package__ and caller.f_back:
        level, caller = level + 1, caller.f_back
    for code, text in doubts:
        warnings.warn(DoubtWarning(text, code), stacklevel=level)


def unknown(what: str, name: Any, names: Iterable[str], where: str = "") -> StretchError:
    """Return the error that there is no `name`, with the most similar name and with all names. `what` is its kind."""
    known = list(map(str, names))
    similar = difflib.get_close_matches(str(name), known, 1)
    hint = f" (did you mean {similar[0]}?)" if similar else ""
    there = f"the {what}s are {', '.join(known)}" if known else "there are none"
    return StretchError(f"{where}there is no {what} {name}{hint}; {there}")


def number(what: str, given: Any) -> float:
    """Return a finite number that the user gave. Text is refused."""
    try:
        if not isinstance(given, (str, bytes)) and np.isfinite(float(given)):
            return float(given)
    except (TypeError, ValueError):
        pass
    raise StretchError(f"{what} is {given!r}; give a finite number")


def column(values: ArrayLike, what: str) -> Array:
    """Return a column as a one-dimensional array of floats. NaN and infinite values mark missing samples."""
    try:
        array = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise StretchError(f"{what}{_not_a_number(values) or f' does not hold numbers: {error}'}") from None
    if array.ndim != 1:
        raise StretchError(f"{what} has the shape {array.shape}; give an array of one dimension with one number per sample")
    return array


def _not_a_number(values: Any) -> str:
    """Return the first sample that is not a number, in words, or an empty text."""
    for sample, value in enumerate(np.asarray(values, dtype=object).flat):
        try:
            float(value)
        except (TypeError, ValueError):
            return f", sample {sample}: {value!r} is not a number; write NaN where a number is missing"
    return ""


SLOW_S = 1.0
"""Longest plausible step of time stamps, s. Longer steps are probably milliseconds."""
SLOW_HZ, LONG = 5.0, 1000
"""Lowest plausible sample rate of a recording with more than `LONG` samples."""


def without_missing(what: str, time_s: Array, channels: Sequence[tuple[str, Array]]) -> tuple[Array, list[tuple[str, Array]]]:
    """Return the samples in which the time and every channel have a number, as the reader of files does.

    The others count as lost samples, which the resampling bridges or treats as a gap. A `DoubtWarning` lists them.
    """
    columns = [("time_s", time_s), *channels]
    present = np.logical_and.reduce([np.isfinite(values) for _, values in columns])
    left_out = np.flatnonzero(~present)
    if not left_out.size:
        return time_s, list(channels)
    first = int(left_out[0])
    name, value = next((name, values[first]) for name, values in columns if not np.isfinite(values[first]))
    if left_out.size == time_s.size:
        raise StretchError(f"{what}: no sample has a number in every column; {name} is {value} in sample {first}")
    some = ", ".join(map(str, left_out[:5])) + (", ..." if left_out.size > 5 else "")
    count = f"count as lost (samples {some})" if left_out.size > 1 else "counts as lost"
    words = f"{what}: {left_out.size} of {time_s.size} samples {count}: sample {first} of {name} is {value}"
    doubt([("missing_samples", words)])
    return time_s[present], [(name, values[present]) for name, values in channels]


def times(samples: int, rate_hz: float | None, time_s: ArrayLike | None, what: str) -> Array:
    """Return time stamps in seconds, computed from the sample rate or taken from `time_s`.

    The finite time stamps must increase. Others are returned as they are.
    """
    if (rate_hz is None) == (time_s is None):
        raise StretchError(f"{what}: give either rate_hz, the sample rate, or time_s, the time stamps")
    if rate_hz is not None:
        if number("rate_hz", rate_hz) <= 0.0:
            raise StretchError(f"rate_hz is {rate_hz}; give a finite number above 0")
        stamps: Array = np.arange(samples, dtype=np.float64) / float(rate_hz)
        return stamps
    assert time_s is not None
    given = np.asarray(time_s)
    if given.dtype.kind in "mM" and given.size:
        # The difference must be taken before the conversion to numbers, because the unit is lost there.
        time_s = (given - given.flat[np.argmin(np.isnat(given))]) / np.timedelta64(1, "s")
    stamps = column(time_s, f"time_s of {what}")
    same_length(stamps, samples, f"time_s of {what}", "columns")
    known = np.flatnonzero(np.isfinite(stamps))
    steps = np.diff(stamps[known])
    back = np.flatnonzero(steps <= 0.0)
    if back.size:
        before, i = known[back[0] : back[0] + 2]
        raise StretchError(
            f"time_s of {what}, sample {i}: {stamps[i]:.9g} s does not come after {stamps[before]:.9g} s; sort the samples, "
            "or give several recordings as a list"
        )
    step_s = float(np.median(steps)) if steps.size and given.dtype.kind not in "mM" else 0.0
    if step_s > SLOW_S or (samples > LONG and step_s > 1.0 / SLOW_HZ):
        words = f"time_s of {what}: the median step is {step_s:.4g} s ({1.0 / step_s:.4g} samples per second)"
        doubt([("slow_clock", f"{words}; if the time stamps are in milliseconds, divide them by 1000")])
    return stamps


def same_length(array: Array, samples: int, what: str, other: str) -> None:
    """Raise a `StretchError` if a column does not have as many samples as the `other` one, which has `samples`."""
    if array.size != samples:
        has = "have" if other == "columns" else "has"
        raise StretchError(f"{what} has {array.size} samples, but {other} {has} {samples}; give one value for each sample")


def is_many(values: Any) -> bool:
    """Return whether `values` holds several recordings: a list or tuple of arrays, or an array of two dimensions."""
    if isinstance(values, (list, tuple)):
        return len(values) > 0 and np.ndim(values[0]) > 0
    return bool(np.ndim(values) > 1)


def recordings(
    columns: Mapping[str, Any],
    rate_hz: float | None,
    time_s: Any,
    names: Sequence[str] | None = None,
    unnamed: str = "recording",
) -> list[dict[str, Any]]:
    """Return recordings in the form of the native module.

    Each value of `columns` is one array, or a list with one array for each recording. Without `names` a recording is named
    `unnamed` with its number.
    """
    first_name, first = next(iter(columns.items()))
    many = is_many(first)
    given = {name: list(values) if many else [values] for name, values in columns.items()}
    count = len(given[first_name])
    for name, values in given.items():
        if len(values) != count:
            raise StretchError(f"{name} has {len(values)} recordings, but {first_name} has {count}; give as many of each")
    stamps = [None] * count if time_s is None else list(time_s) if is_many(time_s) else [time_s] * count
    if len(stamps) != count:
        raise StretchError(f"time_s has {len(stamps)} recordings, but {first_name} has {count}; give as many of each")
    called = list(names) if names is not None else [f"{unnamed} {i + 1}" if many else f"the {unnamed}" for i in range(count)]
    if len(called) != count:
        raise StretchError(f"names has {len(called)} names for {count} recordings; give one name for each")
    made = []
    for i, name in enumerate(called):
        channels = [(key, column(values[i], f"{key} of {name}")) for key, values in given.items()]
        samples = channels[0][1].size
        for key, one in channels[1:]:
            same_length(one, samples, f"{key} of {name}", first_name)
        kept, channels = without_missing(name, times(samples, rate_hz, stamps[i], name), channels)
        made.append({"name": name, "time_s": kept, "channels": channels})
    return made
