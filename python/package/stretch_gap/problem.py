"""Descriptions of parameters, effects, stages and recordings, and their conversion for the native module."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Union

import numpy as np
from numpy.typing import ArrayLike

from ._stretch import StretchError
from .reading import Recording, read
from .recordings import column, same_length, times, without_missing


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


def trials(data: Data, rate_hz: float | None) -> list[Trial]:
    """Return the recordings in `data`: a dict of arrays, a data frame, a `Trial`, the path of a recording, or a list of these."""
    if isinstance(data, Trial):
        return [data]
    if isinstance(data, (str, os.PathLike)):
        data = read(data)
    if isinstance(data, (list, tuple)):
        return [one for part in data for one in trials(part, rate_hz)]
    if hasattr(data, "columns") and not isinstance(data, Mapping):  # a data frame of any library
        frame: Any = data
        data = {str(name): np.asarray(frame[name]) for name in frame.columns}
    if not isinstance(data, Mapping):
        raise StretchError(
            f"data is a {type(data).__name__}; give a dict of arrays by column, a data frame, a stretch_gap.Trial, the path of a "
            "recording, or a list of these"
        )
    columns = dict(data)
    time_s = columns.pop("time_s", None)
    name = data.name if isinstance(data, Recording) else ""
    return [Trial(columns, rate_hz=None if time_s is not None else rate_hz, time_s=time_s, name=name)]


def recorded(data: Data, rate_hz: float | None, wanted: Iterable[str]) -> list[tuple[dict[str, Any], float, bool]]:
    """Return recordings in the form of the native module, with only the columns in `wanted`."""
    wanted = list(dict.fromkeys(wanted))
    made: list[tuple[dict[str, Any], float, bool]] = []
    begins_s = 0.0
    every = trials(data, rate_hz)
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
        stamps = trial.time_s
        if stamps is None and trial.rate_hz is None:
            stamps = held.pop("time_s", None)
        missing = [c for c in wanted if c not in held]
        if missing:
            there = ", ".join(map(str, held)) or "none"
            raise StretchError(f"{name}: there is no column {missing[0]}; the columns are {there}")
        channels = [(c, column(held[c], f"{c} of {name}")) for c in wanted]
        samples = channels[0][1].size
        for c, values in channels:
            same_length(values, samples, f"{c} of {name}")
        rate = None if stamps is not None else trial.rate_hz or rate_hz
        time_s, channels = without_missing(name, times(samples, rate, stamps, name), channels)
        start_s = begins_s if trial.start_s is None else trial.start_s
        begins_s = start_s + float(time_s[-1] - time_s[0] if samples else 0.0) + PAUSE_S
        made.append(({"name": name, "time_s": time_s, "channels": channels}, start_s, trial.test))
    return made


PAUSE_S = 15.0
"""Pause that is assumed before a recording without a start time, s."""


def parameter(name: str, given: ParameterLike) -> dict[str, Any]:
    """Return a parameter in the form of the native module. A tuple is `(value, tolerance)`, and a number is exact."""
    if isinstance(given, tuple):
        given = Parameter(*given)
    elif not isinstance(given, Parameter):
        given = Parameter(float(given))
    share = None if given.relative is None else f"{100.0 * given.relative!r} %"
    return {
        "name": name,
        "unit": given.unit,
        "value": float(given.value),
        "tolerance": share if given.tolerance is None else float(given.tolerance),
        "least": given.least,
        "greatest": given.greatest,
        "stages": list(given.stages),
    }


def effect(name: str, given: EffectLike) -> dict[str, Any]:
    """Return an effect in the form of the native module.

    A tuple is the range of one argument, with its value `off` if it is not 0.
    """
    if isinstance(given, tuple):
        given = Argument(*given)
    if isinstance(given, Argument):
        given = Effect({name: given})
    if not isinstance(given, Effect):
        raise StretchError(
            f"effect {name} is {given!r}; give (least, greatest), (least, greatest, off), a stretch_gap.Argument, "
            "or a stretch_gap.Effect"
        )
    arguments = [
        {"name": key, "unit": a.unit, "range": [float(a.min), float(a.max)], "off": a.off, "log": a.log}
        for key, a in given.arguments.items()
    ]
    return {"name": name, "argument": arguments, "stages": list(given.stages), "twins": list(given.twins)}


def stage(given: Stage, index: int, units: Mapping[str, str], noise: Mapping[str, float]) -> dict[str, Any]:
    """Return a stage in the form of the native module."""
    return {
        "name": given.name or (f"stage {index + 1}" if index else "simulator"),
        "output": given.output,
        "unit": given.unit or units.get(given.output, ""),
        "inputs": list(given.inputs),
        "noise": given.noise if given.noise is not None else noise.get(given.output),
        "velocity": given.velocity,
        "position": given.position,
    }


def wanted(stages: Sequence[Stage], beside: Sequence[str]) -> list[str]:
    """Return the names of the columns that a problem needs."""
    names: list[str] = []
    for one in stages:
        names += [one.output, *one.inputs, *(c for c in (one.velocity, one.position) if c)]
    return names + list(beside)
