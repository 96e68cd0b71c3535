"""Code that is pasted computes what the diagnosis meant: each effect is hidden by its code and found with its values."""

import numpy as np
import pytest
import stretch
from stretch import effects
from test_diagnosis import FORCE, RATE_HZ, STIFFER, diagnose, noise

VALUES = {
    "delay": {"delay_s": 0.055},
    "skew": {"skew_s": 0.043, "rate": 0.0},
    "lag": {"tau_s": 0.08, "second": 0.1},
    "second_order_lag": {"m_s": 0.06, "damping": 0.3},
    "relaxation": {"c": 0.2, "tau_s": 0.8, "spread": 1.6},
    "slew_limit": {"rate": 70.0},
    "backlash": {"w": 1.5, "softness": 0.2},
    "hysteresis": {"h": 0.2, "s": 20.0, "spread": 0.5},
    "bouc_wen": {"c": 3.0, "s": 8.0},
    "saturation": {"low": -45.0, "high": 40.0, "knee": 0.5},
    "dead_zone": {"w": 3.0, "softness": 0.3},
}


@pytest.mark.parametrize("kind", VALUES)
def test_the_code_of_an_effect_is_the_effect(kind):
    hidden = effects.CODE[kind](STIFFER, 1.0 / RATE_HZ, **VALUES[kind])
    found = diagnose(lambda params, effects: params["compliance"] * FORCE, hidden + noise(FORCE.size), effects=None,
                     wrap=[f"output.{kind}"])  # fmt: skip
    assert found.named == [f"output.{kind}"]
    assert found.how_far["with_effects"]["length_mm"] < 1.2  # noise is 1
    first = next(iter(VALUES[kind]))
    assert found.effects[f"output.{kind}"][first] == pytest.approx(VALUES[kind][first], rel=0.1)
    pasted = {}
    exec(found.fix().code, pasted)  # what a user would paste
    tuned = pasted["parameters"]["compliance"] * FORCE
    fixed = pasted[kind](tuned, 1.0 / RATE_HZ, **pasted[f"output_{kind}"])
    left = np.std(fixed - hidden)
    assert left < 0.4 * np.std(noise(FORCE.size))


def test_friction_is_found_by_the_speed_at_which_it_rubs():
    speed = np.gradient(FORCE, 1.0 / RATE_HZ)
    pull = effects.coulomb_friction(2.1 * FORCE, speed, f=1.5, width=0.3)
    found = stretch.diagnose(
        lambda params, effects: params["stiffness"] * FORCE,
        {"travel_mm": FORCE, "pull_N": pull + noise(FORCE.size), "speed_mmps": speed},
        output="pull_N",
        inputs=["travel_mm"],
        velocity="speed_mmps",
        rate_hz=RATE_HZ,
        parameters={"stiffness": stretch.Parameter(2.0, relative=0.1, unit="N/mm")},
        wrap=["output.friction"],
    )
    assert found.named == ["output.coulomb_friction"]
    assert found.effects["output.coulomb_friction"]["f"] == pytest.approx(1.5, rel=0.05)
    assert "coulomb_friction(x, v, **output_coulomb_friction)" in found.fix().code
