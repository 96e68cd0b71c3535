"""Functions for all machines: find their folders, write recordings as text, and run the program."""

from __future__ import annotations

import importlib.util
import json
import shutil
import subprocess
import time
from pathlib import Path
from types import ModuleType

import numpy as np

HERE = Path(__file__).parent
SYSTEMS = (
    "servo",
    "friction_damper",
    "hobby_arm",
    "positioning_axis",
    "magnetorheological_damper",
    "silverbox",
    "cascaded_tanks",
    "knitted_sleeves",
)


def module(folder: Path, name: str) -> ModuleType:
    """Imports a module from a system's folder, under a name that is unique to this system."""
    spec = importlib.util.spec_from_file_location(f"{folder.name}_{name}", folder / f"{name}.py")
    assert spec is not None and spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def write(path: Path, columns: dict[str, np.ndarray]) -> None:
    """Writes a recording as text with all digits."""
    table = np.column_stack([np.asarray(values, dtype=float) for values in columns.values()])
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.17g")


def prepare(system: str, data: Path, out: Path, every: int = 1, problem: str = "problem.toml", **how) -> Path:
    """Writes the recordings, the problem and the simulator of a system into one folder, as input for `stretch diagnose`."""
    folder = HERE / system
    out.mkdir(parents=True, exist_ok=True)
    for name, columns in module(folder, "record").recordings(Path(data), every=every, **how).items():
        write(out / f"{name}.csv", columns)
    for name in (problem, "simulator.py"):
        if (folder / name).is_file():
            shutil.copy(folder / name, out / ("problem.toml" if name == problem else name))
    return out / "problem.toml"


def diagnose(problem: Path, program: str = "stretch", arguments: tuple[str, ...] = ()) -> dict:
    """Returns the program's diagnosis of a problem, and the seconds that it took."""
    answer, page = problem.parent / "diagnosis.json", problem.parent / "report.html"
    begun = time.monotonic()
    command = [program, "diagnose", str(problem), "--quiet", f"--json={answer}", "--report", str(page), *arguments]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode not in (0, 4):
        raise SystemExit(f"{' '.join(command)}\n{done.stderr.strip()}")
    return {**json.loads(answer.read_text()), "seconds": time.monotonic() - begun}
