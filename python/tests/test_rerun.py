"""Tests of writing a diagnosis as a Rerun recording. SKIPPED without rerun-sdk."""

from __future__ import annotations

import numpy as np
import pytest
import stretch_gap

chunks = pytest.importorskip("rerun.chunk", reason="SKIPPED: no package rerun-sdk that reads its files back")


def test_the_curves_stand_on_one_time_line(tmp_path):
    time_s = np.arange(0.0, 20.0, 0.01)
    force = np.sin(time_s) + 0.3 * np.sin(3.3 * time_s)
    length = 2.1 * np.interp(time_s - 0.06, time_s, force) + 0.002 * np.random.default_rng(0).normal(size=time_s.size)
    found = stretch_gap.diagnose(
        lambda params, effects: params["c"] * force,
        {"time_s": time_s, "force_n": force, "length_mm": length},
        output="length_mm",
        inputs=["force_n"],
        parameters={"c": stretch_gap.Parameter(2.0, relative=0.1)},
        wrap=["output.delay"],
    )
    path = tmp_path / "why.rrd"
    found.to_rerun(path)
    rows = {}
    for chunk in chunks.RrdReader(path).stream().to_chunks():
        if "session" in chunk.timeline_names:
            rows[str(chunk.entity_path)] = rows.get(str(chunk.entity_path), 0) + chunk.num_rows
    names = ("measured", "as_shipped", "retuned", "with_effects", "left/as_shipped", "left/retuned", "left/with_effects")
    assert {name.split("length_mm/")[1]: count for name, count in rows.items()} == dict.fromkeys(names, time_s.size)


def test_a_diagnosis_from_text_says_that_it_has_no_curves(tmp_path):
    with pytest.raises(stretch_gap.StretchError, match="diagnose again"):
        stretch_gap.Diagnosis({"candidates": []}).to_rerun(tmp_path / "why.rrd")
