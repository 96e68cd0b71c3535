"""Recordings of a sleeve: FOLDER is the authors' `data/Regression`, with one folder per movement. One minute of the first session
of a file is read.

In place of FOLDER, a file with one session and the columns time_s, angle_deg, s1 to s5 can be given.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

RATE_HZ = 100.0
SENSORS = ("s1", "s2", "s3", "s4", "s5")
SECONDS = 60.0


def session(data: Path, file: str = "") -> dict[str, np.ndarray]:
    """Returns the angle and the sensor signals of a session, from the authors' file or from a file with the columns above."""
    path = data / file if file else data
    with open(path, encoding="utf-8-sig") as lines:
        has_names = "time_s" in lines.readline()
    rows = np.genfromtxt(path, delimiter=",", skip_header=int(has_names), encoding="utf-8-sig")
    rows = rows[:, 1:7] if has_names else rows[:, :6]
    return dict(zip(("angle_deg", *SENSORS), rows[: int(SECONDS * RATE_HZ)].T))


def recordings(data: Path, every: int = 1, file: str = "", shift_s: float = 0.0) -> dict[str, dict[str, np.ndarray]]:
    """Returns a session at 50 Hz; all sensor signals are delayed by `shift_s`."""
    columns = session(data, file)
    time_s = np.arange(len(columns["angle_deg"])) / RATE_HZ
    for name in SENSORS if shift_s else ():
        columns[name] = np.interp(time_s - shift_s, time_s, columns[name])
    rows = slice(None, None, 2 * every)
    return {"session": {"time_s": time_s[rows], **{name: values[rows] for name, values in columns.items()}}}
