"""The Python code of the README and of the book runs from top to bottom, for each page in an empty folder."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import stretch_gap

ROOT = Path(__file__).parents[2]


def code(page, language):
    return re.findall(rf"^```{language}\n(.*?)^```$", (ROOT / page).read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("page", ["README.md", "book/src/tutorials/python.md", "book/src/how-to/gymnasium.md"])
def test_the_python_of_a_page_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    blocks = code(page, "python")
    assert blocks
    exec(compile("\n".join(blocks), page, "exec"), {"__name__": page})
    assert list(tmp_path.glob("*.html"))


def test_the_worker_of_the_page_on_isaac_is_diagnosed(tmp_path):
    page = "book/src/how-to/isaac.md"
    [replay], [problem] = code(page, "python"), code(page, "toml")
    (tmp_path / "replay.py").write_text(replay, encoding="utf-8")
    (tmp_path / "problem.toml").write_text(problem, encoding="utf-8")
    module = {}
    exec(compile(replay, page, "exec"), module)
    arm, dt_s, late = module["Arm"](), 0.01, 4
    time_s = dt_s * np.arange(3000)
    command = 0.6 * np.sin(1.1 * time_s) + 0.3 * np.sin(3.7 * time_s)
    arm.reset(np.array([42.0]), np.array([3.6]), np.array([0.11]), 0.0)
    noise, rows = np.random.default_rng(0).normal(scale=5e-4, size=time_s.size), ["time_s,elbow_cmd_rad,elbow_rad"]
    for i, t in enumerate(time_s):
        rows.append(f"{t:.2f},{command[i]:.6f},{arm.angle[0] + noise[i]:.6f}")
        arm.step(command[max(i - late, 0)], dt_s)
    (tmp_path / "log.csv").write_text("\n".join(rows), encoding="utf-8")
    found = stretch_gap.diagnose(None, tmp_path / "problem.toml")
    assert found.probabilities["input.delay"] > 0.5, found.sentence


def test_the_simulators_that_the_page_on_ranges_draws_hold_the_truth():
    module = {}
    exec(compile("\n".join(code("book/src/how-to/ranges.md", "python")), "ranges.md", "exec"), module)
    time_s = np.arange(0, 40, 0.02)
    push = 3 * np.sin(1.1 * time_s) + 2 * np.sign(np.sin(0.7 * time_s))

    def servo(params, effects, inputs):
        kept, angle, angles = np.exp(-0.02 / params["tau"]), 0.0, []
        for u in inputs["push_V"]:
            angle = kept * angle + (1 - kept) * params["gain"] * u
            angles.append(angle)
        return np.array(angles)

    true = servo({"gain": 10.4, "tau": 0.11}, {}, {"push_V": push})
    late = np.concatenate([np.repeat(true[0], 2), true[:-2]]) + np.random.default_rng(1).normal(scale=0.1, size=time_s.size)
    found = stretch_gap.diagnose(
        servo,
        {"time_s": time_s, "push_V": push, "angle_deg": late},
        parameters={"gain": (10.0, 1.0), "tau": (0.1, 0.01)},
        output="angle_deg",
        inputs="push_V",
        wrap=["output.delay", "output.saturation"],
    )
    drawn = found.draw(400, seed=3)
    ranges, random = json.loads(found.to_json())["ranges"], np.random.default_rng(3)
    by_page = [module["draw"](ranges, random) for _ in range(400)]
    truth = {"gain": 10.4, "tau": 0.11, "output.delay.delay_s": 0.04}
    for simulators in (drawn, by_page):
        values = np.array([[one[name] for name in truth] for one in simulators])
        mean, sd = values.mean(0), values.std(0)
        assert np.all(np.abs(mean - list(truth.values())) < 4 * sd)
        assert np.corrcoef(values.T)[1, 2] < -0.5  # a longer delay looks like a slower servo
