"""The nominal simulator of the servo in Python: NumPy, and numba if it is installed, which is much faster."""
import numpy as np

from plant import njit

NAME, DT_S, INPUT, OUTPUTS = "servo", 0.01, "command_V", ("speed_rad_s", "load_rad")
STAGES = ("motor", "gear")
NOISE = (0.3, 0.01)
SPAN = (-6.0, 6.0)  # range of the input
PARAMETERS = {"gain": 20.0, "tau": 0.1, "ratio": 20.0, "soft": 0.05}
TOLERANCES = {"gain": 1.0, "tau": 0.01, "ratio": 0.2, "soft": 0.005}
EFFECTS = ("friction", "drag")  # effects that the simulator implements; 0 is off
SUBSTEPS = 4


@njit(cache=True)
def motor(u, p, effects):
    """w' = (gain u - friction tanh(w) - drag w |w|/100^2 - w)/tau, u held between samples."""
    out, w, step = np.empty_like(u), 0.0, DT_S / SUBSTEPS
    for i in range(len(u)):
        out[i] = w
        for _ in range(SUBSTEPS):
            taken = effects[0] * np.tanh(w) + effects[1] * w * abs(w) / 1e4
            w += step * (p[0] * u[i] - taken - w) / p[1]
    return out


@njit(cache=True)
def gear(w, p, effects):
    """angle' = w/ratio, load' = (angle - load)/soft, w linear between samples."""
    out, angle, load, step = np.empty_like(w), 0.0, 0.0, DT_S / SUBSTEPS
    for i in range(len(w)):
        out[i] = load
        following = w[min(i + 1, len(w) - 1)]
        for k in range(SUBSTEPS):
            speed = w[i] + (following - w[i]) * (k + 0.5) / SUBSTEPS
            load += step * (angle - load) / p[3]
            angle += step * speed / p[2]
    return out


SIMULATE = (motor, gear)
