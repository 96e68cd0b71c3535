"""The robots of `book/src/results/robots.md`, where their recordings are: STRETCH_DATA names the folder."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path
from types import ModuleType

import pytest

EXAMPLES = Path(os.environ.get("STRETCH_EXAMPLES", Path(__file__).parents[1] / "examples")) / "robots"
DATA = Path(os.environ.get("STRETCH_DATA", Path(__file__).parents[3] / "shared" / "data"))


def example(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def folder(name: str) -> Path:
    found = DATA / name
    if not found.is_dir():
        pytest.skip(f"SKIPPED: no recordings of {name} in {DATA}; STRETCH_DATA names the folder that holds them")
    return found


@pytest.mark.parametrize("every", [5, 10])
def test_the_axis_lacks_the_coulomb_friction_that_was_published(every: int) -> None:
    emps = example("emps")
    diagnosis = emps.diagnosed("inverse", folder("emps"), every)
    assert diagnosis.named == ["output.coulomb_friction"]
    found = diagnosis.effects["output.coulomb_friction"]
    # published: 20.39 N, and an offset of -3.16 N, which is lopsided friction
    assert found["f"] == pytest.approx(emps.PUBLISHED["coulomb"], rel=0.02)
    assert found["f"] * found["lopsided"] == pytest.approx(emps.PUBLISHED["offset"], rel=0.05)
    assert diagnosis.parameters["mass"] == pytest.approx(emps.PUBLISHED["mass"], rel=0.02)


@pytest.mark.parametrize("every", [1, 2])
def test_a_play_in_the_elbow_foretells_a_motion_that_was_not_fitted(every: int) -> None:
    diagnosis = example("so101").diagnosed(folder("so101"), "elbow", every)
    assert diagnosis.named == ["input.backlash"]
    assert diagnosis.how_far["closed"] > 0.9
