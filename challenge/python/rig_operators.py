"""Operators of the rig. Signals are sampled at 100 Hz and linear between samples."""
import numpy as np

from plant import njit

DT_S = 0.01


@njit(cache=True)
def lagged(x, tau_s, start):
    """y' = (x - y)/tau, exact for x that is linear between samples."""
    out, y = np.empty_like(x), start
    if tau_s < 1e-6:
        return x.copy()
    keep = np.exp(-DT_S / tau_s)
    for i in range(len(x)):
        out[i] = y
        if i + 1 < len(x):
            slope = (x[i + 1] - x[i]) / DT_S
            y = x[i + 1] - slope * tau_s + (y - x[i] + slope * tau_s) * keep
    return out


@njit(cache=True)
def oscillated(x, m_s, damping):
    """m^2 y'' + 2 damping m y' + y = x, from rest, exact for x that is linear between samples."""
    if m_s < 1e-4:
        return x.copy()
    out, omega = np.empty_like(x), 1.0 / m_s
    decay, turn = damping * omega, omega * np.sqrt(1.0 - damping * damping)
    c, s = np.cos(turn * DT_S) * np.exp(-decay * DT_S), np.sin(turn * DT_S) * np.exp(-decay * DT_S)
    y, v = x[0], 0.0
    for i in range(len(x)):
        out[i] = y
        if i + 1 < len(x):
            slope = (x[i + 1] - x[i]) / DT_S
            behind = 2.0 * damping * m_s * slope
            a, rise = y - x[i] + behind, v - slope
            b = (rise + decay * a) / turn
            y = x[i + 1] - behind + a * c + b * s
            v = slope + (b * turn - decay * a) * c - (a * turn + decay * b) * s
    return out


@njit(cache=True)
def played(x, width, wound):
    """Backlash of half-width `width`. `wound` is the initial state: 1 if x moved up before, -1 if it moved down, 0 in the middle."""
    out, y = np.empty_like(x), x[0] - wound * width
    for i in range(len(x)):
        y = min(max(y, x[i] - width), x[i] + width)
        out[i] = y
    return out


def hysteresis(x, share, scale, wound):
    """Prandtl-Ishlinskii hysteresis: three plays with radii up to `scale`."""
    return x - share * sum(x - played(x, scale * r, wound) for r in (0.25, 0.5, 1.0)) / 3.0


def faded(x, share, tau_s):
    return x + share * (x - lagged(x, tau_s, x[0]))


def elastic(x, least, knee):
    """Limits x to at least `least`, with a soft knee."""
    return least + knee * np.logaddexp(0.0, (x - least) / knee)


def limited(x, low, high, knee):
    """Limits x to a range, with soft knees."""
    x = low + knee * np.logaddexp(0.0, (x - low) / knee)
    return high - knee * np.logaddexp(0.0, (high - x) / knee)


def late(x, delay_s):
    """Delays x; the first and the last value are held."""
    at = np.arange(len(x)) - delay_s / DT_S
    return np.interp(at, np.arange(len(x)), x)


def travelled(x, ignored):
    """Distance that x has travelled up and down, without reversals within a band."""
    return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(played(x, ignored, 0.0))))])
