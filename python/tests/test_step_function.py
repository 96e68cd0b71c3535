"""Tests the example `step_function.py`, in which an environment with `step` is the simulator."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import pytest

EXAMPLES = Path(os.environ.get("STRETCH_EXAMPLES", Path(__file__).parents[1] / "examples"))


def test_an_environment_with_a_step_is_a_simulator():
    spec = importlib.util.spec_from_file_location("step_function", EXAMPLES / "step_function.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    found = module.main()
    assert found.named == ["dry"]
    assert found.effects["dry"]["dry"] == pytest.approx(6.0, rel=0.03)
    assert found.parameters["mass"] == pytest.approx(10.4, rel=0.01)
