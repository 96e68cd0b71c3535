"""Assignment of the columns of a recording to the joints of a MuJoCo model, and checks of these columns."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from . import problem as entries
from ._stretch import StretchError

COMMANDS = ("cmd", "command", "commanded", "target", "goal", "desired", "setpoint", "ref", "reference", "action", "ctrl")
"""Words in the name of a command column, in addition to the name of the joint."""
OTHERS = ("vel", "velocity", "speed", "torque", "effort", "current", "load", "acc", "acceleration", "temp", "force")
"""Words in the names of columns that are neither a command nor a position."""


@dataclass(frozen=True)
class Joint:
    """Joint of a model with its actuator and its columns.

    Attributes
    ----------
    name : str
        Name of the joint.
    actuator : str
        Name of its actuator.
    commanded : str
        Column of the commanded position.
    measured : str
        Column of the measured position.
    scale : float
        Factor from the unit of the columns to that of the model: pi/180 for degrees, otherwise 1.
    """

    name: str
    actuator: str
    commanded: str
    measured: str
    scale: float


def trials(recording: entries.Data, rate_hz: float | None, asked: object) -> list[entries.Trial]:
    """Return the recordings in `recording`, each with its time stamps or its sample rate. For `asked` see `found`."""
    made = []
    wanted = [column for pair in asked.values() for column in pair] if isinstance(asked, Mapping) else []
    for trial in entries.trials(recording, rate_hz, wanted):
        columns = dict(trial.columns)
        rate, time_s = entries.clock(trial.name or "the recording", columns, trial, rate_hz)
        made.append(entries.Trial(columns, rate_hz=rate, time_s=time_s, name=trial.name, test=trial.test, start_s=trial.start_s))
    if not made:
        raise StretchError("recording is empty; give at least one recording")
    return made


def words(column: str) -> list[str]:
    """Split the name of a column into words in lower case."""
    return [word for word in "".join(c.lower() if c.isalnum() else " " for c in column).split() if word]


def of_joint(name: str, columns: Sequence[str], names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the columns of a joint's command, and those of its position.

    A column belongs to a joint if it contains the words of the joint's name, and does not contain the longer name of another
    joint.
    """
    own = words(name)

    def holds(column: list[str], joint: list[str]) -> bool:
        return any(column[i : i + len(joint)] == joint for i in range(len(column) - len(joint) + 1))

    longer = [words(other) for other in names if other != name and len(words(other)) > len(own)]
    mine = [c for c in columns if holds(words(c), own) and not any(holds(words(c), other) for other in longer)]
    rest = {c: set(words(c)) - set(own) for c in mine}
    commanded = [c for c in mine if rest[c] & set(COMMANDS) and not rest[c] & set(OTHERS)]
    measured = [c for c in mine if c not in commanded and not rest[c] & set(OTHERS)]
    return commanded, measured


def found(
    joints: Mapping[str, bool],
    actuators: Mapping[str, str],
    limits: Mapping[str, tuple[float, float]],
    given: Sequence[entries.Trial],
    asked: Sequence[str] | Mapping[str, tuple[str, str]] | None,
    degrees: bool | None,
) -> tuple[list[Joint], list[str]]:
    """Return the joints that are diagnosed, and notes on the other joints.

    `joints` states for each joint of the model whether its position is one number. `actuators` holds the actuator of each
    joint, and `limits` the limits of hinges in rad. `asked` and `degrees` are the arguments `joints` and `degrees` of
    `mujoco.problem`.
    """
    columns, named = list(map(str, given[0].columns)), list(joints)
    for name in asked or ():
        if name not in joints:
            near = difflib.get_close_matches(name, named, 1, 0.5)
            raise StretchError(
                f"the model has no joint {name!r}; it has {', '.join(named) or 'none'}"
                + (f"; is it {near[0]!r}?" if near else "")
            )
    chosen, notes = [], []
    for name in asked or named:
        pair = asked[name] if isinstance(asked, Mapping) else _columns(name, columns, named, asked is not None)
        if pair is None:
            notes.append(f"joint {name} is not diagnosed, because no columns match its command and its position")
            continue
        if not joints[name]:
            raise StretchError(
                f"joint {name} is a ball or a free joint, so its position is a quaternion and not one number; select other "
                f"joints (joints=[...])"
            )
        if name not in actuators:
            raise StretchError(
                f"joint {name} has no actuator in the model; add one to the model, or leave the joint out (joints=[...])"
            )
        for column in pair:
            missing = [trial.name or "the recording" for trial in given if column not in trial.columns]
            if missing:
                raise StretchError(f"{missing[0]}: there is no column {column}; the columns are {', '.join(columns)}")
        if not _moves(given, pair[1]):
            if asked:
                raise StretchError(
                    f"joint {name} never moved: {pair[1]} has the same value in every row; leave it out (joints=[...])"
                )
            notes.append(f"joint {name} is not diagnosed, because it never moved")
            continue
        chosen.append(Joint(name, actuators[name], *pair, _scale(name, pair, limits.get(name), given, degrees)))
    if not chosen:
        raise StretchError(
            f"no joint of the model moves in these columns. Joints: {', '.join(named) or 'none'}. Columns: "
            f"{', '.join(columns)}. "
            'Assign columns to joints: joints={"elbow": ("elbow_cmd_rad", "elbow_rad")}'
        )
    return chosen, notes


def _columns(name: str, columns: Sequence[str], names: Sequence[str], is_asked: bool) -> tuple[str, str] | None:
    commanded, measured = of_joint(name, columns, names)
    if len(commanded) == 1 and len(measured) == 1:
        return commanded[0], measured[0]
    if not is_asked and not (commanded and measured):
        return None
    what = f"{', '.join(commanded) or 'none'} for the command and {', '.join(measured) or 'none'} for the position"
    raise StretchError(
        f'joint {name}: the columns are {what}; give one of each: joints={{"{name}": ("column of the command", '
        f'"column of the '
        f'position")}}; the recording has the columns {", ".join(columns)}'
    )


def _all(given: Sequence[entries.Trial], column: str) -> np.ndarray:
    return np.concatenate([np.asarray(trial.columns[column], dtype=float) for trial in given])


def _moves(given: Sequence[entries.Trial], column: str) -> bool:
    return bool(np.ptp(_all(given, column)) > 0.0)


def _scale(
    name: str, pair: tuple[str, str], limit: tuple[float, float] | None, given: Sequence[entries.Trial], degrees: bool | None
) -> float:
    """Return the factor from the unit of the columns to radians.

    If the values can only be degrees, but neither the names of the columns nor `degrees` say so, raise a `StretchError`.
    """
    is_deg = [column.lower().rsplit("_", 1)[-1] in ("deg", "degrees") for column in pair]
    if is_deg[0] != is_deg[1] and degrees is None:
        raise StretchError(
            f"joint {name}: by their names, one of {pair[0]} and {pair[1]} is in degrees and one is not; use one unit"
        )
    if degrees or (degrees is None and is_deg[0]):
        return math.pi / 180.0
    values = _all(given, pair[1])
    low, high = limit if limit else (-2.0 * math.pi, 2.0 * math.pi)
    reach, most = float(np.max(np.abs(values))), max(abs(low), abs(high))
    is_beyond = reach > 2.0 * most and math.pi / 180.0 * reach <= 1.2 * most
    if is_beyond and degrees is None and not pair[1].lower().endswith(("_rad", "_m", "_mm")):
        raise StretchError(
            f"joint {name}: {pair[1]} reaches {reach:.4g}, but the model only {most:.4g} rad, so the column is in degrees; give "
            f"degrees=True (or degrees=False if "
            "it is in radians)"
        )
    return 1.0


def require_commands(joints: Sequence[Joint], given: Sequence[entries.Trial]) -> None:
    """Raise a `StretchError` if a command is equal to the measurement, or is constant."""
    for joint in joints:
        commanded, measured = _all(given, joint.commanded), _all(given, joint.measured)
        if commanded.shape == measured.shape and np.array_equal(commanded, measured):
            raise StretchError(
                f"joint {joint.name}: the command {joint.commanded} is equal to the measurement {joint.measured} in "
                f"every row; record the command that was "
                "sent to the servo"
            )
        if np.ptp(commanded) == 0.0:
            raise StretchError(
                f"joint {joint.name}: the command {joint.commanded} has the same value in every row, although the joint moves; "
                f"record the command that was sent to the servo"
            )
