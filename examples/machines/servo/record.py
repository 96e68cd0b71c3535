"""Recordings of one servo on the test stand: FOLDER holds motor_telemetry_NAME.csv.

The servo holds a command while two other servos pull at its lever through rubber bands, one to each side. Angles have steps of
2 pi/4096.
"""

from __future__ import annotations

import csv
from datetime import datetime
from pathlib import Path

import numpy as np

DEGREES_PER_STEP = 360.0 / 4096.0
STANDS = {
    # name: log, servo under test, the two pulling servos with their commands at rest
    "single": ("single", 5, {3: 1747, 4: 2347}),
    "preloaded": ("comp2", 1, {3: 1747, 4: 2347}),
    "not_preloaded": ("nocomp2", 1, {3: 1747, 4: 2347}),
}


def read(data: Path, stand: str) -> dict[str, np.ndarray]:
    """Returns time, command, position and pull of the rows in which all positions are known."""
    log, own, pullers = STANDS[stand]
    with open(data / f"motor_telemetry_{log}.csv", newline="") as file:
        rows = [row for row in csv.DictReader(file) if all(row[f"pos ({m})"] for m in (own, *pullers))]
    stamps = [datetime.fromisoformat(row["timestamp"].replace("Z", "+00:00")).timestamp() for row in rows]

    def column(name):
        return np.array([float(row[name]) for row in rows])

    # each pulling servo stretches its band by its angle from rest, and the two pull in opposite directions
    pull = -sum(column(f"pos ({motor})") - rest for motor, rest in pullers.items())
    return {
        "time_s": np.array(stamps) - stamps[0],
        "command_deg": (column(f"target pos ({own})") - 2047.0) * DEGREES_PER_STEP,
        "pull_deg": pull * DEGREES_PER_STEP,
        "angle_deg": (column(f"pos ({own})") - 2047.0) * DEGREES_PER_STEP,
    }


SETTLED_S = 0.8
"""Time after a command at which the servo has reached its position."""


def recordings(data: Path, every: int = 1, stand: str = "single") -> dict[str, dict[str, np.ndarray]]:
    """Returns the holds of a log at 10 Hz, joined end to end. The motions from one command to the next are left out, because the
    simulator models holds only."""
    rows = read(data, stand)
    time_s = np.arange(0.0, rows["time_s"][-1], 0.1 * every)
    last = np.maximum(np.searchsorted(rows["time_s"], time_s + 1e-9, side="right") - 1, 0)
    command = rows["command_deg"][last]
    changed = np.concatenate([[0.0], time_s[1:][np.diff(command) != 0.0]])
    since_s = time_s - changed[np.searchsorted(changed, time_s, side="right") - 1]
    holds = (command == 0.0) & (since_s > SETTLED_S)
    made = {name: np.interp(time_s, rows["time_s"], rows[name])[holds] for name in ("pull_deg", "angle_deg")}
    return {"holds": {"time_s": np.arange(holds.sum()) * 0.1 * every, **made}}
