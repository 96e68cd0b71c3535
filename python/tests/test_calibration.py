import json
import pickle

import numpy as np
import pytest
import stretch_gap
from conftest import RATE_HZ, recording


@pytest.fixture(scope="module")
def poly13(fitted):
    return stretch_gap.calibrate(*fitted, RATE_HZ, model="poly13", signal_name="gauge_v", reference_name="angle_deg")


def test_a_surface_makes_up_for_the_lag_that_a_line_keeps(fitted, tested, poly13):
    linear = stretch_gap.calibrate(*fitted, RATE_HZ, model="linear", signal_name="gauge_v", reference_name="angle_deg")
    verdict = stretch_gap.evaluate({"linear": linear, "poly13": poly13}, *tested, RATE_HZ)
    assert list(verdict.pooled) == ["raw", "linear", "poly13"]
    assert verdict.rmse < 0.5 * verdict.pooled["linear"]["rmse"]
    assert verdict.unit == poly13.unit == "deg"
    assert "poly13" in verdict._repr_html_()


def test_errors_are_those_of_the_estimates(tested, poly13):
    signal, angle = tested
    estimate = poly13.apply(signal, RATE_HZ)
    known = np.isfinite(estimate.value)
    rmse = np.sqrt(np.mean((estimate.value - angle)[known] ** 2))
    # the same squares are added in another order
    assert poly13.evaluate(signal, angle, RATE_HZ).rmse == pytest.approx(rmse, rel=1e-12)
    assert 0 < np.count_nonzero(~known) < 20  # the rate estimator warms up on eleven samples


def test_a_record_survives_as_text_as_file_and_as_pickle(tmp_path, tested, poly13):
    value = poly13.apply(tested[0]).value
    poly13.save(tmp_path / "c.json")
    assert (tmp_path / "c.json").read_text() == poly13.to_json()
    for copy in (
        stretch_gap.Calibration.from_json(poly13.to_json()),
        stretch_gap.Calibration.load(tmp_path / "c.json"),
        pickle.loads(pickle.dumps(poly13)),
    ):
        assert copy == poly13
        np.testing.assert_array_equal(copy.apply(tested[0]).value, value)
    poly13.save(tmp_path / "c.postcard")
    # the binary format does not hold the checksums of the trials; JSON does
    short = stretch_gap.Calibration.load(tmp_path / "c.postcard")
    np.testing.assert_array_equal(short.apply(tested[0]).value, value)
    short.save(tmp_path / "again.postcard")
    assert (tmp_path / "again.postcard").read_bytes() == (tmp_path / "c.postcard").read_bytes()


def test_live_steps_give_the_bits_of_the_whole_recording(tested, poly13):
    signal = tested[0]
    receptor = poly13.receptor()
    readings = [receptor.step(n / RATE_HZ, x) for n, x in enumerate(signal)]
    live = [np.nan if reading is None else reading.estimate for reading in readings]
    np.testing.assert_array_equal(live, poly13.apply(signal, RATE_HZ).value)
    assert receptor.faults == {"missing": 0, "jittered": 0, "backwards": 0}
    assert readings[-1].branch in ("rising", "falling") and readings[-1].domain == "inside"
    receptor.step(signal.size / RATE_HZ + 1.0, signal[-1])
    assert receptor.faults["missing"] == 100


def test_a_branch_is_the_direction_of_the_reference():
    length_mm = 150 + 20 * np.cos(1.5 * np.arange(0, 20, 0.01))
    calibration = stretch_gap.calibrate(0.02 * length_mm, length_mm, 100.0, model="poly13", reference_name="length_mm")
    receptor = calibration.receptor()
    readings = filter(None, (receptor.step(0.01 * n, 0.02 * x) for n, x in enumerate(length_mm)))
    moving = [reading for reading in readings if abs(reading.rate) > 15]
    assert len(moving) > 100
    assert all(reading.branch == ("rising" if reading.rate > 0 else "falling") for reading in moving)


def test_auto_shows_what_it_chose_from():
    pairs = [recording(seed, 1.0 + 0.3 * seed, 8.0) for seed in range(3)]
    signals, angles = zip(*pairs)
    chosen = stretch_gap.calibrate(list(signals), list(angles), RATE_HZ, reference_name="angle_deg")
    named = [row["model"] for row in chosen.models]
    assert chosen.model in named and "linear" in named
    best = chosen.models[0]["rmse"]
    assert next(row["rmse"] for row in chosen.models if row["model"] == "linear") > best
    assert "chosen" in chosen._repr_html_()


def test_integers_lists_and_strided_arrays_are_arrays(fitted):
    signal, angle = fitted
    spaced = np.column_stack([signal, angle])
    options = {"rate_hz": RATE_HZ, "model": "linear"}
    one = stretch_gap.calibrate(signal, angle, **options)
    assert one == stretch_gap.calibrate(spaced[:, 0], spaced[:, 1], **options)
    assert one == stretch_gap.calibrate([float(x) for x in signal], [float(x) for x in angle], **options)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda s, a: (s[:-1], a), "1999"),
        (lambda s, a: (np.full_like(s, np.nan), a), "no sample has a number in every column; signal is nan in sample 0"),
        (lambda s, a: (s.reshape(2, 1000), a), "give as many"),
        (lambda s, a: (np.zeros_like(s), a), "signal is 0 throughout"),
        (lambda s, a: (s[:1], a[:1]), "1 samples are too few"),
        (lambda s, a: (["x"] * s.size, a), "sample 0: 'x' is not a number; write NaN"),
    ],
)
def test_bad_columns_are_refused_in_a_sentence(fitted, spoil, words):
    with pytest.raises(stretch_gap.StretchError, match=words):
        stretch_gap.calibrate(*spoil(*fitted), RATE_HZ, model="linear")


@pytest.mark.parametrize("spoilt", [np.nan, np.inf, -np.inf])
def test_a_sample_without_a_number_is_left_out_as_in_a_file(fitted, tmp_path, spoilt):
    signal, angle = fitted
    time_s = np.arange(signal.size) / RATE_HZ
    broken = np.where(np.arange(signal.size) == 700, spoilt, signal)
    with pytest.warns(stretch_gap.DoubtWarning, match="1 of 2000 samples counts as lost: sample 700") as warned:
        one = stretch_gap.calibrate(broken, angle, RATE_HZ, model="linear")
    assert warned[0].message.code == "missing_samples" and warned[0].filename == __file__
    path = tmp_path / "log.csv"
    rows = np.column_stack([time_s, broken, angle])
    np.savetxt(path, rows, delimiter=",", header="time_s,signal,angle", comments="", fmt="%.17g")
    read = stretch_gap.read(path)
    assert read["signal"].size == 1999
    same = stretch_gap.calibrate(read["signal"], read["angle"], time_s=read.time_s, model="linear")
    model = json.loads(one.to_json())["model"]
    assert json.loads(same.to_json())["model"] == model
    stamps = np.where(np.arange(signal.size) == 700, spoilt, time_s)
    with pytest.warns(stretch_gap.DoubtWarning, match="1 of 2000 samples counts as lost: sample 700 of time_s is"):
        same = stretch_gap.calibrate(signal, angle, time_s=stamps, model="linear")
    assert json.loads(same.to_json())["model"] == model
    with pytest.raises(stretch_gap.StretchError, match=r"time_s, sample 700: .* is not a time; leave this sample out"):
        same.apply(signal, time_s=stamps)


def test_a_missing_sample_has_no_estimate_and_the_others_keep_theirs(tested, poly13):
    signal, _ = tested
    broken = np.where(np.arange(signal.size) == 700, np.nan, signal)
    whole, estimate = poly13.apply(signal, RATE_HZ), poly13.apply(broken, RATE_HZ)
    assert estimate.value.shape == whole.value.shape
    assert np.isnan(estimate.value[700]) and not estimate.inside[700]
    assert np.array_equal(np.isnan(np.delete(estimate.value, 700)), np.isnan(np.delete(whole.value, 700)))


def test_bad_questions_are_refused_in_a_sentence(fitted, poly13):
    with pytest.raises(stretch_gap.StretchError, match='"poly99" is not understood; use linear'):
        stretch_gap.calibrate(*fitted, RATE_HZ, model="poly99")
    with pytest.raises(stretch_gap.StretchError, match="either rate_hz"):
        stretch_gap.calibrate(*fitted)
    with pytest.raises(stretch_gap.StretchError, match="does not come after"):
        stretch_gap.calibrate(*fitted, time_s=np.zeros(fitted[0].size))
    with pytest.raises(stretch_gap.StretchError, match="this calibration cannot be used"):
        stretch_gap.Calibration.from_json('{"schema": 1}')
    with pytest.raises(stretch_gap.StretchError, match="cannot read it"):
        stretch_gap.Calibration.load("/nowhere/c.json")
    with pytest.raises(
        stretch_gap.StretchError,
        match=r"^model=diagnosed needs the effects of the gauge .* with diagnosis=, or fit model=observer$",
    ):
        stretch_gap.calibrate(*fitted, RATE_HZ, model="diagnosed")
    assert issubclass(stretch_gap.StretchError, ValueError)


def test_doubts_are_warnings_with_codes(fitted, tested, poly13, recwarn):
    signal, angle = tested

    def codes():
        said = [(one.category, one.message.code) for one in recwarn.list]
        assert all(category is stretch_gap.DoubtWarning for category, _ in said)
        assert all(one.filename == __file__ for one in recwarn.list)
        recwarn.clear()
        return [code for _, code in said]

    stretch_gap.evaluate(poly13, signal, angle, RATE_HZ)
    poly13.apply(signal)
    assert codes() == []
    poly13.apply(signal, 2 * RATE_HZ)
    assert codes() == ["other_rate"]
    poly13.apply(1000 * signal)
    assert codes() == ["other_unit"]
    poly13.apply(np.full_like(signal, signal[0]))
    assert codes() == ["constant_signal"]
    stretch_gap.evaluate(poly13, *fitted, RATE_HZ)
    assert codes() == ["fitted_trials"]
    stretch_gap.evaluate(poly13, signal, np.full_like(angle, angle[0]), RATE_HZ)
    assert "constant_reference" in codes()


@pytest.mark.parametrize("unit", ["ns", "us", "ms"])
def test_stamps_with_a_unit_are_seconds(tested, poly13, unit):
    nanoseconds = np.round(np.arange(tested[0].size) * 1e9 / RATE_HZ).astype("timedelta64[ns]")
    stamps = nanoseconds.astype(f"timedelta64[{unit}]")
    want = poly13.apply(tested[0], RATE_HZ).value
    for given in (stamps, np.datetime64("2024-05-01") + stamps):
        np.testing.assert_allclose(poly13.apply(tested[0], time_s=given).value, want, rtol=1e-9)
