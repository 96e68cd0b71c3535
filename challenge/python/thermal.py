"""The nominal simulator of the heated block in Python: NumPy, and numba if it is installed."""
import numpy as np

from plant import njit

NAME, DT_S, INPUT, OUTPUTS = "thermal", 2.0, "heater_W", ("block_degC", "probe_degC")
STAGES = ("block", "probe")
NOISE = (0.1, 0.1)
SPAN = (0.0, 60.0)  # range of the input
PARAMETERS = {"capacity": 120.0, "loss": 0.8, "probe_tau": 12.0}
TOLERANCES = {"capacity": 6.0, "loss": 0.08, "probe_tau": 1.2}
EFFECTS = ("radiation", "fan")  # effects that the simulator implements; 0 is off
SUBSTEPS = 4


@njit(cache=True)
def block(power, p, effects):
    """capacity T' = power - loss (T - 20) - radiation (T^4 - 293^4)/1e9 - fan (T - 20) above 50 degC."""
    out, t, step = np.empty_like(power), 20.0, DT_S / SUBSTEPS
    for i in range(len(power)):
        out[i] = t
        for _ in range(SUBSTEPS):
            taken = effects[0] * ((t + 273.15) ** 4 - 293.15**4) / 1e9
            taken += effects[1] * (t - 20.0) / (1.0 + np.exp(50.0 - t))
            t += step * (power[i] - taken - p[1] * (t - 20.0)) / p[0]
    return out


@njit(cache=True)
def probe(t, p, effects):
    """probe' = (T - probe)/tau, T linear between samples."""
    out, y, step = np.empty_like(t), 20.0, DT_S / SUBSTEPS
    for i in range(len(t)):
        out[i] = y
        following = t[min(i + 1, len(t) - 1)]
        for k in range(SUBSTEPS):
            y += step * (t[i] + (following - t[i]) * (k + 0.5) / SUBSTEPS - y) / p[2]
    return out


SIMULATE = (block, probe)
