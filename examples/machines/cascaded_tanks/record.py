"""Recordings of the tanks: FOLDER holds dataBenchmark.csv, with one row every 4 s."""

from __future__ import annotations

from pathlib import Path

import numpy as np

DT_S = 4.0
FIRST_S = 0.5
"""Time of the first row. It is not a whole second, because whole numbers in steps of 4 would be taken for milliseconds."""


def recordings(data: Path, every: int = 1) -> dict[str, dict[str, np.ndarray]]:
    """Returns the authors' two records: one for the fit and one for the test."""
    rows = np.genfromtxt(data / "dataBenchmark.csv", delimiter=",", skip_header=1, usecols=(0, 1, 2, 3))[::every]
    time_s = np.arange(len(rows)) * DT_S * every + FIRST_S
    return {
        "estimation": {"time_s": time_s, "pump_v": rows[:, 0], "level_v": rows[:, 2]},
        "validation": {"time_s": time_s, "pump_v": rows[:, 1], "level_v": rows[:, 3]},
    }
