import importlib.util
import json
import pickle
import re
import sys

import numpy as np
import pytest
import stretch_gap

RATE_HZ = 100.0


def load(seconds=60.0):
    """Return the force on a spring, N."""
    time_s = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    return 20.0 * np.sin(1.3 * time_s) + 10.0 * np.sin(3.1 * time_s + 0.4)


def noise(samples, seed=0):
    return 0.02 * np.random.default_rng(seed).normal(size=samples)


FORCE = load()
STIFFER = 2.1 * FORCE
"""Length of the spring. Its compliance of 2.1 is larger than that of the simulator, 2.0."""


class Spring:
    """A linear spring, with a nonlinear term as an effect that is off by default."""

    def __init__(self):
        self.asked = []

    def simulate(self, params, effects):
        self.asked.append(params.shape)
        return params[:, :1] * FORCE + effects["bend"][:, None] * FORCE**2


def diagnose(simulator, length, **more):
    question = {
        "output": "length_mm",
        "inputs": ["force_N"],
        "rate_hz": RATE_HZ,
        "parameters": {"compliance": stretch_gap.Parameter(2.0, relative=0.1, unit="mm/N")},
        "effects": {"bend": (-0.05, 0.05)},
        "wrap": ["output.backlash", "output.delay"],
    }
    return stretch_gap.diagnose(simulator, {"force_N": FORCE, "length_mm": length}, **{**question, **more})


BENT = STIFFER + 0.02 * FORCE**2 + noise(FORCE.size)


@pytest.fixture(scope="module")
def bent():
    return diagnose(Spring(), BENT)


def test_a_column_can_be_named_by_the_last_part_of_its_path():
    question = {
        "output": "length_mm",
        "inputs": "force_N",
        "parameters": {"compliance": stretch_gap.Parameter(2.0, relative=0.1)},
        "noise": {"length_mm": 0.02},
        "wrap": ["output.backlash"],
    }

    def spring(params, effects, inputs):
        return params["compliance"] * inputs["force_N"]

    log = {"time_s": np.arange(FORCE.size) / RATE_HZ, "log.force_N": FORCE, "log/length_mm": STIFFER + noise(FORCE.size)}
    found = stretch_gap.diagnose(spring, stretch_gap.Trial(log), **question)
    assert found.verdict == "parameters"
    later = {"time_s": log["time_s"], "new.force_N": -FORCE, "new.length_mm": -log["log/length_mm"]}
    assert found.fix().predict(later).times_noise < 1.1
    with pytest.raises(stretch_gap.StretchError, match=r"there is no column length_mm \(did you mean"):
        stretch_gap.diagnose(spring, {**log, "other.length_mm": FORCE}, **question)
    with pytest.raises(stretch_gap.StretchError, match="noise: there is no column width_mm"):
        stretch_gap.diagnose(spring, log, **{**question, "noise": {"width_mm": 0.02}})


def test_wrappers_are_listed_with_their_sides():
    listed = stretch_gap.wrappers()
    kinds = dict(zip(listed["kind"], listed["wrap"]))
    assert kinds["backlash"] == "input, output" and set(kinds.values()) > {"input", "output"}
    assert not hasattr(listed, "columns") or "wrap" in repr(listed).splitlines()[0]
    assert all(listed["words"]) and all(listed["equation"])


def test_curves_are_plotted(bent):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("agg")
    top, bottom = bent.plot()
    assert [line.get_label() for line in top.lines] == ["measured", "as shipped", "retuned", "with effects"]
    x, y = top.lines[0].get_data()
    np.testing.assert_allclose(x[[0, 100]], [0.0, 1.0])
    np.testing.assert_allclose(y, BENT)
    assert len(bottom.lines) == 3 and top.get_ylabel() == "length_mm"
    with pytest.raises(stretch_gap.StretchError, match="there is no output"):
        bent.plot("speed")


def test_a_recording_is_named_by_its_path(bent, tmp_path):
    path = tmp_path / "day1.csv"
    columns = np.column_stack([np.arange(FORCE.size) / RATE_HZ, FORCE, BENT])
    np.savetxt(path, columns, delimiter=",", header="time_s,force_N,length_mm", comments="", fmt="%.17g")
    question = {"output": "length_mm", "effects": {"bend": (-0.05, 0.05)}, "wrap": ["output.backlash", "output.delay"]}
    parameters = {"compliance": stretch_gap.Parameter(2.0, relative=0.1, unit="mm/N")}
    for data in [str(path), path, [path]]:
        found = stretch_gap.diagnose(Spring(), data, inputs=["force_N"], parameters=parameters, **question)
        assert found.named == bent.named
        assert found.effects["bend"]["bend"] == pytest.approx(bent.effects["bend"]["bend"], rel=1e-6)


def test_a_missing_number_in_a_file_is_warned_of(tmp_path):
    time_s = np.arange(FORCE.size) / RATE_HZ
    broken = np.where(np.arange(BENT.size) == 1000, np.nan, BENT)
    text, packed = tmp_path / "day1.csv", tmp_path / "day1.npz"
    columns = np.column_stack([time_s, FORCE, broken])
    np.savetxt(text, columns, delimiter=",", header="time_s,force_N,length_mm", comments="")
    np.savez(packed, time_s=time_s, force_N=FORCE, length_mm=broken)
    for data in (text, packed, stretch_gap.read(text)):
        with pytest.warns(stretch_gap.DoubtWarning, match=r"day1\.\w+: .*left out.*; such samples count as lost"):
            stretch_gap.diagnose(Spring(), data, output="length_mm", inputs="force_N", effects={"bend": (-0.05, 0.05)},
                                 parameters={"compliance": (2.0, 0.2)}, wrap=None)  # fmt: skip


def test_one_input_may_be_given_by_its_name(bent):
    found = diagnose(Spring(), BENT, inputs="force_N")
    assert found.sentence == bent.sentence
    assert stretch_gap.Stage("length_mm", "force_N") == stretch_gap.Stage("length_mm", ("force_N",))
    with pytest.raises(stretch_gap.StretchError, match=r"columns of a Trial are a str; .*Trial\(stretch_gap.read"):
        stretch_gap.diagnose(Spring(), stretch_gap.Trial("day1.csv"), output="length_mm")


def test_a_missing_sample_is_bridged_with_a_warning():
    broken = np.where(np.arange(BENT.size) == 1000, np.nan, BENT)
    with pytest.warns(stretch_gap.DoubtWarning, match="1 of 6000 samples counts as lost: sample 1000 of length_mm is nan"):
        found = diagnose(Spring(), broken)
    assert found.named == ["bend"] and any("1 lost sample is bridged" in note for note in found.notes)


def test_an_effect_of_the_users_own_is_named_with_its_value(bent):
    assert bent.verdict == "effect" and bent.named == ["bend"]
    assert bent.answer["kind"] == "missing" and bent.answer["effects"][0]["name"] == "bend"
    assert bent.rivals == [] and bent.not_examined == []
    assert repr(bent).splitlines()[0].startswith("The simulator lacks bend") and "bend: bend = 0.0" in repr(bent)
    assert bent.probabilities["bend"] > 0.9
    assert bent.effects["bend"]["bend"] == pytest.approx(0.02, rel=0.02)
    assert bent.parameters["compliance"] == pytest.approx(2.1, rel=0.01)
    assert bent.where == {"length_mm": 1.0}
    assert bent.how_far["closed"] > 0.95
    assert bent.how_far["with_effects"]["length_mm"] < 1.3 < bent.how_far["retuned"]["length_mm"]
    assert "bend" in bent.sentence and bent.model_runs > 0


def test_what_was_found_is_shown_as_text_table_page_and_code(bent, tmp_path):
    again = stretch_gap.Diagnosis.from_json(bent.to_json())
    assert again.named == bent.named and again.probabilities == bent.probabilities
    assert json.loads(bent.to_json())["schema"] == 2
    assert list(bent.to_frame()["effects"])[0] == "bend"
    page = bent.report(tmp_path / "d.html")
    assert page.startswith("<!DOCTYPE html>") and page.count("<svg") > 3
    assert (tmp_path / "d.html").read_text(encoding="utf-8") == page
    assert bent._repr_html_().startswith("<iframe srcdoc=") and "scrollHeight" in bent._repr_html_()
    assert bent._repr_html_().count(bent.sentence[:30]) == bent.report().count(bent.sentence[:30])
    assert "<iframe" not in again._repr_html_()
    found = {}
    exec(bent.fix().code, found)  # what a user would paste
    assert found["parameters"] == bent.parameters and found["bend"] == bent.effects["bend"]


def test_another_schema_is_refused(bent):
    older = json.dumps({**json.loads(bent.to_json()), "schema": 1})
    with pytest.raises(stretch_gap.StretchError, match="diagnose again"):
        stretch_gap.Diagnosis.from_json(older)
    assert len(bent.note_codes) == len(bent.notes)


def test_values_have_intervals(bent):
    low, high = bent.parameter_intervals["compliance"]
    assert low < bent.parameters["compliance"] < high and abs(2.1 - bent.parameters["compliance"]) < high - low < 0.01
    (low, high), value = bent.effect_intervals["bend"]["bend"], bent.effects["bend"]["bend"]
    assert low < value < high and abs(0.02 - value) < high - low < 0.001


def test_a_pickle_has_everything_but_the_simulator(bent):
    copy, fix = pickle.loads(pickle.dumps((bent, bent.fix())))
    assert repr(copy) == repr(bent) and copy.report() == bent.report()
    np.testing.assert_array_equal(copy.curves()["measured"], bent.curves()["measured"])
    assert fix.effects == bent.effects and "code" not in repr(fix)
    for one in (fix, copy.fix()):
        with pytest.raises(stretch_gap.StretchError, match="a copy or a pickle does not contain the simulator"):
            one.predict({"force_N": FORCE, "length_mm": BENT}, rate_hz=RATE_HZ)


def test_curves_are_those_of_the_simulator(bent):
    curves = bent.curves("length_mm")
    np.testing.assert_array_equal(curves["measured"], BENT)
    np.testing.assert_array_equal(curves["as_shipped"], 2.0 * FORCE)
    fitted = bent.parameters["compliance"] * FORCE + bent.effects["bend"]["bend"] * FORCE**2
    # both compute the same expression
    np.testing.assert_allclose(curves["with_effects"], fitted, rtol=1e-9, atol=1e-9)


def test_a_function_of_one_model_says_the_same_as_batches(bent):
    def spring(params, effects):
        return params["compliance"] * FORCE + effects["bend"] * FORCE**2

    one = diagnose(spring, BENT)
    single, batches = json.loads(one.to_json()), json.loads(bent.to_json())
    for name in ("runtime_s", "notes"):
        del single[name], batches[name]
    assert single == batches


def test_batches_are_asked_for_as_batches():
    spring = Spring()
    diagnose(spring, BENT)
    assert all(columns == 1 for _, columns in spring.asked)
    spring.batch = 1
    spring.asked.clear()
    diagnose(spring, BENT)
    assert {rows for rows, _ in spring.asked} == {1}


def test_a_wrapper_is_named_around_a_simulator_that_knows_nothing_of_it():
    late = np.interp(np.arange(FORCE.size) - 6.0, np.arange(FORCE.size), STIFFER)
    found = diagnose(Spring(), late + noise(FORCE.size))
    assert found.named == ["output.delay"]
    assert found.effects["output.delay"]["delay_s"] == pytest.approx(0.06, abs=0.003)
    assert "y(t) = x(t - delay_s)" in found.fix().code


def test_a_simulator_that_takes_inputs_is_driven_by_altered_ones():
    dead = np.sign(FORCE) * np.maximum(np.abs(FORCE) - 2.0, 0.0)
    trials_seen = set()

    def spring(params, effects, inputs, trials):
        trials_seen.add(tuple(t.name for t in trials))
        assert inputs["force_N"].size == trials[-1].samples.stop
        force = inputs["force_N"]
        return params["compliance"] * force + effects["bend"] * force**2

    length = 2.1 * dead + noise(FORCE.size)
    found = diagnose(spring, length, wrap=["input.dead_zone", "input.delay", "output.delay", "output.backlash"])
    assert found.named == ["input.dead_zone"]
    assert found.effects["input.dead_zone"]["w"] == pytest.approx(2.0, rel=0.05)
    assert trials_seen == {("the recording",)}


def test_a_simulator_that_takes_the_first_values_is_called_once_a_recording():
    """A damped spring starts at another length in each recording. A simulation from rest would show a false effect."""
    parts = [(slice(0, 2500), 5.0), (slice(2500, FORCE.size), -40.0)]
    lengths_seen, starts_seen = set(), set()

    def relaxed(force, compliance, start):
        out = np.empty(force.size)
        out[0] = start
        for i in range(1, force.size):
            out[i] = out[i - 1] + 0.02 * (compliance * force[i - 1] - out[i - 1])
        return out

    def spring(params, effects, inputs, first):
        lengths_seen.add(inputs["force_N"].size)
        starts_seen.add(round(first["length_mm"]))
        return relaxed(inputs["force_N"], params["compliance"], first["length_mm"])

    recordings = [
        stretch_gap.Trial({"force_N": FORCE[part], "length_mm": relaxed(FORCE[part], 2.1, start)}) for part, start in parts
    ]
    for one, (part, _) in zip(recordings, parts):
        one.columns["length_mm"][1:] += noise(FORCE[part].size - 1)
    found = stretch_gap.diagnose(
        spring,
        recordings,
        output="length_mm",
        inputs=["force_N"],
        rate_hz=RATE_HZ,
        parameters={"compliance": stretch_gap.Parameter(2.0, relative=0.1, unit="mm/N")},
        wrap=["input.delay", "output.backlash"],
    )
    assert found.verdict == "parameters" and found.named == []
    assert found.parameters["compliance"] == pytest.approx(2.1, rel=0.01)
    assert lengths_seen == {2500, FORCE.size - 2500} and starts_seen == {5, -40}


def test_a_simulator_finds_the_time_among_its_inputs():
    def simulate(params, effects, inputs):
        np.testing.assert_allclose(inputs["time_s"], np.arange(FORCE.size) / RATE_HZ)
        return params["compliance"] * FORCE

    question = {"effects": None, "wrap": None}
    assert diagnose(simulator=simulate, length=STIFFER + noise(FORCE.size), **question).verdict == "parameters"
    with pytest.raises(stretch_gap.StretchError, match=r'time_s is the time .* finds the time in inputs\["time_s"\]'):
        stretch_gap.diagnose(simulate, {"time_s": FORCE, "length_mm": BENT}, output="length_mm", inputs=["time_s"])


def test_notes_name_what_may_have_been_overlooked():
    def notes(simulator, data, inputs, wrap=None, parameters=None):
        more = {"inputs": inputs, "rate_hz": RATE_HZ, "wrap": wrap, "parameters": parameters}
        return "\n".join(stretch_gap.diagnose(simulator, data, output=list(data)[-1], **more).notes)

    data = {"force_N": FORCE, "length_mm": 0.5 * np.round(2.0 * (STIFFER + noise(FORCE.size)))}
    named = ["output.all", "output.quantisation"]
    ignored = {"mass": (1.0, 0.1), "damping": (2.0, 0.2)}
    said = notes(lambda params, effects: STIFFER, data, "force_N", "output.all", ignored)
    assert "although its values are multiples of 0.5; to look for it, add output.quantisation to wrap" in said
    assert "no change of mass or damping changes the simulation: check that the simulator uses" in said
    assert "multiples" not in notes(lambda params, effects: STIFFER, data, "force_N", named[1:])
    # A command that wraps, and also steps by more than a quarter of a turn.
    command = np.cumsum(np.repeat(np.random.default_rng(2).uniform(-100.0, 110.0, 60), 100)) / 100.0
    command += np.repeat(np.random.default_rng(3).uniform(-80.0, 80.0, 60), 100)
    moved = np.convolve(command, np.ones(100) / 100.0)[: command.size] + noise(command.size)
    wrapped = {name: (column + 180.0) % 360.0 - 180.0 for name, column in [("sent_deg", command), ("angle_deg", moved)]}
    said = notes(lambda params, effects: moved, wrapped, "sent_deg")
    assert "angle_deg jumps by 360 deg" in said and "sent_deg jumps by nearly a full turn and is not unwrapped" in said


def test_a_parameter_far_outside_its_tolerance_is_corrected_in_the_fix():
    def spring(params, effects, inputs):
        return params["compliance"] * inputs["force_N"] + params["slack"]

    parameters = {"compliance": stretch_gap.Parameter(2.0, relative=0.05), "slack": 0.5}
    found = diagnose(spring, 2.8 * FORCE + 0.5 + noise(FORCE.size), parameters=parameters, effects={})
    fix = found.fix()
    assert (found.verdict, found.named) == ("record", []) and re.search(r"compliance is 2\.\d+ on the rig", found.sentence)
    assert found.parameters == fix.parameters == {"compliance": pytest.approx(2.8, abs=0.01)}
    least, greatest = found.parameter_intervals["compliance"]
    assert least < fix.parameters["compliance"] < greatest and f"'compliance': {fix.parameters['compliance']!r}" in fix.code
    np.testing.assert_allclose(fix(inputs={"force_N": FORCE}), 2.8 * FORCE + 0.5, atol=0.1)
    for run in (fix.diagnose, lambda: fix.predict({"force_N": FORCE, "length_mm": FORCE}, rate_hz=RATE_HZ)):
        with pytest.raises(stretch_gap.StretchError, match="can be called, but it cannot predict or diagnose"):
            run()
    wrong = diagnose(spring, -(2.0 * FORCE + 0.5) + noise(FORCE.size), effects={}, parameters=parameters)
    assert wrong.verdict == "record" and "upside down" in wrong.sentence
    with pytest.raises(stretch_gap.StretchError, match="the recording is wrong, so nothing was fitted to it"):
        wrong.fix()(inputs={"force_N": FORCE})


def test_a_fix_predicts_new_recordings_and_is_diagnosed_again():
    def spring(params, effects, inputs):
        return params["compliance"] * inputs["force_N"] + effects["bend"] * inputs["force_N"] ** 2

    def recording(force, seed):
        late = np.interp(np.arange(force.size) - 6.0, np.arange(force.size), 2.1 * force + 0.02 * force**2)
        return {"force_N": force, "length_mm": late + noise(force.size, seed)}

    found = diagnose(spring, recording(FORCE, 0)["length_mm"], wrap=["output.delay", "output.backlash"])
    assert sorted(found.named) == ["bend", "output.delay"]
    fix = found.fix()
    predicted = fix.predict(recording(load(20.0)[::-1].copy(), 1), rate_hz=RATE_HZ)
    assert predicted.ratio < 0.1 and predicted.times_noise < 1.3
    curves = predicted.curves("length_mm")
    if importlib.util.find_spec("matplotlib"):
        top, bottom = predicted.plot("length_mm")
        assert len(top.lines) == 3 and len(bottom.lines) == 2
    wide = fix.predict([recording(2.0 * FORCE, 4), recording(-2.0 * FORCE, 5)], rate_hz=RATE_HZ).notes
    assert {note.split(": ")[0] for note in wide if "was fitted" in note} == {"recording 1", "recording 2"}
    off = [np.std(curves[name] - curves["measured"]) for name in ("without", "with_effects")]
    assert off[1] == pytest.approx(predicted.outputs[0]["rmse"], rel=0.05) and off[1] < 0.1 * off[0]
    for again in (fix.diagnose(), fix.diagnose(recording(FORCE[::-1].copy(), 2), rate_hz=RATE_HZ)):
        assert again.named == [] and again.verdict == "no_gap", again.sentence
    with pytest.raises(stretch_gap.StretchError, match="this fix cannot be run, because the diagnosis was read from text"):
        stretch_gap.Diagnosis.from_json(found.to_json()).fix().predict(recording(FORCE, 3))


def test_no_effect_can_be_named_at_a_depth_of_0():
    with pytest.raises(
        stretch_gap.StretchError, match="depth is 0, the largest number of effects that may be named; give 1 or more"
    ):
        diagnose(Spring(), BENT, depth=0)


def test_two_outputs_come_as_a_dict():
    squared = 0.1 * FORCE**2
    slow = [squared[0]]
    for x in squared[1:]:  # a time constant of 0.3 s
        slow.append(slow[-1] + (x - slow[-1]) * (1.0 - np.exp(-0.01 / 0.3)))

    class Both:
        def simulate(self, params, effects):
            return {"length_mm": params[:, :1] * FORCE, "heat_W": params[:, 1:] * squared}

    data = {
        "force_N": FORCE,
        "length_mm": 2.1 * FORCE + noise(FORCE.size),
        "heat_W": 1.02 * np.array(slow) + noise(FORCE.size, 1),
    }
    stages = [
        stretch_gap.Stage("length_mm", ["force_N"], name="spring"),
        stretch_gap.Stage("heat_W", ["force_N"], name="heater"),
    ]
    found = stretch_gap.diagnose(
        Both(),
        data,
        stages=stages,
        rate_hz=RATE_HZ,
        parameters={
            "compliance": stretch_gap.Parameter(2.0, 0.2, stages=["spring"]),
            "loss": stretch_gap.Parameter(1.0, 0.05, stages=["heater"]),
        },
        wrap=["heat_W.lag", "length_mm.backlash"],
    )
    assert found.named == ["heater.output.lag"]
    assert found.where["heat_W"] > 0.9
    assert set(found.how_far["retuned"]) == {"length_mm", "heat_W"}


def test_the_index_of_a_data_frame_may_be_the_time(bent):
    pandas = pytest.importorskip("pandas")
    time_s = np.arange(FORCE.size) / RATE_HZ
    frame = pandas.DataFrame({"force_N": FORCE, "length_mm": BENT})
    start = pandas.Timestamp("2026-01-01", tz="Europe/Berlin")
    question = {"output": "length_mm", "inputs": "force_N", "effects": {"bend": (-0.05, 0.05)}}
    question["parameters"] = {"compliance": stretch_gap.Parameter(2.0, relative=0.1, unit="mm/N")}
    for index in (pandas.Index(time_s, name="t"), start + pandas.to_timedelta(time_s, unit="s")):
        found = stretch_gap.diagnose(Spring(), frame.set_index(index), wrap=["output.backlash", "output.delay"], **question)
        assert found.sentence == bent.sentence
    frame = frame.astype(object)
    frame.loc[7, "force_N"] = "n/a"
    with pytest.raises(stretch_gap.StretchError, match="force_N of the recording, sample 7: 'n/a' is not a number"):
        stretch_gap.diagnose(Spring(), frame, rate_hz=RATE_HZ, **question)


def test_recordings_come_in_many_forms(bent):
    half = FORCE.size // 2
    parts = [
        {"force_N": FORCE[:half], "length_mm": BENT[:half]},
        stretch_gap.Trial({"force_N": FORCE[half:], "length_mm": BENT[half:]}, rate_hz=RATE_HZ, name="tuesday", test=True),
    ]
    question = {
        "output": "length_mm",
        "inputs": ["force_N"],
        "parameters": {"compliance": (2.0, 0.2)},
        "effects": {"bend": stretch_gap.Argument(-0.05, 0.05, unit="mm/N2")},
        "wrap": None,
    }
    assert stretch_gap.diagnose(Spring(), parts, rate_hz=RATE_HZ, **question).named == ["bend"]
    pandas = pytest.importorskip("pandas")
    time_s = np.arange(FORCE.size) / RATE_HZ
    frame = pandas.DataFrame({"time_s": time_s, "force_N": FORCE, "length_mm": BENT})
    assert stretch_gap.diagnose(Spring(), frame, **question).named == ["bend"]


def test_what_the_simulator_raises_comes_out_as_it_is():
    class Broken(RuntimeError):
        pass

    error = Broken("the solver fell over")

    def spring(params, effects):
        raise error

    with pytest.raises(Broken) as caught:
        diagnose(spring, BENT)
    assert caught.value is error
    assert any("test_diagnosis.py" in str(entry.path) for entry in caught.traceback)


@pytest.mark.skipif(sys.version_info < (3, 11), reason="exceptions have notes from Python 3.11")
def test_a_note_says_at_which_values_the_simulator_failed():
    class Diverging(Spring):
        def simulate(self, params, effects):
            raise OverflowError("math range error")

    with pytest.raises(OverflowError) as caught:
        diagnose(Diverging(), BENT)
    (note,) = caught.value.__notes__
    assert re.search("called with (. models, the first of them with )?compliance = 2, bend = 0", note)

    with pytest.raises(KeyError) as caught:
        diagnose(lambda params, effects, inputs: 2.0 * inputs["force_N"], BENT, inputs=(), wrap=None)
    where, why = caught.value.__notes__
    assert where == "the simulator was called with compliance = 2, bend = 0"
    assert why.startswith("the recording has the column force_N, but the argument inputs= of diagnose (or of a Stage) does not")
    with pytest.raises(KeyError) as caught:
        diagnose(lambda params, effects, inputs: params["stiffness"] * inputs["force_N"], BENT)
    assert len(caught.value.__notes__) == 1


def test_values_that_are_refused_turn_the_fit_back():
    class Careful(Spring):
        refused = 0

        def simulate(self, params, effects):
            if np.any(effects["bend"] < -0.005):
                self.refused += 1
                raise stretch_gap.Refused("bent the other way")
            return super().simulate(params, effects)

    careful = Careful()
    found = diagnose(careful, BENT)
    assert careful.refused > 0 and found.named == ["bend"]


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lambda length: length[:-1], "returned 5999 samples instead of 6000 for length_mm; return one sample for each that"),
        (lambda length: np.zeros((2, length.size)), r"the shape \(2, 6000\) instead of \(6000,\) for length_mm; return"),
        (lambda length: np.where(np.arange(length.size) == 50, np.nan, length), r"gave NaN at 0\.5 s of the recording"),
        (lambda length: "six", "returned text; return real numbers in the output's unit"),
        (lambda length: length + 0j, "returned complex numbers"),
        (lambda length: length.astype("datetime64[ns]"), "returned times"),
        (lambda length: length.astype("timedelta64[ns]"), "returned durations"),
        (lambda length: {"length_mm": [str(x) for x in length]}, "returned text for length_mm"),
        (lambda length: [None] + [[1.0]] * 5999, "returned no numbers"),
        (lambda length: np.ma.masked_array(length, np.arange(length.size) == 50), r"gave NaN at 0\.5 s of the recording"),
        (lambda length: {"width_mm": length}, "returned no length_mm; it returned width_mm"),
        (lambda length: None, "the simulator returned None; is a return statement missing"),
        (lambda length: {"length_mm": None}, "the simulator returned None for length_mm; is a return"),
    ],
)
def test_answers_that_are_none_say_what_was_expected(answer, words):
    with pytest.raises(stretch_gap.StretchError, match=words):
        diagnose(lambda params, effects: answer(params["compliance"] * FORCE), BENT)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"output": "width_mm"}, "there is no column width_mm; the columns are force_N, length_mm"),
        ({"output": None}, "give either output, the name of the measured column, or stages"),
        ({"output": "lenght_mm"}, r"no column lenght_mm \(did you mean length_mm\?\); the columns are force_N, length_mm"),
        ({"wrap": ["output.backlsh"]}, "did you mean output.backlash"),
        ({"wrap": "backlash"}, r"wrap: backlash has no place; did you mean output\.backlash\?"),
        ({"wrap": ["backlsh"]}, r"did you mean output\.backlash\?"),
        ({"wrap": 5}, "wrap is 5; give a name, or a list of names"),
        ({"units": {"foo": "N"}}, "units: there is no column foo; the columns are force_N, length_mm"),
        ({"noise": {"lenght_mm": 0.1}}, r"noise: there is no column lenght_mm \(did you mean length_mm"),
        ({"noise": {"length_mm": "0.1"}}, "noise of length_mm is '0.1'; give a finite number"),
        ({"noise": {"length_mm": -0.1}}, "noise of length_mm is -0.1; give one standard deviation, which is not below 0"),
        ({"units": {"length_mm": 5}}, "units of length_mm is 5; give text"),
        ({"rate_hz": "100"}, "rate_hz is '100'; give a finite number"),
        ({"budget": "many"}, "budget is 'many'; give a whole number of at least 1"),
        ({"seed": 1.5}, "seed is 1.5; give a whole number"),
        ({"wrap": ["input.delay"]}, "must take the argument inputs"),
        ({"effects": {"bend": 0.3}}, "effect bend is 0.3; give"),
        ({"effects": {"compliance": (0.0, 1.0)}}, "effects: compliance is also the name of a parameter; give the effect another"),
        ({"effects": {"bend": (0.05, -0.05)}}, "the range 0.05 to -0.05 is empty"),
        ({"parameters": {"compliance": stretch_gap.Parameter(0.0, relative=0.1)}}, "give an absolute tolerance"),
        ({"effects": {"bend": (0.05, "x")}}, "effect bend: the greatest value is 'x'; give a finite number"),
        ({"effects": {"bend": (1,)}}, r"effect bend is \(1,\); give \(least, greatest\)"),
        ({"effects": "backlash"}, r"effects is a str; give a dict by name, such as effects=\{.* belong in wrap"),
        ({"effects": ["bend"]}, "effects is a list; give a dict by name"),
        ({"parameters": [2.0]}, r"parameters is a list; give a dict by name, such as parameters=\{.mass.: stretch_gap.Parameter"),
        ({"parameters": {"compliance": "2"}}, "parameter compliance: the value is '2'; give a finite number"),
        (
            {"parameters": {"compliance": (1.0, 2.0, 3.0)}},
            r"parameter compliance is \(1.0, 2.0, 3.0\); give \(value, tolerance\)",
        ),
        ({"parameters": {"compliance": (2.0, -1.0)}}, "parameter compliance: the tolerance is -1; give one standard deviation"),
        ({"parameters": {"compliance": stretch_gap.Parameter(2.0, relative=10)}}, "compliance: relative is 10, that is, 1000 %"),
        (
            {"rate_hz": None},
            r"the recording: there is no time: none of its columns \(force_N, length_mm\) is called time_s, t or",
        ),
    ],
)
def test_bad_questions_are_refused_in_a_sentence(more, words):
    with pytest.raises(stretch_gap.StretchError, match=words):
        diagnose(Spring(), BENT, **more)


@pytest.mark.parametrize(
    ("simulator", "words"),
    [
        (3, "give an object with a method simulate"),
        (
            lambda params, effects, command: BENT,
            r"takes \(params, effects, command\), .* only be inputs, first, trials, stage",
        ),
        (lambda p, inputs: BENT, "its first two arguments are params and effects"),
    ],
)
def test_a_simulator_of_another_form_is_refused(simulator, words):
    with pytest.raises(stretch_gap.StretchError, match=words):
        diagnose(simulator, BENT)


def test_columns_of_two_lengths_are_named():
    data = {"force_N": FORCE, "length_mm": BENT[:-5]}
    words = "force_N of the recording has 6000 samples, but length_mm has 5995"
    with pytest.raises(stretch_gap.StretchError, match=words):
        stretch_gap.diagnose(Spring(), data, output="length_mm", inputs="force_N", rate_hz=RATE_HZ)


def test_a_path_without_an_output_gets_an_example(tmp_path):
    path = tmp_path / "day1.csv"
    columns = np.column_stack([np.arange(100) / RATE_HZ, FORCE[:100], BENT[:100]])
    np.savetxt(path, columns, delimiter=",", header="time_s,force_N,length_mm", comments="")
    words = r'diagnose\(simulator, .*day1.csv., output="length_mm", inputs=\["force_N"\], parameters='
    with pytest.raises(stretch_gap.StretchError, match=words):
        stretch_gap.diagnose(Spring(), path)


def test_a_column_t_is_the_time(bent):
    data = {"t": np.arange(FORCE.size) / RATE_HZ, "force_N": FORCE, "length_mm": BENT}
    question = {"output": "length_mm", "effects": {"bend": (-0.05, 0.05)}, "wrap": ["output.backlash", "output.delay"]}
    parameters = {"compliance": stretch_gap.Parameter(2.0, relative=0.1, unit="mm/N")}
    found = stretch_gap.diagnose(Spring(), data, inputs="force_N", parameters=parameters, **question)
    assert found.sentence == bent.sentence


@pytest.mark.parametrize(
    ("more", "code", "words"),
    [
        ({"rate_hz": None, "scale": 1000.0}, "slow_clock", r"median step is 10 s .*; if the time stamps are in milliseconds"),
        ({"parameters": {"compliance": (2.0, 3.0)}}, "large_tolerance", r"\(2, 3\) is read as the value 2 with the standard dev"),
    ],
)
def test_doubtful_numbers_are_warned_of(more, code, words):
    scale = more.pop("scale", 1.0)
    data = {"force_N": FORCE, "length_mm": BENT}
    if "rate_hz" in more:
        data["time_s"] = scale * np.arange(FORCE.size) / RATE_HZ
    question = {"output": "length_mm", "inputs": "force_N", "rate_hz": RATE_HZ, "budget": 3}
    question["effects"] = {"bend": (-0.05, 0.05)}
    with pytest.warns(stretch_gap.DoubtWarning, match=words) as warned:
        try:
            stretch_gap.diagnose(Spring(), data, **{"parameters": {"compliance": 2.0}, **question, **more})
        except stretch_gap.StretchError as error:
            assert "budget" in str(error)
    assert warned[0].message.code == code and warned[0].filename == __file__


def test_a_simulator_that_refuses_everything_is_told():
    def spring(params, effects):
        raise stretch_gap.Refused("no convergence")

    with pytest.raises(stretch_gap.StretchError, match="refused every request, the nominal values included: no convergence"):
        diagnose(spring, BENT)


def test_inputs_are_changed_in_a_copy_only():
    def spring(params, effects, inputs):
        inputs["force_N"] *= params["compliance"]
        return inputs["force_N"] + effects["bend"]

    with pytest.raises(stretch_gap.StretchError, match=r'inputs are read-only .*; change a copy, as in inputs\["COLUMN"\]'):
        diagnose(spring, BENT)


def test_a_dead_column_is_told_and_no_effect_is_blamed():
    with pytest.raises(stretch_gap.StretchError, match="dead"):
        diagnose(Spring(), np.zeros_like(BENT))


@pytest.mark.parametrize("budget", [None, 300])
def test_a_notebook_shows_the_number_of_model_runs(budget, monkeypatch, capsys):
    pytest.importorskip("tqdm")
    monkeypatch.setitem(sys.modules, "ipykernel", sys)
    monkeypatch.setattr("tqdm.auto.tqdm", importlib.import_module("tqdm").tqdm)
    found = diagnose(Spring(), BENT, budget=budget)
    shown = capsys.readouterr().err.splitlines()[-1].split("\r")[-1]
    runs = int(re.fullmatch(r"[^\d]* (\d+) (?:of at most 300 )?model runs, .*", shown).group(1))
    assert abs(runs - found.model_runs) <= 2, (shown, found.model_runs)
    assert ("█" in shown and f"of at most {budget}" in shown) if budget else "█" not in shown


def test_a_proposed_experiment_begins_where_the_recording_does_and_is_no_faster():
    slow = 20 * np.sin(0.3 * np.arange(3000) / RATE_HZ) + 10 * np.sin(0.5 * np.arange(3000) / RATE_HZ)

    def spring(params, effects, inputs):
        return params["compliance"] * inputs["force_N"]

    late = np.interp(np.arange(3000) - 5.0, np.arange(3000), 2.1 * slow) + 15 * noise(3000)
    found = stretch_gap.diagnose(
        spring,
        {"force_N": slow, "length_mm": late},
        output="length_mm",
        inputs="force_N",
        rate_hz=RATE_HZ,
        parameters={"compliance": (2.0, 0.2)},
        wrap=["input.delay", "output.delay", "output.lag", "output.skew"],
        experiment=True,
    )
    assert found.next_experiment, found.sentence
    commands = found.next_experiment["columns"]
    force, step_s = commands["force_N"], commands["time_s"][1]
    fastest = [np.max(np.abs(np.diff(one))) / step for one, step in [(force, step_s), (slow, 1 / RATE_HZ)]]
    assert 0.5 < fastest[0] / fastest[1] < 1.01
    assert force[0] == pytest.approx(slow[0]) and slow.min() - 1e-9 <= force.min() < force.max() <= slow.max() + 1e-9


def test_progress_is_told_and_may_stop_it():
    words = []
    diagnose(Spring(), BENT, progress=words.append)
    assert any(word.startswith("simulating the test trials") for word in words)

    def enough(_):
        raise TimeoutError("enough")

    with pytest.raises(TimeoutError, match="enough"):
        diagnose(Spring(), BENT, progress=enough)


PROBLEM = """
name = "spring"
simulator = {simulator}
wrap = ["input.delay", "output.backlash"]

[[stage]]
name = "spring"
output = "length_mm"
inputs = ["force_N"]

[[parameter]]
name = "compliance"
unit = "mm/N"
value = 2.0
tolerance = 0.2

[[effect]]
name = "bend"
range = [-0.05, 0.05]
off = 0.0

[[trial]]
file = "trial.csv"
"""

WORKER = """
class Spring:
    def begin(self, session):
        assert session["stages"][0]["output"] == "length_mm"
        self.samples = [t["samples"] for t in session["trials"]]

    def simulate(self, params, effects, inputs, trials):
        assert [t.samples.stop - t.samples.start for t in trials] == self.samples[: len(trials)]
        force = inputs["force_N"]
        assert force.shape == (len(params), trials[-1].samples.stop)
        return params["compliance"][:, None] * force + effects["bend"][:, None] * force**2
"""


@pytest.fixture
def problem_file(tmp_path):
    time_s = np.arange(FORCE.size) / RATE_HZ
    columns = np.column_stack([time_s, FORCE, BENT])
    np.savetxt(tmp_path / "trial.csv", columns, "%.9g", ",", header="time_s,force_N,length_mm", comments="")
    (tmp_path / "worker.py").write_text(WORKER)
    path = tmp_path / "problem.toml"
    path.write_text(PROBLEM.replace("{simulator}", '{ python = "worker:Spring" }'))
    return path


def test_a_problem_that_is_a_file_takes_an_object_or_its_own_simulator(problem_file):
    found = stretch_gap.diagnose(Spring(), problem_file)
    assert found.named == ["bend"]
    assert found.parameters["compliance"] == pytest.approx(2.1, rel=0.01)
    own = stretch_gap.diagnose(None, str(problem_file))
    assert own.named == ["bend"]
    names = {}
    exec(WORKER, names)
    here = stretch_gap.diagnose(names["Spring"](), problem_file)
    # the same object in another process: the same bits
    assert here.probabilities == own.probabilities and here.parameters == own.parameters
    with pytest.raises(stretch_gap.StretchError, match="defines output, stages, parameters and effects"):
        stretch_gap.diagnose(Spring(), problem_file, output="length_mm")
    with pytest.raises(stretch_gap.StretchError, match="there is no simulator"):
        stretch_gap.diagnose(None, {"force_N": FORCE, "length_mm": BENT})
