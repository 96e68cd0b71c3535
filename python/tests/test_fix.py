"""Tests that a fix can be called in place of the user's simulator."""

import inspect

import numpy as np
import pytest
import stretch_gap
from test_diagnosis import BENT, FORCE, RATE_HZ, Spring, diagnose, noise, problem_file  # noqa: F401
from test_effects import late, loose

TAU = stretch_gap.Parameter(0.1, relative=0.3, unit="s")
COLUMNS = {
    "output": "angle_deg",
    "inputs": "cmd_deg",
    "rate_hz": RATE_HZ,
    "wrap": ["input.delay", "input.lag", "output.backlash", "output.lag"],
}


def slow(x, start, tau):
    y, share = np.full(x.size, start), 1.0 - np.exp(-1.0 / RATE_HZ / tau)
    for i in range(1, x.size):
        y[i] = y[i - 1] + share * (x[i - 1] - y[i - 1])
    return y


def servo(params, effects, inputs, first):
    """Simulate a servo: its angle follows the command with a first-order lag."""
    return slow(inputs["cmd_deg"], first["angle_deg"], params["tau"])


def recording(command, seed):
    """Return a recording of a servo with a delay and backlash."""
    delayed = late(command)
    return {"cmd_deg": command, "angle_deg": loose(slow(delayed, delayed[0], 0.12)) + noise(command.size, seed)}


RECORDINGS = [recording(FORCE, 0), recording(0.8 * FORCE[::-1].copy(), 1)]


def begun(one):
    return {name: values[0] for name, values in one.items()}


@pytest.fixture(scope="module")
def found():
    return stretch_gap.diagnose(servo, RECORDINGS, parameters={"tau": TAU}, **COLUMNS)


def test_a_call_computes_the_fixed_curves(found):
    fix = found.fix()
    assert sorted(found.named) == ["input.delay", "output.backlash"]
    assert inspect.signature(fix) == inspect.signature(servo) and not hasattr(fix, "simulate")
    curves = found.curves()
    called = np.concatenate([fix({}, {}, one, first=begun(one)) for one in RECORDINGS])
    np.testing.assert_allclose(called, curves["with_effects"], rtol=1e-9, atol=1e-9)
    one = RECORDINGS[0]
    slower = fix({"tau": 0.3}, inputs=one, first=begun(one))
    hidden = loose(slow(late(one["cmd_deg"]), one["cmd_deg"][0], 0.3))
    assert np.std(slower - hidden) < 0.02 < 0.3 < np.std(slower - called[: slower.size])
    # the user's own code calls the fix with few samples, and with other columns than the recorded ones
    assert fix(inputs={"cmd_deg": [0.0, 1.0]}, first={"angle_deg": 0.0}).shape == (2,)


def test_no_gap_is_left(found):
    for parameters, verdicts in [({}, {"no_gap"}), ({"tau": TAU}, {"no_gap", "parameters"})]:
        again = stretch_gap.diagnose(found.fix(), RECORDINGS, parameters=parameters, **COLUMNS)
        assert again.named == [] and again.verdict in verdicts, again.sentence


def test_new_recordings_of_any_length_are_predicted_as_a_call_computes_them(found):
    fix = found.fix()
    new = [recording(0.9 * FORCE[500:2000].copy(), 5), recording(FORCE[1000:3500].copy(), 6)]
    predicted = fix.predict(new, rate_hz=RATE_HZ)
    curves = predicted.curves()
    for name, simulator in [("with_effects", fix), ("measured", lambda *_, inputs, first: inputs["angle_deg"])]:
        called = np.concatenate([simulator({}, {}, inputs=one, first=begun(one)) for one in new])
        np.testing.assert_allclose(curves[name], called, rtol=1e-9, atol=1e-9)
    starts = (0, 1500, 4000)
    for one, start, end in zip(predicted.outputs, starts[:-1], starts[1:], strict=True):
        errors = [np.sqrt(np.mean((curves["measured"] - curves[name])[start:end] ** 2)) for name in ("with_effects", "without")]
        np.testing.assert_allclose([one["rmse"], one["rmse_without"]], errors)
        np.testing.assert_allclose([one["times_noise"], one["ratio"]], errors[0] / np.array([one["noise"], errors[1]]))
    assert [one["trial"] for one in predicted.outputs] == ["recording 1", "recording 2"]
    assert predicted.ratio == pytest.approx(np.prod([one["ratio"] for one in predicted.outputs]) ** 0.5) and predicted.ratio < 0.2
    assert predicted.times_noise == max(one["times_noise"] for one in predicted.outputs) < 1.3
    html = predicted._repr_html_()
    assert html.count("<tr>") == 3 and predicted.sentence in html and "recording 2" in html


def test_a_simulator_that_takes_no_recording_cannot_predict_another_one():
    found = diagnose(Spring(), BENT)
    for run in (found.fix().predict, found.fix().diagnose):
        with pytest.raises(
            stretch_gap.StretchError, match="the simulator does not take the argument inputs, so it can only repeat"
        ):
            run({"force_N": FORCE, "length_mm": FORCE}, rate_hz=RATE_HZ)


def test_a_wrong_call_says_what_to_do(found):
    fix = found.fix()
    for given, words in [
        ({"params": {"tua": 0.1}}, r"there is no parameter tua \(did you mean tau\?\); the parameters are tau"),
        ({"effects": {"bend": 0.1}}, "there is no effect bend; there are none"),
        ({"first": {"angle_deg": 0.0}}, r"input\.delay alters cmd_deg, but there are no inputs; give the argument inputs"),
        ({"inputs": {"foo": [0.0]}, "first": {"angle_deg": 0.0}}, "inputs: there is no column cmd_deg; the columns are foo"),
    ]:
        with pytest.raises(stretch_gap.StretchError, match=words):
            fix(**given)


def test_a_diagnosis_from_text_cannot_be_called(found):
    fix = stretch_gap.Diagnosis.from_json(found.to_json()).fix()
    with pytest.raises(stretch_gap.StretchError, match="cannot be run, because the diagnosis was read from text"):
        fix({}, {}, inputs=RECORDINGS[0], first=begun(RECORDINGS[0]))
    with pytest.raises(stretch_gap.StretchError, match="this fix cannot be run"):
        stretch_gap.diagnose(fix, RECORDINGS, **COLUMNS)


def test_a_fix_of_many_models_has_the_form_of_the_simulator():
    effects = {"bend": (-0.05, 0.05), "twist": (-0.05, 0.05)}

    class Twisted(Spring):
        batch = 7

        def simulate(self, params, effects):
            return super().simulate(params, effects) + effects["twist"][:, None] * FORCE**3

    length = late(BENT - noise(FORCE.size)) + noise(FORCE.size)
    found = diagnose(Twisted(), length, effects=effects)
    assert sorted(found.named) == ["bend", "output.delay"]
    fix = found.fix()
    curve = found.curves()["with_effects"]
    for given in [(), (None, {"bend": 0.0}), ([list(found.parameters.values())], [[0.0, 0.0]])]:
        np.testing.assert_allclose(fix.simulate(*given), [curve], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(fix.simulate([[2.0], [2.0]])[0], fix({"compliance": 2.0})[0])
    assert fix.batch == 7 and fix.simulate(np.array([[2.0], [2.2]])).shape == (2, FORCE.size)
    for declared in (None, effects):
        again = diagnose(fix, length, effects=declared, parameters=None)
        assert again.verdict == "no_gap", again.sentence


def test_recordings_end_to_end_and_several_outputs():
    class Both:
        def begin(self, session):
            self.names = session["parameters"]

        def simulate(self, params, effects, inputs, trials):
            assert self.names == ["gain", "tau"] and inputs["cmd_deg"].shape == (len(params), trials[-1].samples.stop)
            angle = np.empty_like(inputs["cmd_deg"])
            for row, tau, command in zip(angle, params["tau"], inputs["cmd_deg"]):
                for trial in trials:
                    row[trial.samples] = slow(command[trial.samples], trial.first["angle_deg"], tau)
            return {"angle_deg": angle, "seen_V": params["gain"][:, None] * inputs["angle_deg"]}

    seen = [{**one, "seen_V": 0.5 * late(one["angle_deg"]) + noise(FORCE.size, 7)} for one in RECORDINGS]
    question = {
        "stages": [stretch_gap.Stage("angle_deg", "cmd_deg", name="servo"), stretch_gap.Stage("seen_V", "angle_deg", name="eye")],
        "rate_hz": RATE_HZ,
        "wrap": ["servo.input.delay", "servo.output.backlash", "eye.output.skew", "eye.output.lag"],
    }
    parameters = {
        "gain": stretch_gap.Parameter(0.5, relative=0.1, stages=["eye"]),
        "tau": stretch_gap.Parameter(0.1, relative=0.3, stages=["servo"]),
    }
    found = stretch_gap.diagnose(Both(), seen, parameters=parameters, **question)
    assert sorted(found.named) == ["eye.output.skew", "servo.input.delay", "servo.output.backlash"]
    one = {name: np.concatenate([rows[name] for rows in seen]) for name in ("cmd_deg", "angle_deg")}
    trials = found.fix()._again.asked.spans
    assert found.fix()(inputs=one, trials=trials)["angle_deg"].shape == (1, one["cmd_deg"].size)
    with pytest.raises(stretch_gap.StretchError, match=r"fix: missing a required argument: 'trials'; .* takes inputs, trials"):
        found.fix()(inputs=one)
    again = stretch_gap.diagnose(found.fix(), seen, **question)
    assert again.verdict == "no_gap", again.sentence
    for output in ("angle_deg", "seen_V"):
        fixed, curve = (one.curves(output)[name] for one, name in [(again, "as_shipped"), (found, "with_effects")])
        np.testing.assert_allclose(fixed, curve, rtol=1e-9, atol=1e-9)
    moved = recording(0.9 * FORCE[:2000], 8)
    predicted = found.fix().predict({**moved, "seen_V": 0.5 * late(moved["angle_deg"]) + noise(2000, 9)}, rate_hz=RATE_HZ)
    assert [(one["stage"], one["column"]) for one in predicted.outputs] == [("servo", "angle_deg"), ("eye", "seen_V")]
    assert predicted.times_noise < 1.5 and predicted.curves("seen_V")["with_effects"].shape == (2000,)


def test_an_effect_at_a_column_of_several_stages_is_not_applied():
    def both(params, effects, inputs, stage):
        return (1.0, 2.0)[stage] * inputs["cmd_deg"]

    data = {"cmd_deg": FORCE, "a_deg": late(FORCE) + noise(FORCE.size), "b_deg": 2.0 * FORCE + noise(FORCE.size, 1)}
    stages = [stretch_gap.Stage(f"{name}_deg", "cmd_deg", name=name) for name in "ab"]
    found = stretch_gap.diagnose(both, data, stages=stages, rate_hz=RATE_HZ, wrap=["a.input.delay", "a.output.backlash"])
    assert found.named == ["a.input.delay"]
    with pytest.raises(
        stretch_gap.StretchError, match=r"a\.input\.delay .* depends on the stage, because cmd_deg drives a and b;"
    ):
        found.fix()({}, {}, data, stage=0)


def test_a_fix_of_a_fix_has_the_effects_of_both():
    delayed = late(FORCE)
    tight = {"cmd_deg": FORCE, "angle_deg": slow(delayed, delayed[0], 0.12) + noise(FORCE.size)}
    first = stretch_gap.diagnose(servo, tight, parameters={"tau": TAU}, **COLUMNS)
    again = first.fix().diagnose(RECORDINGS[1], rate_hz=RATE_HZ)
    assert (first.named, again.named) == (["input.delay"], ["output.backlash"])
    fix = again.fix()
    fixed = fix(inputs=RECORDINGS[1], first=begun(RECORDINGS[1]))
    np.testing.assert_allclose(fixed, again.curves()["with_effects"], rtol=1e-9, atol=1e-9)
    assert fix.effects == {**first.effects, **again.effects} and fix.parameters == again.parameters
    pasted = {}
    exec(fix.code, pasted)
    assert pasted["parameters"] == again.parameters and {"input_delay", "output_backlash"} <= set(pasted)
    third = fix.diagnose()
    assert third.named == [] and third.fix().effects == fix.effects


def test_a_fix_of_a_fix_keeps_effects_of_the_simulator():
    def bent(params, effects):
        return params["compliance"] * FORCE + effects["bend"] * FORCE**2

    length = late(BENT - noise(FORCE.size)) + noise(FORCE.size)
    first = diagnose(bent, length, wrap=None)
    assert first.named[:1] == ["bend"]
    fix = diagnose(bent, length).fix().diagnose().fix()
    assert sorted(fix.effects) == ["bend", "output.delay"] and "bend = {" in fix.code
    assert np.std(fix() - length) < 1.2 * np.std(noise(FORCE.size))


def test_a_column_that_the_simulator_misses_is_named():
    def spring(params, effects, inputs):
        return params["compliance"] * inputs["force_N"]

    found = diagnose(spring, late(2.1 * FORCE) + noise(FORCE.size), effects=None, wrap=["output.delay"])
    assert found.named == ["output.delay"]
    with pytest.raises(stretch_gap.StretchError, match=r"inputs: there is no column force_N \(did you mean force\?\)"):
        found.fix()(inputs={"force": FORCE})


@pytest.mark.parametrize("compliance, verdict", [((2.0, 0.2), "parameters"), ((2.1, 0.2), "no_gap"), (2.1, "no_gap")])
def test_a_fix_without_an_effect_is_predicted_in_a_sentence(compliance, verdict):
    def spring(params, effects, inputs):
        return params["compliance"] * inputs["force_N"]

    found = diagnose(spring, 2.1 * FORCE + noise(FORCE.size), effects=None, parameters={"compliance": compliance})
    assert found.verdict == verdict, found.sentence
    predicted = found.fix().predict({"force_N": FORCE, "length_mm": 2.1 * FORCE + noise(FORCE.size, 1)}, rate_hz=RATE_HZ)
    sentence = "The fix holds for these recordings. The fix has no effect, so only the re-tuned parameters were tested"
    assert predicted.sentence.startswith(sentence)
    assert predicted.notes == [] and predicted.ratio == 1.0 and predicted.times_noise < 1.2


def test_a_fix_that_cannot_be_run_says_the_reason():
    walk = 0.1 * np.cumsum(np.random.default_rng(0).normal(size=FORCE.size))
    found = diagnose(Spring(), 2.1 * FORCE + walk, wrap=["output.backlash"])
    assert found.verdict == "unknown", found.sentence
    fix = found.fix()
    for run in (fix, fix.diagnose, lambda: fix.predict({"force_N": FORCE, "length_mm": FORCE}, rate_hz=RATE_HZ)):
        with pytest.raises(
            stretch_gap.StretchError, match="cannot be run, because the verdict is 'unknown': the diagnosis names"
        ):
            run()


def test_the_simulator_of_a_problem_file_cannot_be_called(problem_file):  # noqa: F811
    fix = stretch_gap.diagnose(None, problem_file).fix()
    with pytest.raises(stretch_gap.StretchError, match=r"simulator of the problem\.toml runs in another process"):
        fix()
    fix = stretch_gap.diagnose(Spring(), problem_file).fix()
    np.testing.assert_allclose(fix(), [fix.parameters["compliance"] * FORCE + fix.effects["bend"]["bend"] * FORCE**2])
