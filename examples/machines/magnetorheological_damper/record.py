"""The recording of the damper: FOLDER holds boucwen_histeretic_system.csv, without a time; position and velocity imply 2 ms."""

from __future__ import annotations

from pathlib import Path

import numpy as np

DT_S = 0.002
LEFT_OUT = 100
"""Number of rows at the beginning that are left out, because nothing has moved yet."""


def recordings(data: Path, every: int = 1) -> dict[str, dict[str, np.ndarray]]:
    """Returns the first two thirds for the fit, and the rest for the test."""
    rows = np.genfromtxt(data / "boucwen_histeretic_system.csv", delimiter=",", names=True)[LEFT_OUT::every]
    cut = 2 * len(rows) // 3

    def columns(part):
        return {
            "time_s": np.arange(len(part)) * DT_S * every,
            "position_cm": part["x"],
            "velocity_cm_per_s": part["v"],
            "voltage_v": part["E"],
            "force_n": part["f"],
        }

    return {"first": columns(rows[:cut]), "last": columns(rows[cut:])}
