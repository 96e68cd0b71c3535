"""What stands around a simulator, as code to paste: a column in, a column out.

These are the wrappers that `stretch.diagnose` looks for, with the same equations. Each is a function of the column `x`, the
sample time `dt_s` in seconds, and the values that the diagnosis found.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def delay(x: Array, dt_s: float, *, delay_s: float) -> Array:
    """It acts a dead time later."""
    time_s = dt_s * np.arange(x.size)
    late: Array = np.interp(time_s - delay_s, time_s, x)
    return late


def skew(x: Array, dt_s: float, *, skew_s: float, rate: float = 0.0) -> Array:
    """It is sampled earlier or later than the rest, by a clock of its own."""
    time_s = dt_s * np.arange(x.size)
    return np.interp(time_s - skew_s - rate * time_s, time_s, x)


def lag(x: Array, dt_s: float, *, tau_s: float, second: float = 0.0) -> Array:
    """It follows slowly, without overshoot: two first orders that share the time constant."""
    for tau in (tau_s * (1.0 - second), tau_s * second):
        if tau > 0.0:
            share, z, y = 1.0 - np.exp(-dt_s / tau), x[0], np.empty_like(x)
            ramp = tau * share  # the exact answer to straight lines between samples
            for i in range(x.size):
                slope = (x[i] - x[i - 1]) / dt_s if i else 0.0
                z += share * ((x[i - 1] if i else x[0]) - z) + slope * (dt_s - ramp)
                y[i] = z
            x = y
    return x


def second_order_lag(x: Array, dt_s: float, *, m_s: float, damping: float) -> Array:
    """It follows like a mass on a spring: m_s^2 y'' = x - y - 2 damping m_s y', exact for straight lines between samples."""
    omega = np.sqrt(1.0 - damping**2) / m_s
    decay, sin, cos = np.exp(-damping * dt_s / m_s), np.sin(omega * dt_s) / omega, np.cos(omega * dt_s)
    y, position, speed = np.empty_like(x), x[0], 0.0
    y[0] = position
    for i in range(1, x.size):
        slope = (x[i] - x[i - 1]) / dt_s
        behind = 2.0 * damping * m_s * slope  # how far it trails a ramp in the end
        apart, faster = position - (x[i - 1] - behind), speed - slope
        turned = (cos + damping / m_s * sin) * apart + sin * faster
        speed = slope + decay * (-sin / m_s**2 * apart + (cos - damping / m_s * sin) * faster)
        position = x[i] - behind + decay * turned
        y[i] = position
    return y


def relaxation(x: Array, dt_s: float, *, c: float, tau_s: float, spread: float = 1.0) -> Array:
    """It overshoots a quick change and relaxes, or creeps after it."""
    means = [lag(x, dt_s, tau_s=tau) for tau in (tau_s / spread, tau_s, tau_s * spread)]
    mean: Array = x + c * (x - sum(means) / len(means))
    return mean


def slew_limit(x: Array, dt_s: float, *, rate: float) -> Array:
    """It cannot change faster than a rate."""
    y, z = np.empty_like(x), x[0]
    for i in range(x.size):
        z += min(max(x[i] - z, -rate * dt_s), rate * dt_s)
        y[i] = z
    return y


def dead_zone(x: Array, dt_s: float, *, w: float, softness: float = 0.0) -> Array:
    """Small values do nothing."""
    knee = softness * w
    if knee <= 0.0:
        return x - np.clip(x, -w, w)
    size = knee * (np.logaddexp(0.0, (np.abs(x) - w) / knee) - np.logaddexp(0.0, -w / knee))
    signed: Array = np.copysign(size, x)
    return signed


def _play(x: Array, w: float) -> Array:
    """It follows once a gap is taken up."""
    y, z = np.empty_like(x), x[0]
    for i in range(x.size):
        z = min(max(z, x[i] - w), x[i] + w)
        y[i] = z
    return y


def backlash(x: Array, dt_s: float, *, w: float, softness: float = 0.0) -> Array:
    """It has play: it follows once a gap is taken up."""
    mean: Array = sum((_play(x, r) for r in (w * (1.0 - softness), w, w * (1.0 + softness))), np.zeros_like(x)) / 3.0
    return mean


def hysteresis(x: Array, dt_s: float, *, h: float, s: float, spread: float = 1.0) -> Array:
    """It takes another path on the way back (Prandtl-Ishlinskii)."""
    loops: Array = sum((x - _play(x, r) for r in (s * spread**2, s * spread, s)), np.zeros_like(x)) / 3.0
    return x - h * loops


def bouc_wen(x: Array, dt_s: float, *, c: float, s: float) -> Array:
    """It turns back on a smooth loop (Bouc-Wen)."""
    y, u = np.empty_like(x), 0.0
    for i in range(x.size):
        dx = x[i] - x[i - 1] if i else 0.0
        way, along = abs(dx) / s, -u if dx < 0.0 else u
        if along < 0.0:
            along = along + way if way <= -along else -np.expm1(-(way + along))
        else:
            along = 1.0 - (1.0 - along) * np.exp(-way)
        u = -along if dx < 0.0 else along
        y[i] = x[i] - c * u
    return y


def saturation(x: Array, dt_s: float, *, low: float, high: float, knee: float) -> Array:
    """It runs into an end, by a soft knee."""
    above = low + knee * np.logaddexp(0.0, (x - low) / knee)
    within: Array = high - knee * np.logaddexp(0.0, (high - above) / knee)
    return within


def quantisation(x: Array, dt_s: float, *, step: float) -> Array:
    """It comes in steps."""
    return np.round(x / step) * step


def offset(x: Array, dt_s: float, *, offset: float) -> Array:
    """Its zero is off."""
    return x + offset


def coulomb_friction(x: Array, v: Array, *, f: float, width: float, lopsided: float = 0.0) -> Array:
    """It rubs by direction, whatever the speed v; in front of a simulator it is taken off."""
    return x + f * np.tanh(v / width) * (1.0 + lopsided * np.sign(v))


def viscous_friction(x: Array, v: Array, *, b: float) -> Array:
    """It rubs in proportion to the speed v; in front of a simulator it is taken off."""
    return x + b * v


def stribeck_friction(x: Array, v: Array, *, more: float, slow: float, width: float) -> Array:
    """It rubs more while it is slow; in front of a simulator it is taken off."""
    return x + np.tanh(v / width) * more * np.exp(-((v / slow) ** 2))


NEEDS: dict[str, list[Any]] = {"backlash": [_play], "hysteresis": [_play], "relaxation": [lag]}
"""What else has to be pasted."""

CODE: dict[str, Any] = {
    function.__name__: function
    for function in (
        delay,
        skew,
        lag,
        second_order_lag,
        relaxation,
        slew_limit,
        dead_zone,
        backlash,
        hysteresis,
        bouc_wen,
        saturation,
        quantisation,
        offset,
        coulomb_friction,
        viscous_friction,
        stribeck_friction,
    )
}
"""The wrappers that are code here; the others are told by their equation."""
