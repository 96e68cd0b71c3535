import numpy as np
import pytest
import stretch_gap

TIME_S = np.arange(0.0, 60.0, 0.01)


def knee(t):
    return 40.0 + 20.0 * np.sin(1.3 * t) + 10.0 * np.sin(3.1 * t + 1.0) + 5.0 * np.sin(7.3 * t)


def log(values, seed, time_s=TIME_S, column="knee_deg"):
    return {"time_s": time_s, column: values + 0.05 * np.random.default_rng(seed).normal(size=time_s.size)}


A = log(knee(TIME_S), 0)


def within(estimate, truth):
    low, high = estimate["interval"]
    return low <= truth <= high


def test_delay_gain_and_offset_have_intervals(tmp_path):
    found = stretch_gap.compare(A, log(1.7 * knee(TIME_S - 0.035) + 3.0, 1))
    [one] = found.compared
    assert found.verdict == "parameters"
    assert within(one["delay_s"], 0.035) and within(one["gain"], 1.7) and within(one["offset"], 3.0)
    assert "late" in one["sentence"] and one["sentence"] in " ".join(repr(found).split())
    assert len(one["octaves"]) == 8
    assert found.report(tmp_path / "d.html").startswith("<!DOCTYPE html>")


def test_noise_alone_agrees_and_equal_recordings_are_equal():
    assert stretch_gap.compare(A, log(knee(TIME_S), 1)).verdict == "no_gap"
    assert "in every sample" in stretch_gap.compare(A, A).compared[0]["sentence"]


def test_columns_are_chosen_by_signal(tmp_path):
    slow = np.arange(0.0, 60.0, 0.025)
    other = log(np.deg2rad(knee(slow)), 1, slow, "angle")
    path = tmp_path / "b.csv"
    np.savetxt(path, np.c_[slow, other["angle"]], delimiter=",", header="time_s,angle", comments="")
    assert stretch_gap.compare(A, path, signal="knee_deg=angle").compared[0]["gain"]["value"] == pytest.approx(
        np.pi / 180, rel=0.01
    )


def test_what_cannot_be_compared_is_refused():
    walk = np.convolve(np.random.default_rng(3).normal(size=TIME_S.size + 199), np.ones(200) / 10, "valid")
    for other, part in [
        (log(walk, 1), "do not show the same motion"),
        ({"time_s": TIME_S, "knee_deg": np.full(TIME_S.size, 3.0)}, "is constant"),
        ({"time_s": TIME_S, "x_n": A["knee_deg"], "y_m": A["knee_deg"]}, "no column with the same name"),
        ({name: values[:90] for name, values in A.items()}, "20 s or more"),
    ]:
        with pytest.raises(stretch_gap.StretchError, match=part):
            stretch_gap.compare(A, other)
    with pytest.raises(stretch_gap.StretchError, match="2 recordings"):
        stretch_gap.compare([A, A], A)
