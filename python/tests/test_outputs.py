"""Tests that no output file replaces a recording or a simulator."""

from __future__ import annotations

import numpy as np
import pytest
import stretch_gap
from conftest import RATE_HZ
from stretch_gap import timeline

FOUND = stretch_gap.Diagnosis({"candidates": []}, "a page")

WRITERS = {
    "Calibration.save": lambda record, folder, out: record.save(out),
    "Diagnosis.report": lambda record, folder, out: FOUND.report(out),
    "Diagnosis.to_rerun": lambda record, folder, out: timeline.write(out, {}, [], 0.01, "a sentence"),
    # a shell expands r*.npz to the names of two recordings
    "convert": lambda record, folder, out: stretch_gap.convert(folder / "log.csv", out),
}


@pytest.fixture(scope="module")
def record(fitted):
    return stretch_gap.calibrate(*fitted, RATE_HZ, model="linear", signal_name="gauge_v", reference_name="angle_deg")


@pytest.mark.parametrize("name", ["r1.npz", "r1.csv", "simulator.py"])
@pytest.mark.parametrize("write", WRITERS.values(), ids=WRITERS.keys())
def test_a_recording_or_a_simulator_is_not_replaced(write, name, record, tmp_path):
    if write is WRITERS["Diagnosis.to_rerun"]:
        pytest.importorskip("rerun", reason="SKIPPED: no package rerun")
    (tmp_path / "log.csv").write_text("time_s,a\n" + "".join(f"{t:.2f},1\n" for t in np.arange(0, 1, 0.01)))
    (tmp_path / name).write_text("what was there")
    with pytest.raises(stretch_gap.StretchError, match=name):
        write(record, tmp_path, tmp_path / name)
    assert (tmp_path / name).read_text() == "what was there"
