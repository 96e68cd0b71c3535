"""Recordings of the circuit: FOLDER holds SNLS80mV.csv."""

from __future__ import annotations

from pathlib import Path

import numpy as np

RATE_HZ = 1e7 / 2**14
PARTS = {"multisine": (40540, 42590), "other_multisine": (57920, 58945), "arrow": (30000, 31025)}
"""First and last row of the excerpts: two realisations of the multisine, each beginning with zero input, and noise with growing
amplitude."""


def recordings(data: Path, every: int = 1) -> dict[str, dict[str, np.ndarray]]:
    """Returns the excerpts. A period of the resonance has only nine rows, so `every` must be small."""
    rows = np.genfromtxt(data / "SNLS80mV.csv", delimiter=",", skip_header=1, usecols=(0, 1))
    made = {}
    for name, (first, last) in PARTS.items():
        part = rows[first:last:every]
        time_s = np.arange(len(part)) * every / RATE_HZ
        made[name] = {"time_s": time_s, "input_v": part[:, 0], "output_v": part[:, 1]}
    return made
