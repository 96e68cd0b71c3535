"""The rig in plain Python: valves and chamber, muscle, sleeve and gauge, reference, and the effects that may be missing.

The equations are those of the documentation of the rig; candidates have textbook forms. Units are SI except lengths (mm). One step per sample.
"""
import numpy as np

from plant import njit
from rig_operators import elastic, faded, hysteresis, lagged, late, limited, oscillated, played, travelled

NAME, DT_S, RATE_HZ = "rig", 0.01, 100.0
INPUTS, OUTPUTS = ("inlet", "outlet"), ("pressure_kpa", "length_mm", "bridge_v")
STAGES = ("pneumatics", "body")  # fitted one by one; the body is muscle, gauge and reference, which share the length
STAGE_OF_PLACE = {"pneumatics": 0, "muscle": 1, "sensing": 1, "reference": 1}
P_ATM, GAS, RHO_0, V_0 = 101325.0, 287.05 * 293.15, 1.185, 25e-6
L_0, P_REF = 180.0, 620e3
PARAMETERS = ({"P_s": 620e3, "C_in": 1e-9, "C_out": 1e-9, "b": 0.35, "u_min": 0.02},
              {"k_max": 0.162, "a0": 0.5822, "a1": 4.142, "a3": 0.5368, "tau_m": 0.03, "e0": 0.22, "R0": 4.0, "beta": 1.0,
               "V_exc": 1.2, "G": 10.0, "V_ref": 1.24})
TOLERANCES = ({"P_s": 6.2e3, "C_in": 3e-10, "C_out": 3e-10, "b": 0.035, "u_min": 0.004},
              {"k_max": 0.0162, "a0": 0.0291, "a1": 0.207, "a3": 0.0268, "tau_m": 0.015, "e0": 0.022, "R0": 0.4, "beta": 0.01,
               "V_exc": 0.012, "G": 0.1, "V_ref": 0.02})
# arguments of each candidate: (off, start, most); a candidate with either sign has the same range below its off value
ARGUMENTS = {
    "supply_sag": [(0.0, 4e7, 4e8)], "valve_delay": [(0.0, 0.02, 0.12)], "valve_deadband": [(0.0, 0.02, 0.11)],
    "leak": [(0.0, 2e-11, 2e-10)], "chamber_volume": [(0.0, 0.5, 3.0)],
    "muscle_hysteresis": [(0.0, 0.1, 0.6), (0.005, 0.02, 0.06)], "muscle_creep": [(0.0, 0.05, 0.3), (0.5, 4.0, 40.0)],
    "crossbeam_inertia": [(0.0, 0.02, 0.08)], "sleeve_slack": [(0.0, 0.06, 0.2)], "sleeve_slip": [(0.0, 0.004, 0.03)],
    "pressure_crosstalk": [(0.0, 0.01, 0.05)], "gauge_hysteresis": [(0.0, 0.1, 0.6), (0.005, 0.02, 0.06)],
    "gauge_relaxation": [(0.0, 0.1, 0.6), (0.02, 0.3, 4.0)], "gauge_softening": [(0.0, 0.04, 0.3), (0.3, 3.0, 20.0)],
    "gauge_nonlinearity": [(0.0, 0.02, 0.1)], "thermal_drift": [(0.0, 5e-5, 4e-4)],
    "self_heating": [(0.0, 0.01, 0.05), (1.0, 8.0, 60.0)], "amplifier_saturation": [(0.5, 1.1, 2.4), (3.3, 2.6, 1.4)],
    "amplifier_lowpass": [(0.0, 0.03, 0.4)], "mains_hum": [(0.0, 0.005, 0.1)], "channel_skew": [(0.0, 0.02, 0.2)],
    "pot_nonlinearity": [(0.0, 0.5, 3.0)], "pot_backlash": [(0.0, 0.2, 2.0)],
}
SIGNED = ("pressure_crosstalk", "gauge_relaxation", "gauge_nonlinearity", "thermal_drift", "self_heating", "channel_skew",
          "pot_nonlinearity")


@njit(cache=True)
def flow(conductance, above, below, b):
    """Flow of ISO 6358 from one absolute pressure to a lower one, kg/s."""
    r = below / above
    if r >= 1.0 or conductance <= 0.0:
        return 0.0
    z = (r - b) / (1.0 - b)
    return conductance * above * (1.0 if r <= b else np.sqrt(1.0 - z * z))


@njit(cache=True)
def rates(held, sag, volume, c_in, c_out, p, e):
    """Rates of change of the chamber's content (p V/V0, Pa) and of the sag of the supply."""
    pressure = held / volume
    drawn = flow(c_in, p[0] + P_ATM - sag, pressure, p[3])
    net = drawn - flow(c_out, pressure, P_ATM, p[3]) - e[3] * (pressure - P_ATM)
    return GAS / V_0 * net, (e[0] * drawn - sag) / 0.5


@njit(cache=True)
def opened(u, dead, least):
    u = max(0.0, (u - dead) / (1.0 - dead))
    return least + (1.0 - least) * u if u > 0.0 else 0.0


@njit(cache=True)
def pneumatics(inlet, outlet, y, start_kpa, p, e):
    """Gauge pressure, kPa, by classical Runge-Kutta. `y` is k/k_max, measured; e: sag, delay, dead band, leak, volume."""
    n, out = len(inlet), np.empty(len(inlet))
    volume = 1.0 + e[4] * y[0]
    held, sag = (1e3 * start_kpa + P_ATM) * volume, 0.0
    whole = int(e[1] * RATE_HZ)
    part = e[1] * RATE_HZ - whole  # share of a sample in which the previous command still acts
    for i in range(n):
        out[i] = 1e-3 * (held / volume - P_ATM)
        following = 1.0 + e[4] * y[min(i + 1, n - 1)]
        change = following - volume
        for half in range(2):
            h = DT_S * (part if half == 0 else 1.0 - part)
            j = max(i - whole - (1 - half), 0)
            if h < 1e-9:
                continue
            c_in = p[1] * RHO_0 * opened(inlet[j], e[2], p[4])
            c_out = p[2] * RHO_0 * opened(outlet[j], e[2], p[4])
            after = volume + change * h / DT_S
            middle = 0.5 * (volume + after)
            k1, s1 = rates(held, sag, volume, c_in, c_out, p, e)
            k2, s2 = rates(held + 0.5 * h * k1, sag + 0.5 * h * s1, middle, c_in, c_out, p, e)
            k3, s3 = rates(held + 0.5 * h * k2, sag + 0.5 * h * s2, middle, c_in, c_out, p, e)
            k4, s4 = rates(held + h * k3, sag + h * s3, after, c_in, c_out, p, e)
            fresh = held + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            sag += h / 6.0 * (s1 + 2.0 * s2 + 2.0 * s3 + s4)
            top, bottom = (p[0] + P_ATM - sag) * after, P_ATM * after
            if c_in > 0.0 and held <= top:
                fresh = min(fresh, top)  # the chamber cannot exceed the pressure that drives the flow
            if c_out > 0.0 and held >= bottom:
                fresh = max(fresh, bottom)
            held, volume = fresh, after
    return out


def static_law(p):
    """Contractions without a load, at pressures in steps of 0.5 kPa."""
    x = np.linspace(0.0, 1.6, 1601)
    pressures = P_REF * p["a0"] * (1.0 - np.exp(-p["a1"] * x)) * np.exp(p["a3"] * x * x)
    return np.interp(500.0 * np.arange(2001), pressures, p["k_max"] * x)


@njit(cache=True)
def read_off(table, pressure_kpa):
    out = np.empty_like(pressure_kpa)
    for i in range(len(out)):
        at = min(max(2.0 * pressure_kpa[i], 0.0), len(table) - 2.0)
        cell = int(at)
        out[i] = table[cell] + (at - cell) * (table[cell + 1] - table[cell])
    return out


def muscle(pressure_kpa, wound, p, e):
    """Length, mm. `wound` is the direction of the contraction before the trial: 1 up, -1 down, 0 settled. e: {candidate: arguments}."""
    k = read_off(static_law(p), pressure_kpa)
    if "muscle_hysteresis" in e:
        k = hysteresis(k, *e["muscle_hysteresis"], wound)
    if "muscle_creep" in e:
        share, tau_s = e["muscle_creep"]
        k = k + share * (lagged(k, tau_s, k[0]) - k)
    k = lagged(k, p["tau_m"], k[0])
    if "crossbeam_inertia" in e:
        k = oscillated(k, e["crossbeam_inertia"][0], 0.25)
    return L_0 * (1.0 - k)


def reference(length_mm, wound, p, e):
    """Length that the potentiometer shows, mm."""
    if "pot_nonlinearity" in e:
        y = (1.0 - length_mm / L_0) / p["k_max"]
        length_mm = length_mm + e["pot_nonlinearity"][0] * 4.0 * y * (1.0 - y)
    if "pot_backlash" in e:
        length_mm = played(length_mm, e["pot_backlash"][0], -wound)
    return length_mm


def unreferenced(shown_mm, moving, p, e):
    """True length from the length that the potentiometer shows. `moving` is the direction of the length, 1 while it grows."""
    length = shown_mm + moving * e["pot_backlash"][0] if "pot_backlash" in e else shown_mm
    if "pot_nonlinearity" in e:
        shown = length
        for _ in range(3):
            y = (1.0 - length / L_0) / p["k_max"]
            length = shown - e["pot_nonlinearity"][0] * 4.0 * y * (1.0 - y)
    return length


def resistance(length_mm, pressure_kpa, wound, t_s, travel, p, e):
    """Resistance, ohm. `t_s` is the time since the start of the session and of the trial, `travel` the travel of the strain before the trial."""
    strain = (1.0 + p["e0"]) * length_mm / L_0 - 1.0
    if "sleeve_slack" in e:
        strain = elastic(strain, e["sleeve_slack"][0], 0.003)
    if "sleeve_slip" in e:
        strain = played(strain, e["sleeve_slip"][0], -wound)
    if "pressure_crosstalk" in e:
        strain = strain + e["pressure_crosstalk"][0] * 1e3 * pressure_kpa / P_REF
    if "gauge_hysteresis" in e:
        strain = hysteresis(strain, *e["gauge_hysteresis"], -wound)
    if "gauge_relaxation" in e:
        strain = faded(strain, *e["gauge_relaxation"])
    r = p["R0"] * (1.0 + strain) ** 2
    if "gauge_softening" in e:
        share, scale = e["gauge_softening"]
        gone = travel + travelled(strain, 2.5e-4)
        r = p["R0"] + (r - p["R0"]) * (1.0 - share * (1.0 - np.exp(-gone / scale)))
    if "gauge_nonlinearity" in e:
        x = strain / p["e0"]
        r = r * (1.0 + e["gauge_nonlinearity"][0] * 4.0 * x * (1.0 - x))
    if "thermal_drift" in e:
        r = r * (1.0 + e["thermal_drift"][0] * t_s[0])
    if "self_heating" in e:
        share, tau_s = e["self_heating"]
        r = r * (1.0 + share * (1.0 - np.exp(-t_s[1] / tau_s)))
    return r


def sensing(length_mm, pressure_kpa, wound, t_s, travel, hum, p, e):
    """Amplified voltage of the bridge, V. `hum` is a sine of amplitude 1 with the phase of the recorded hum."""
    r = resistance(length_mm, pressure_kpa, wound, t_s, travel, p, e)
    trimmed = p["beta"] * p["R0"] * (1.0 + p["e0"]) ** 2
    v = p["V_ref"] + p["G"] * p["V_exc"] * (0.5 - r / (r + trimmed))
    if "amplifier_saturation" in e:
        v = limited(v, *e["amplifier_saturation"], 0.01)
    if "amplifier_lowpass" in e:
        v = lagged(v, e["amplifier_lowpass"][0], v[0])
    if "channel_skew" in e:
        v = late(v, e["channel_skew"][0])
    if "mains_hum" in e:
        v = v + e["mains_hum"][0] * hum
    return v
