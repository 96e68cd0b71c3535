"""The description of a simulator and of its recordings, as a user writes it."""

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
    """A nominal parameter: re-tuned within its tolerance before anything is blamed."""

    value: float
    """Value that the simulator ships with."""
    tolerance: float | None = None
    """How far it may be off, one standard deviation in its unit; exact where neither this nor `relative` is given."""
    relative: float | None = None
    """The same as a share of the value."""
    unit: str = ""
    least: float | None = None
    """Least value that makes sense. Without one, a value keeps its sign where its tolerance is a share of it, or less than it."""
    greatest: float | None = None
    """Greatest value that makes sense."""
    stages: Sequence[str] = ()
    """Stages that it acts in; all where none is named."""


@dataclass(frozen=True)
class Argument:
    """An argument of an effect that the simulator has itself."""

    min: float
    max: float
    off: float | None = 0.0
    """Value at which it does nothing; None for a shape (a time constant), which does not say whether the effect is on."""
    unit: str = ""
    log: bool = False
    """Whether it is searched in equal ratios."""


@dataclass(frozen=True)
class Effect:
    """An effect that the simulator has itself: arguments with values at which they do nothing."""

    arguments: Mapping[str, Argument]
    stages: Sequence[str] = ()
    """Stages that it acts in; all where none is named."""
    twins: Sequence[str] = ()
    """Effects that are hard to distinguish from it: they are fitted together with it."""


@dataclass(frozen=True)
class Stage:
    """Measured inputs in, one measured output out."""

    output: str
    """Column that the simulation is compared with."""
    inputs: Sequence[str] = ()
    """Columns that drive it."""
    name: str = ""
    unit: str = ""
    """Unit of the output; the last part of the column's name where it is empty."""
    noise: float | None = None
    """Noise of the output, one standard deviation; from the record where it is not known."""
    velocity: str | None = None
    """Column of the velocity at which it rubs, for friction."""
    position: str | None = None
    """Column of the position whose change is that velocity."""


@dataclass(frozen=True)
class Trial:
    """A recording: columns of numbers, and when they were taken."""

    columns: Mapping[str, ArrayLike]
    rate_hz: float | None = None
    """Samples a second; or give `time_s`, or a column of that name."""
    time_s: ArrayLike | None = None
    name: str = ""
    test: bool = False
    """Whether it may only be tested on. Without any such trial the last quarter of each is held back."""
    start_s: float | None = None
    """When it began in the session, s."""


Data = Union[Mapping[str, ArrayLike], Trial, Sequence[Any], "os.PathLike[str]", str, Any]
ParameterLike = Union[Parameter, float, "tuple[float, float]"]
EffectLike = Union[Effect, Argument, "tuple[float, float]", "tuple[float, float, float]"]


def trials(data: Data, rate_hz: float | None) -> list[Trial]:
    """Recordings from whatever holds them: a dict of arrays, a frame, a `Trial`, or a list of these."""
    if isinstance(data, Trial):
        return [data]
    if isinstance(data, (str, os.PathLike)):
        data = read(data)
    if isinstance(data, (list, tuple)):
        return [one for part in data for one in trials(part, rate_hz)]
    if hasattr(data, "columns") and not isinstance(data, Mapping):  # a frame, of whichever library
        frame: Any = data
        data = {str(name): np.asarray(frame[name]) for name in frame.columns}
    if not isinstance(data, Mapping):
        raise StretchError(
            f"data are a {type(data).__name__}; give a dict of arrays by column, a frame, a stretch_gap.Trial, the path of a "
            "recording, or a list of these"
        )
    columns = dict(data)
    time_s = columns.pop("time_s", None)
    name = data.name if isinstance(data, Recording) else ""
    return [Trial(columns, rate_hz=None if time_s is not None else rate_hz, time_s=time_s, name=name)]


def recorded(data: Data, rate_hz: float | None, wanted: Iterable[str]) -> list[tuple[dict[str, Any], float, bool]]:
    """Recordings as the native part takes them, with the columns that are wanted alone."""
    wanted = list(dict.fromkeys(wanted))
    made: list[tuple[dict[str, Any], float, bool]] = []
    begins_s = 0.0
    every = trials(data, rate_hz)
    if not every:
        raise StretchError("there is no recording; give at least one")
    for i, trial in enumerate(every):
        name = trial.name or (f"recording {i + 1}" if len(every) > 1 else "the recording")
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
"""Pause that is assumed between recordings that do not say when they began, s."""


def parameter(name: str, given: ParameterLike) -> dict[str, Any]:
    """A parameter as the native part takes it; a pair is value and tolerance, a number is exact."""
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
    """An effect as the native part takes it; a pair is the range of one argument that does nothing at 0."""
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
    """A stage as the native part takes it."""
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
    """Columns that a problem needs."""
    names: list[str] = []
    for one in stages:
        names += [one.output, *one.inputs, *(c for c in (one.velocity, one.position) if c)]
    return names + list(beside)
