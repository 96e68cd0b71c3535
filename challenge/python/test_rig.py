"""Compares the rig in Python with the vectors of an independent implementation, nominal and with each effect alone: `python3 test_rig.py`.

The tolerance is a share of full scale (620 kPa, 50 mm, 3.3 V). The rig here has steps of 10 ms, the vectors were computed with 0.25 ms.
"""
import csv
from pathlib import Path

import numpy as np

import rig

VECTORS = Path(__file__).parents[2] / "reference" / "rig"
SCALE = {"pressure_kpa": 620.0, "length_mm": 50.0, "bridge_v": 3.3}
TOLERANCE = 5e-4  # root mean square, as a share of full scale: at most a fifth of the noise of a channel
LINE_HZ = 60.0


def commands(name, samples):
    t = np.arange(samples) * rig.DT_S
    if name == "inflation":
        return np.where(t >= 1.0 - 1e-9, 0.25, 0.0), np.zeros(samples)
    if name == "deflation":
        return np.zeros(samples), np.where(t >= 1.0 - 1e-9, 0.5, 0.0)
    rows = np.genfromtxt(VECTORS / "commands.csv", delimiter=",", names=True)
    at = np.searchsorted(rows["start_s"], t + 1e-9) - 1
    return rows["inlet"][at], rows["outlet"][at]


def simulated(inlet, outlet, start_kpa, effects):
    """Simulates the three channels one after the other. A volume that depends on the length is found by fixed-point iteration."""
    first = np.array(list(rig.PARAMETERS[0].values()))
    inside = [effects.get(n, [0.0])[0] for n in ("supply_sag", "valve_delay", "valve_deadband", "leak", "chamber_volume")]
    p, t = rig.PARAMETERS[1], np.arange(len(inlet)) * rig.DT_S
    length = np.full(len(inlet), rig.L_0)
    for _ in range(60 if inside[4] else 1):
        y = (1.0 - length / rig.L_0) / p["k_max"]
        pressure = rig.pneumatics(inlet, outlet, y, start_kpa, first, np.array(inside))
        length = rig.muscle(pressure, 0.0, p, effects)
    hum = np.sin(2.0 * np.pi * LINE_HZ * t + 0.3)
    volts = rig.sensing(length, pressure, 0.0, (t, t), 0.0, hum, p, effects)
    return {"pressure_kpa": pressure, "length_mm": rig.reference(length, 0.0, p, effects), "bridge_v": volts}


def errors():
    """{(effect, trial, channel): root mean square of the difference, as a share of full scale}"""
    values = {}
    for row in csv.DictReader((VECTORS / "effects.csv").open()):
        values.setdefault(row["effect"], []).append(float(row["value"]))
    out = {}
    for trial in ("inflation", "deflation", "arbitrary"):
        table = np.genfromtxt(VECTORS / f"{trial}.csv", delimiter=",", names=True, deletechars="", comments="#", skip_header=1)
        columns = table.dtype.names
        start = float(table[columns[3]][0])
        inlet, outlet = commands(trial, 5 * len(table))
        for effect in ("nominal", *values):
            given = values.get(effect, [])
            if effect == "mains_hum":
                given = given[:1]
            got = simulated(inlet, outlet, start, {effect: given} if effect != "nominal" else {})
            for channel, scale in SCALE.items():
                column = f"{effect}.{channel}" if f"{effect}.{channel}" in columns else f"nominal.{channel}"
                gap = got[channel][::5][: len(table)] - table[column]
                out[effect, trial, channel] = float(np.sqrt(np.mean(gap**2))) / scale
    return out


def main():
    found = errors()
    worst = max(found, key=found.get)
    for (effect, trial, channel), error in sorted(found.items(), key=lambda item: -item[1])[:12]:
        print(f"{error:.2e} {effect}, {trial}, {channel}")
    covered = {effect for effect, _, _ in found}
    assert covered == {"nominal", *rig.ARGUMENTS}, covered ^ set(rig.ARGUMENTS)
    assert found[worst] < TOLERANCE, f"{worst}: {found[worst]:.2e} of full scale, {TOLERANCE} allowed"


if __name__ == "__main__":
    main()
