"""Candidates around a stage, in the textbook forms of `stretch effects kinds`. Each maps a sampled signal to a sampled signal."""
import numpy as np

from plant import njit


@njit(cache=True)
def lagged(x, tau_s, dt_s):
    """y follows x with a time constant."""
    out, y = np.empty_like(x), x[0]
    share = 1.0 - np.exp(-dt_s / max(tau_s, 1e-9))
    for i in range(len(x)):
        y += share * (x[i] - y)
        out[i] = y
    return out


@njit(cache=True)
def played(x, width):
    """y is constant until x is farther from it than the width."""
    out, y = np.empty_like(x), x[0]
    for i in range(len(x)):
        y = min(max(y, x[i] - width), x[i] + width)
        out[i] = y
    return out


def delay(x, dt_s, start, delay_s):
    at = np.arange(len(x)) - delay_s / dt_s
    return np.interp(at, np.arange(len(x)), x)


def dead_zone(x, dt_s, start, width):
    return x - np.clip(x, -width, width)


def saturation(x, dt_s, start, limit):
    return np.clip(x, -limit, limit)


def backlash(x, dt_s, start, width):
    return played(x, width)


def lag(x, dt_s, start, tau_s):
    return lagged(x, tau_s, dt_s)


def drift(x, dt_s, start, change):
    """`start` is (share of the session before the trial, share of a sample)."""
    return x + change * (start[0] + start[1] * np.arange(len(x)))


def relaxation(x, dt_s, start, share, tau_s):
    return x + share * (x - lagged(x, tau_s, dt_s))


def hysteresis(x, dt_s, start, share, scale):
    held = sum(x - played(x, scale * r) for r in (1.0, 0.5, 0.25)) / 3.0
    return x - share * held
