"""Effects simulated by other code are named, and the code of the fix reproduces them."""

import inspect

import numpy as np
import pytest
import stretch_gap
from test_diagnosis import FORCE, RATE_HZ, STIFFER, diagnose, noise

DT_S = 1.0 / RATE_HZ


def late(x):
    """Apply a dead time of 55 ms."""
    time_s = DT_S * np.arange(x.size)
    return np.interp(time_s - 0.055, time_s, x)


def slow(x):
    """Apply a first-order lag of 80 ms."""
    y, share = x.copy(), 1.0 - np.exp(-DT_S / 0.08)
    for i in range(1, x.size):
        y[i] = y[i - 1] + share * (0.5 * (x[i - 1] + x[i]) - y[i - 1])
    return y


def loose(x):
    """Apply backlash with a half-width of 1.5."""
    y = x.copy()
    for i in range(1, x.size):
        y[i] = min(max(y[i - 1], x[i] - 1.5), x[i] + 1.5)
    return y


def limited(x):
    """Limit the slew rate to 70 per second."""
    y = x.copy()
    for i in range(1, x.size):
        y[i] = y[i - 1] + min(max(x[i] - y[i - 1], -70.0 * DT_S), 70.0 * DT_S)
    return y


HIDDEN = [
    ("delay", late, "delay_s", 0.055),
    ("lag", slow, "tau_s", 0.08),
    ("backlash", loose, "w", 1.5),
    ("slew_limit", limited, "rate", 70.0),
]


def run(pasted, name, x):
    """Apply the function `name` of pasted code to a column, sample by sample, with the arguments that it takes."""
    step, start = pasted[name], pasted.get(f"{name}_start")
    wanted = list(inspect.signature(step).parameters)
    state = start(*[x[0]] * len(inspect.signature(start).parameters)) if start else None
    given = [{"s": state, "x": x[i], "v": x, "n": x.size, "i": i, "t": i * DT_S} for i in range(x.size)]
    return np.array([step(**{key: row[key] for key in wanted}) for row in given])


@pytest.mark.parametrize("kind, hide, parameter, value", HIDDEN, ids=[one[0] for one in HIDDEN])
def test_the_code_of_an_effect_is_the_effect(kind, hide, parameter, value):
    hidden = hide(STIFFER)
    found = diagnose(lambda params, effects: params["compliance"] * FORCE, hidden + noise(FORCE.size), effects=None,
                     wrap=[f"output.{kind}"])  # fmt: skip
    assert found.named == [f"output.{kind}"]
    assert found.how_far["with_effects"]["length_mm"] < 1.2  # noise is 1
    assert found.effects[f"output.{kind}"][parameter] == pytest.approx(value, rel=0.1)
    pasted = {}
    exec(found.fix().code, pasted)  # a user would paste this code
    fixed = run(pasted, f"output_{kind}", pasted["parameters"]["compliance"] * FORCE)
    assert np.std(fixed - hidden) < 0.4 * np.std(noise(FORCE.size))
    np.testing.assert_allclose(found.fix()(), found.curves()["with_effects"], rtol=1e-9, atol=1e-9)


def test_a_diagnosis_from_text_has_equations_in_place_of_functions():
    found = diagnose(lambda params, effects: params["compliance"] * FORCE, late(STIFFER) + noise(FORCE.size), effects=None,
                     wrap=["output.delay"])  # fmt: skip
    code = stretch_gap.Diagnosis.from_json(found.to_json()).fix().code
    pasted = {}
    exec(code, pasted)
    assert pasted["output_delay"] == found.effects["output.delay"] and "y(t) = x(t - delay_s)" in code


def test_friction_is_found_by_the_speed_at_which_it_rubs():
    speed = np.gradient(FORCE, DT_S)
    pull = 2.1 * FORCE + 1.5 * np.tanh(speed / 0.3)
    found = stretch_gap.diagnose(
        lambda params, effects: params["stiffness"] * FORCE,
        {"travel_mm": FORCE, "pull_N": pull + noise(FORCE.size), "speed_mmps": speed},
        output="pull_N",
        inputs=["travel_mm"],
        velocity="speed_mmps",
        rate_hz=RATE_HZ,
        parameters={"stiffness": stretch_gap.Parameter(2.0, relative=0.1, unit="N/mm")},
        wrap=["output.friction"],
    )
    assert found.named == ["output.coulomb_friction"]
    assert found.effects["output.coulomb_friction"]["f"] == pytest.approx(1.5, rel=0.05)
    assert "def output_coulomb_friction(x, v):" in found.fix().code
    with pytest.raises(
        stretch_gap.StretchError, match=r"output\.coulomb_friction cannot be applied .* depends on v .* put its function from"
    ):
        found.fix()()
