"""Simulated recordings of a joint, and of a noisy gauge on it with a delay of 50 ms."""

import numpy as np
import pytest

RATE_HZ = 100.0


def recording(seed, speed=1.0, seconds=20.0):
    """Return the gauge's signal, V, and the angle, degrees."""
    draw = np.random.default_rng(seed)
    time_s = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    phase = speed * (time_s + 0.4 * np.sin(0.37 * time_s))
    angle = 45.0 - 45.0 * np.cos(phase)
    late = np.interp(time_s - 0.05, time_s, angle)
    return 0.5 + 0.002 * late + 1e-4 * draw.normal(size=time_s.size), angle


@pytest.fixture(scope="session")
def fitted():
    return recording(1, 1.5)


@pytest.fixture(scope="session")
def tested():
    return recording(2, 1.7)
