"""Descriptions of parameters, effects, stages and recordings, and their conversion for the native module."""

from __future__ import annotations

import operator
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Union

import numpy as np
from numpy.typing import ArrayLike

from ._stretch import StretchError
from .reading import Recording, read
from .recordings import column, doubt, number, same_length, times, unknown, without_missing


@dataclass(frozen=True)
class Parameter:
    """Nominal parameter of a simulator, which the diagnosis re-tunes within its tolerance.

    The value is exact, and is not re-tuned, if neither `tolerance` nor `relative` is given.

    Parameters
    ----------
    value : float
        Nominal value in the simulator, in `unit`.
    tolerance : float, optional
        Uncertainty of the value, one standard deviation in `unit`. The value is re-tuned within three standard deviations. If
        this is given, `relative` is ignored.
    relative : float, optional
        Uncertainty as a share of the value: 0.1 is 10 %.
    unit : str, default ""
        Unit of the value. Empty if it has none.
    least : float, optional
        Smallest plausible value. By default the value keeps its sign if its tolerance is relative, or smaller than the value.
    greatest : float, optional
        Greatest plausible value. By default it is not limited.
    stages : sequence of str, default ()
        Names of the stages in which the parameter acts. `()` means all stages.

    Examples
    --------
    >>> import stretch_gap
    >>> stretch_gap.Parameter(2.0, relative=0.1, unit="mm/N").relative
    0.1
    """

    value: float
    tolerance: float | None = None
    relative: float | None = None
    unit: str = ""
    least: float | None = None
    greatest: float | None = None
    stages: Sequence[str] = ()


@dataclass(frozen=True)
class Argument:
    """Argument of an effect that the simulator itself implements.

    Parameters
    ----------
    min : float
        Smallest plausible value, in `unit`.
    max : float
        Greatest plausible value, in `unit`.
    off : float or None, default 0.0
        Value at which the effect does nothing. None if the argument is only a shape of the effect, such as a time constant, and
        does not switch the effect off.
    unit : str, default ""
        Unit of the argument. Empty if it has none.
    log : bool, default False
        Whether the argument is searched on a logarithmic scale. `min` must then be positive.

    Examples
    --------
    >>> import stretch_gap
    >>> stretch_gap.Argument(0.001, 1.0, off=None, unit="s", log=True).max
    1.0
    """

    min: float
    max: float
    off: float | None = 0.0
    unit: str = ""
    log: bool = False


@dataclass(frozen=True)
class Effect:
    """Effect that the simulator itself implements, with several arguments.

    For an effect with one argument, an `Argument` or a tuple suffices.

    Parameters
    ----------
    arguments : dict of str to Argument
        Arguments by name. At least one has a value at which the effect does nothing (`off`).
    stages : sequence of str, default ()
        Names of the stages in which the effect acts. `()` means all stages.
    twins : sequence of str, default ()
        Names of effects that are hard to distinguish from this effect. They are fitted together with it.

    Examples
    --------
    >>> import stretch_gap
    >>> stick = stretch_gap.Argument(0.0, 5.0, unit="N")
    >>> creep = stretch_gap.Argument(0.01, 1.0, off=None, unit="m/s", log=True)
    >>> list(stretch_gap.Effect({"stick": stick, "creep": creep}).arguments)
    ['stick', 'creep']
    """

    arguments: Mapping[str, Argument]
    stages: Sequence[str] = ()
    twins: Sequence[str] = ()


@dataclass(frozen=True)
class Stage:
    """Part of a simulator that maps measured inputs to one measured output.

    Parameters
    ----------
    output : str
        Column of the measurement that the simulation is compared with.
    inputs : str or sequence of str, default ()
        Columns that drive the stage.
    name : str, default ""
        Name of the stage. By default `"simulator"` for the first stage, and `"stage 2"`, `"stage 3"` and so on for the others.
    unit : str, default ""
        Unit of the output. By default the last part of the column's name.
    noise : float, optional
        Noise of the output, one standard deviation in its unit. By default it is estimated from the recordings.
    velocity : str, optional
        Column of the velocity at which parts with friction move. Effects of friction need it or `position`. Without both, the
        output is used if a force or a torque drives the stage and the output is a speed, a position or an angle.
    position : str, optional
        Column of the position from which this velocity is computed.

    Examples
    --------
    >>> import stretch_gap
    >>> stretch_gap.Stage("angle_deg", "cmd_deg", name="servo").inputs
    ('cmd_deg',)
    """

    output: str
    inputs: str | Sequence[str] = ()
    name: str = ""
    unit: str = ""
    noise: float | None = None
    velocity: str | None = None
    position: str | None = None

    def __post_init__(self) -> None:
        if isinstance(self.inputs, str):
            object.__setattr__(self, "inputs", (self.inputs,))


@dataclass(frozen=True)
class Trial:
    """Recording with its time stamps, a name and a role.

    Give one of `rate_hz`, `time_s`, a column `time_s`, and the argument `rate_hz` of the function that takes the recording.

    Parameters
    ----------
    columns : dict of str to array_like of shape (samples,)
        Columns by name, all of the same length.
    rate_hz : float, optional
        Sample rate in Hz.
    time_s : array_like of shape (samples,), optional
        Increasing time stamps in seconds, or an array of `datetime64` or `timedelta64`.
    name : str, default ""
        Name of the recording in notes and messages. By default recordings are numbered.
    test : bool, default False
        Whether the recording is used only to test the result, and is not fitted. If no recording of a problem is a test
        recording, the last quarter of each recording is held back for the test.
    start_s : float, optional
        Start of the recording in the session, s. It matters for effects that drift. By default a pause of 15 s after the previous
        recording is assumed.

    Examples
    --------
    >>> import stretch_gap
    >>> trial = stretch_gap.Trial({"force_N": [0, 1, 2], "length_mm": [0, 2, 4]}, rate_hz=100.0, name="tuesday", test=True)
    >>> trial.name, trial.test
    ('tuesday', True)
    """

    columns: Mapping[str, ArrayLike]
    rate_hz: float | None = None
    time_s: ArrayLike | None = None
    name: str = ""
    test: bool = False
    start_s: float | None = None


Data = Union[Mapping[str, ArrayLike], Trial, Sequence[Any], "os.PathLike[str]", str, Any]
ParameterLike = Union[Parameter, float, "tuple[float, float]"]
EffectLike = Union[Effect, Argument, "tuple[float, float]", "tuple[float, float, float]"]


def trials(data: Data, rate_hz: float | None, wanted: Iterable[str] = ()) -> list[Trial]:
    """Return the recordings in `data`: a dict of arrays, a data frame, a `Trial`, the path of a recording, or a list of these.

    A column in `wanted` may be named by the last part of its path, if only one path has this ending.
    """
    if isinstance(data, Trial):
        return [replace(data, columns=by_last_part(data.columns, wanted))]
    if isinstance(data, (str, os.PathLike)):
        data = read(data)
    if isinstance(data, (list, tuple)):
        return [one for part in data for one in trials(part, rate_hz, wanted)]
    if hasattr(data, "columns") and not isinstance(data, Mapping):  # a data frame of any library
        frame: Any = data
        index: Any = getattr(frame, "index", None)
        index = index.tz_convert(None) if getattr(index, "tz", None) else index
        data = {str(name): np.asarray(frame[name]) for name in frame.columns}
        stamps = np.asarray(index)
        if (stamps.dtype.kind in "mM" or getattr(index, "name", None) in CLOCKS) and data.keys().isdisjoint(CLOCKS):
            data["time_s"] = stamps
    if not isinstance(data, Mapping):
        raise StretchError(
            f"the type of data is {type(data).__name__}; give a dict of arrays by column, a data frame, a stretch_gap.Trial, the "
            "path of a recording, or a list of these"
        )
    columns = dict(data)
    time_s = columns.pop("time_s", None)
    name = data.name if isinstance(data, Recording) else ""
    notes = data.notes if isinstance(data, Recording) else []
    lost = [note for note in notes if re.search(r"\brows?\b.* (is|are) left out", note)]
    doubt(("missing_samples", f"{name}: {note}; such samples count as lost") for note in lost)
    named = by_last_part(columns, wanted)
    return [Trial(named, rate_hz=None if time_s is not None else rate_hz, time_s=time_s, name=name)]


def by_last_part(columns: Mapping[str, ArrayLike], wanted: Iterable[str]) -> Mapping[str, ArrayLike]:
    """Rename the columns that `wanted` names by the last part of their paths to this part, as the reader of files does."""
    renamed = {}
    for name in wanted if isinstance(columns, Mapping) else ():
        paths = [path for path in columns if str(path).endswith((f"/{name}", f".{name}"))]
        if len(paths) == 1 and name not in columns:
            renamed[paths[0]] = name
    return {renamed.get(path, path): values for path, values in columns.items()} if renamed else columns


def recorded(data: Data, rate_hz: float | None, wanted: Iterable[str]) -> list[tuple[dict[str, Any], float, bool]]:
    """Return recordings in the form of the native module, with only the columns in `wanted`."""
    wanted = list(dict.fromkeys(wanted))
    made: list[tuple[dict[str, Any], float, bool]] = []
    begins_s = 0.0
    every = trials(data, rate_hz, wanted)
    if not every:
        raise StretchError("data is empty; give at least one recording")
    for i, trial in enumerate(every):
        name = trial.name or (f"recording {i + 1}" if len(every) > 1 else "the recording")
        if not isinstance(trial.columns, Mapping):
            raise StretchError(
                f"{name}: the columns of a Trial are a {type(trial.columns).__name__}; give a dict of arrays by column, such as "
                'Trial(stretch_gap.read("day1.csv"))'
            )
        held = dict(trial.columns)
        rate, stamps = clock(name, held, trial, rate_hz, wanted)
        missing = [c for c in wanted if c not in held]
        if missing and missing[0] in CLOCKS and missing[0] in {"time_s", *trial.columns}:
            raise StretchError(
                f"{name}: {missing[0]} is the time of the samples, which is no input; leave it out. A simulator that takes the "
                'argument inputs finds the time in inputs["time_s"]'
            )
        if missing:
            raise unknown("column", missing[0], held, f"{name}: ")
        channels = [(c, column(held[c], f"{c} of {name}")) for c in wanted]
        samples = channels[0][1].size
        for c, values in channels:
            same_length(values, samples, f"{c} of {name}", wanted[0])
        time_s, channels = without_missing(name, times(samples, rate, stamps, name), channels)
        start_s = begins_s if trial.start_s is None else trial.start_s
        begins_s = start_s + float(time_s[-1] - time_s[0] if samples else 0.0) + PAUSE_S
        made.append(({"name": name, "time_s": time_s, "channels": channels}, start_s, trial.test))
    return made


PAUSE_S = 15.0
"""Pause that is assumed before a recording without a start time, s."""


CLOCKS = ("time_s", "t", "time")
"""Columns that are the time in seconds, if neither time stamps nor a rate are given. The reader of files takes them as well."""


def clock(
    name: str, held: dict[str, Any], trial: Trial, rate_hz: float | None, kept: Sequence[str] = ()
) -> tuple[float | None, ArrayLike | None]:
    """Return the sample rate of a recording, or else its time stamps. A column with the time is removed from `held`.

    The columns in `kept` are not the time.
    """
    rate = trial.rate_hz or rate_hz
    stamps = trial.time_s
    if stamps is None and trial.rate_hz is None:
        known = [c for c in (CLOCKS[:1] if rate else CLOCKS) if c in held and c not in kept]
        stamps = held.pop(known[0]) if known else None
    if stamps is None and rate is None:
        raise StretchError(
            f"{name}: there is no time: none of its columns ({', '.join(map(str, held)) or 'it has none'}) is called "
            f"{', '.join(CLOCKS[:-1])} or {CLOCKS[-1]}; add the time in seconds as time_s, or give rate_hz, the sample rate"
        )
    return (rate, None) if stamps is None else (None, stamps)


def deviation(what: str, given: Any) -> float:
    """Return a standard deviation that the user gave."""
    value = number(what, given)
    if value < 0.0:
        raise StretchError(f"{what} is {value:g}; give one standard deviation, which is not below 0")
    return value


def whole(what: str, given: Any, least: int) -> int:
    """Return a whole number that the user gave."""
    try:
        if operator.index(given) >= least:
            return operator.index(given)
    except TypeError:
        pass
    raise StretchError(f"{what} is {given!r}; give a whole number of at least {least}")


def by_name(what: str, given: Any, example: str) -> dict[str, Any]:
    """Return values by name that the user gave. None means that there are none."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise StretchError(f"{what} is a {type(given).__name__}; give a dict by name, such as {what}={example}")
    return dict(given)


def text(what: str, given: Any) -> str:
    """Return text that the user gave."""
    if not isinstance(given, str):
        raise StretchError(f"{what} is {given!r}; give text")
    return given


def texts(what: str, given: Any) -> list[str]:
    """Return names that the user gave: one, several, or None."""
    names = [given] if isinstance(given, str) else [] if given is None else given
    if isinstance(names, Mapping) or not isinstance(names, Iterable) or not all(isinstance(name, str) for name in names):
        raise StretchError(f"{what} is {given!r}; give a name, or a list of names")
    return list(names)


def parameter(name: str, given: ParameterLike) -> dict[str, Any]:
    """Return a parameter in the form of the native module. A tuple is `(value, tolerance)`, and a number is exact."""
    what = f"parameter {name}"
    is_tuple = isinstance(given, (tuple, list))
    if isinstance(given, (tuple, list)):
        if len(given) != 2:
            raise StretchError(
                f"{what} is {given!r}; give (value, tolerance), where the tolerance is one standard deviation, or a "
                "stretch_gap.Parameter, which also takes least and greatest"
            )
        given = Parameter(*given)
    elif not isinstance(given, Parameter):
        given = Parameter(given)
    value = number(f"{what}: the value", given.value)
    least, greatest, share = (
        None if one is None else number(f"{what}: {key}", one)
        for key, one in [("least", given.least), ("greatest", given.greatest), ("relative", given.relative)]
    )
    tolerance = None if given.tolerance is None else deviation(f"{what}: the tolerance", given.tolerance)
    if tolerance is None and share is not None and not 0.0 <= share <= 1.0:
        raise StretchError(
            f"{what}: relative is {share:g}, that is, {100.0 * share:g} % of the value; give a share from 0 to 1 (0.1 is 10 %), "
            "or the argument tolerance in the unit of the parameter"
        )
    if is_tuple and tolerance is not None and tolerance > abs(value) > 0.0:
        words = f"{what}: ({value:g}, {tolerance:g}) is read as the value {value:g} with the standard deviation {tolerance:g}"
        instead = "if it is a range, give Parameter(VALUE, tolerance=..., least=..., greatest=...)"
        doubt([("large_tolerance", f"{words}; {instead}")])
    return {
        "name": name,
        "unit": given.unit,
        "value": value,
        "tolerance": f"{100.0 * share!r} %" if tolerance is None and share is not None else tolerance,
        "least": least,
        "greatest": greatest,
        "stages": texts(f"{what}: stages", given.stages),
    }


def effect(name: str, given: EffectLike) -> dict[str, Any]:
    """Return an effect in the form of the native module.

    A tuple is the range of one argument, with its value `off` if it is not 0.
    """
    what = f"effect {name}"
    if isinstance(given, (tuple, list)) and len(given) in (2, 3):
        given = Argument(*given)
    if isinstance(given, Argument):
        given = Effect({name: given})
    if not isinstance(given, Effect):
        raise StretchError(
            f"{what} is {given!r}; give (least, greatest), (least, greatest, off), a stretch_gap.Argument, "
            "or a stretch_gap.Effect"
        )
    stages, twins = texts(f"{what}: stages", given.stages), texts(f"{what}: twins", given.twins)
    arguments = [_argument(what, key, one) for key, one in by_name("arguments", given.arguments, ARGUMENTS).items()]
    return {"name": name, "argument": arguments, "stages": stages, "twins": twins}


ARGUMENTS = '{"gain": stretch_gap.Argument(0.0, 2.0)}'


def _argument(what: str, name: str, given: Any) -> dict[str, Any]:
    """Return an argument of an effect in the form of the native module."""
    if not isinstance(given, Argument):
        raise StretchError(f"{what}: the argument {name} is {given!r}; give a stretch_gap.Argument")
    least, greatest = number(f"{what}: the least value", given.min), number(f"{what}: the greatest value", given.max)
    if not least < greatest:
        raise StretchError(f"{what}: the range {least:g} to {greatest:g} is empty; give the least value first")
    off = None if given.off is None else number(f"{what}: off", given.off)
    return {"name": name, "unit": given.unit, "range": [least, greatest], "off": off, "log": given.log}


def stage(given: Stage, index: int, units: Mapping[str, str], noise: Mapping[str, float]) -> dict[str, Any]:
    """Return a stage in the form of the native module."""
    return {
        "name": given.name or (f"stage {index + 1}" if index else "simulator"),
        "output": given.output,
        "unit": given.unit or units.get(given.output, ""),
        "inputs": list(given.inputs),
        "noise": noise.get(given.output) if given.noise is None else deviation(f"noise of {given.output}", given.noise),
        "velocity": given.velocity,
        "position": given.position,
    }


def wanted(stages: Sequence[Stage], beside: Sequence[str]) -> list[str]:
    """Return the names of the columns that a problem needs."""
    names: list[str] = []
    for one in stages:
        names += [one.output, *one.inputs, *(c for c in (one.velocity, one.position) if c)]
    return names + list(beside)
