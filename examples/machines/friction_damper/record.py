"""Recordings of the damper: FOLDER is the folder `data` of the data set, which contains dataset-2 and dataset-3."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

MM_PER_INCH, KN_PER_KIP = 25.4, 4.4482216
FITTED = ("0.25Hz30lbtension1amplitude", "0.5Hz30lbtension1.5amplitude", "1Hz30lbtension0.5amplitude")
TESTED = ("0.5Hz30lbtension1amplitude", "1Hz30lbtension1.5amplitude")
FLAGGED = (
    "0.25Hz0lbtension0.5amplitude",
    "0.5Hz0lbtension0.5amplitude",
    "1Hz0lbtension0.5amplitude",
    "2Hz0lbtension0.5amplitude",
    "0.25Hz0lbtension1amplitude",
)
"""Tests whose tension the authors flag as wrong. The files of two more such tests, at 0.1 Hz, were too large to be obtained."""
SOUND = (
    "0.5Hz0lbtension1amplitude",
    "1Hz0lbtension1amplitude",
    "2Hz0lbtension1amplitude",
    "0.25Hz0lbtension1.5amplitude",
    "0.5Hz0lbtension1.5amplitude",
    "1Hz0lbtension1.5amplitude",
)
"""Tests at the same tension that the authors do not flag."""


def test(data: Path, name: str, every: int = 1) -> dict[str, np.ndarray]:
    """Returns a test at 128 Hz; with `every`, only each `every`-th of these rows."""
    rows = np.array(json.loads((data / "dataset-2" / "characterization datasets" / f"{name}.json").read_text())["data"])
    rows = rows[:: 8 * every]
    return {
        "time_s": np.arange(len(rows)) / 128.0 * every,
        "displacement_mm": rows[:, 1] * MM_PER_INCH,
        "velocity_mm_per_s": rows[:, 3] * MM_PER_INCH,
        "force_kn": rows[:, 2] * KN_PER_KIP,
        "pull_1_kn": rows[:, 4] * KN_PER_KIP / 1000.0,
        "pull_2_kn": rows[:, 5] * KN_PER_KIP / 1000.0,
    }


def recordings(data: Path, every: int = 1, tests: str = "30 lb") -> dict[str, dict[str, np.ndarray]]:
    """Returns five tests at 30 lb, or the eleven tests at 0 lb."""
    names = (*FITTED, *TESTED) if tests == "30 lb" else (*FLAGGED, *SOUND)
    return {name: test(data, name, every) for name in names}
