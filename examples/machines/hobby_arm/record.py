"""Recordings of one joint of the arm: FOLDER holds one folder per motion, each with control.csv and state_motor.csv.

FOLDER may also hold NAME_commanded.csv and NAME_measured.csv, with one column per joint.
"""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np

JOINTS = ("rot", "pitch", "elbow", "wpitch", "wroll", "jaw")
FITTED = ("step_response", "multisine", "friction_gravity")
RATE_HZ = 50.0


def _authors(folder: Path, joint: int):
    """Returns times, s, and positions, rad, of the commands and of the measurements, from the authors' files."""
    for name in ("control", "state_motor"):
        with open(folder / f"{name}.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        yield np.array([float(row["timestamp"]) for row in rows]) * 1e-6
        yield np.array([json.loads(row["positions"])[joint] for row in rows])


def _columns(data: Path, motion: str, joint: str):
    for name in ("commanded", "measured"):
        table = np.genfromtxt(data / f"{motion}_{name}.csv", delimiter=",", names=True)
        yield table["time_s"]
        yield table[f"{joint}_rad"]


def motion(data: Path, name: str, joint: str, every: int = 1) -> dict[str, np.ndarray]:
    """Returns the commanded and the measured position of a joint on one time grid; a command holds until the next one."""
    is_authors = (data / name).is_dir()
    read = _authors(data / name, JOINTS.index(joint)) if is_authors else _columns(data, name, joint)
    sent_s, commanded, seen_s, measured = read
    begin, end = max(sent_s[0], seen_s[0]), min(sent_s[-1], seen_s[-1])
    time_s = np.arange(begin, end, every / RATE_HZ)
    held = np.maximum(np.searchsorted(sent_s, time_s, side="right") - 1, 0)
    return {
        "time_s": np.arange(len(time_s)) * every / RATE_HZ,
        "commanded_rad": commanded[held],
        "measured_rad": np.interp(time_s, seen_s, measured),
    }


def recordings(data: Path, every: int = 1, joint: str = "elbow") -> dict[str, dict[str, np.ndarray]]:
    """Returns three motions of one joint."""
    return {name: motion(data, name, joint, every) for name in FITTED}
