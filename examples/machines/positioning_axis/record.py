"""Recordings of the axis: FOLDER holds emps_identification.csv and emps_pulses.csv."""

from __future__ import annotations

from pathlib import Path

import numpy as np

NEWTON_PER_VOLT = 35.15065188248547
HALF_WINDOW = 5
"""Half width of the window of the local cubic that gives speed and acceleration, in samples at 1 kHz."""


def derivatives(values, dt_s):
    """Returns value, first and second derivative from cubics that are fitted around each sample (Savitzky and Golay)."""
    reach = np.arange(-HALF_WINDOW, HALF_WINDOW + 1)
    taps = np.linalg.pinv(np.vander(reach * dt_s, 4, increasing=True))
    smooth = [np.convolve(values, taps[k][::-1], "valid") for k in range(3)]
    return smooth[0], smooth[1], 2.0 * smooth[2]


def recordings(data: Path, every: int = 1) -> dict[str, dict[str, np.ndarray]]:
    """Returns the columns at 200 Hz; with `every`, only each `every`-th of these rows."""
    made = {}
    for name in ("emps_identification", "emps_pulses"):
        table = np.genfromtxt(data / f"{name}.csv", delimiter=",", names=True)
        dt_s = float(np.median(np.diff(table["time_s"])))
        position, velocity, acceleration = derivatives(table["position_m"], dt_s)
        # the force is smoothed by the same window, so that force and motion lose the same frequencies
        force = derivatives(NEWTON_PER_VOLT * table["drive_v"], dt_s)[0]
        columns = {
            "time_s": np.arange(len(position)) * dt_s,
            "force_n": force,
            "velocity_m_per_s": velocity,
            "acceleration_m_per_s2": acceleration,
        }
        made[name] = {key: values[:: 5 * every] for key, values in columns.items()}
    return made
