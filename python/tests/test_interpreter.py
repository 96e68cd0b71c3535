"""Tests that other Python threads run, and Ctrl-C works, while Rust code computes."""

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time

import pytest
import stretch_gap
from conftest import RATE_HZ, recording


def test_other_threads_run_on_while_rust_works():
    signals, angles = zip(*[recording(seed, 1.0 + 0.2 * seed, 10.0) for seed in range(3)])
    ticks, done = [], threading.Event()

    def count():
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.001)

    other = threading.Thread(target=count)
    other.start()
    begun = time.monotonic()
    stretch_gap.calibrate(list(signals), list(angles), RATE_HZ, model="auto")
    ended = time.monotonic()
    done.set()
    other.join()
    ticks = [begun] + [tick for tick in ticks if begun <= tick <= ended] + [ended]
    longest = max(later - earlier for earlier, later in zip(ticks, ticks[1:]))
    # if the work held the interpreter lock, the longest pause would be as long as the work
    assert longest < 0.5 * (ended - begun)


def interrupted(code, tmp_path):
    """Run code, interrupt it after it has created `ready`, and return its exit code, time and error text."""
    script = tmp_path / "script.py"
    # a shell starts background jobs such that they ignore this signal
    heard = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    script.write_text(heard + textwrap.dedent(code))
    ready = tmp_path / "ready"
    with subprocess.Popen([sys.executable, str(script), str(ready)], stderr=subprocess.PIPE, text=True, cwd=tmp_path) as process:
        for _ in range(600):
            if ready.exists():
                break
            time.sleep(0.05)
        assert ready.exists(), process.stderr.read()
        time.sleep(0.5)
        begun = time.monotonic()
        process.send_signal(signal.SIGINT)
        text = process.communicate(timeout=60)[1]
        return process.returncode, time.monotonic() - begun, text


@pytest.mark.skipif(os.name != "posix", reason="signals are sent the POSIX way")
def test_ctrl_c_ends_a_calibration(tmp_path):
    code = """
        import pathlib, sys
        import numpy as np, stretch_gap
        time_s = np.arange(0, 600, 0.01)
        angle = 45 - 45 * np.cos(time_s + np.sin(0.3 * time_s))
        signal = np.interp(time_s - 0.05, time_s, angle)
        pathlib.Path(sys.argv[1]).touch()
        stretch_gap.calibrate(signal, angle, 100.0, model="auto")
    """
    status, seconds, text = interrupted(code, tmp_path)
    assert "KeyboardInterrupt" in text and status != 0
    assert seconds < 20.0  # without an interruption the code would run for minutes


@pytest.mark.skipif(os.name != "posix", reason="signals are sent the POSIX way")
@pytest.mark.parametrize("inside", ["time.sleep(60)", "sum(i for i in range(10**12))"])
def test_ctrl_c_ends_a_simulator_that_hangs(tmp_path, inside):
    code = f"""
        import pathlib, sys, time
        import numpy as np, stretch_gap
        x = np.sin(np.arange(3000) * 0.02)
        def simulate(params, effects):
            pathlib.Path(sys.argv[1]).touch()
            {inside}
        stretch_gap.diagnose(simulate, {{"x": x, "y_mm": x}}, rate_hz=100.0, output="y_mm", parameters={{"a": (1.0, 0.1)}})
    """
    status, seconds, text = interrupted(code, tmp_path)
    assert "KeyboardInterrupt" in text and "in simulate" in text and status != 0
    assert seconds < 20.0


def test_the_simulator_runs_on_the_thread_that_asked():
    import numpy as np

    x = np.sin(np.arange(3000) * 0.02)
    threads = set()

    def simulate(params, effects):
        threads.add(threading.get_ident())
        return params["a"] * x

    stretch_gap.diagnose(
        simulate,
        {"x": x, "y_mm": 1.1 * x + 1e-3 * np.cos(np.arange(3000) ** 2)},
        rate_hz=100.0,
        output="y_mm",
        parameters={"a": (1.0, 0.1)},
        wrap=None,
    )
    assert threads == {threading.get_ident()}
