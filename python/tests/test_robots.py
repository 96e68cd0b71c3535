"""Tests of two systems of `examples/machines`. STRETCH_DATA names the folder of their recordings."""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path
from types import ModuleType

import pytest
import stretch_gap

MACHINES = Path(os.environ.get("STRETCH_MACHINES", Path(__file__).parents[2] / "examples" / "machines"))
DATA = Path(os.environ.get("STRETCH_DATA", Path(__file__).parents[3] / "shared" / "data"))
COULOMB_N, OFFSET_N, MASS_KG = 20.39, -3.16, 95.11
"""Published values of the axis: Coulomb friction, offset and mass."""


def machines() -> ModuleType:
    spec = importlib.util.spec_from_file_location("machines", MACHINES / "machines.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["machines"] = module
    spec.loader.exec_module(module)
    return module


def diagnosed(system: str, data: str, folder: Path, **how: object) -> stretch_gap.Diagnosis:
    recordings = DATA / data
    if not recordings.is_dir():
        pytest.skip(f"SKIPPED: no recordings of {data} in {DATA}; STRETCH_DATA names the folder that holds them")
    return stretch_gap.diagnose(None, machines().prepare(system, recordings, folder, **how))


@pytest.mark.parametrize("every", [1, 2])
def test_the_axis_lacks_the_coulomb_friction_that_was_published(every: int, tmp_path: Path) -> None:
    diagnosis = diagnosed("positioning_axis", "emps", tmp_path, every=every)
    assert diagnosis.named == ["output.coulomb_friction"]
    found = diagnosis.effects["output.coulomb_friction"]
    # the published offset is equivalent to a friction that differs between the directions
    assert found["f"] == pytest.approx(COULOMB_N, rel=0.02)
    assert found["f"] * found["lopsided"] == pytest.approx(OFFSET_N, rel=0.05)
    assert diagnosis.parameters["mass"] == pytest.approx(MASS_KG, rel=0.02)


@pytest.mark.parametrize("every", [1, 2])
def test_a_play_in_the_elbow_predicts_a_motion_that_was_not_fitted(every: int, tmp_path: Path) -> None:
    diagnosis = diagnosed("hobby_arm", "so101", tmp_path, every=every, joint="elbow")
    assert diagnosis.named == ["input.backlash"]
    assert diagnosis.how_far["closed"] > 0.9
