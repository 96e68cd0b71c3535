"""What a mass with viscous friction lacks beside the measured axis of EMPS.

    python emps.py FOLDER [--every 5]

FOLDER holds emps_identification.csv and emps_pulses.csv. The axis is looked at twice: from its motion to the force
(the inverse form) and from the force to its velocity (the simulation). The identification record is fitted, the
record with force pulses is tested on.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import stretch_gap

NEWTON_PER_VOLT = 35.15065188248547
HALF_WINDOW = 5
"""Half the window of the local cubic that gives speed and acceleration, samples at 1 kHz."""
KINDS = ("coulomb_friction", "stribeck_friction", "dead_zone", "backlash", "saturation", "offset", "drift", "softening")
"""What may act on the force. Viscous friction is the simulator's own; offered twice, the two share what there is."""
TIMES = ("delay", "lag", "second_order_lag")
PUBLISHED = {"mass": 95.11, "viscous": 203.5, "coulomb": 20.39, "offset": -3.16}


def derivatives(position, dt_s):
    """Position, velocity and acceleration from cubics fitted to every sample's neighbourhood (Savitzky and Golay)."""
    reach = np.arange(-HALF_WINDOW, HALF_WINDOW + 1)
    taps = np.linalg.pinv(np.vander(reach * dt_s, 4, increasing=True))
    smooth = [np.convolve(position, taps[k][::-1], "valid") for k in range(3)]
    return smooth[0], smooth[1], 2.0 * smooth[2]


def record(folder, name, every):
    """Columns of one record, every so many samples of where the window fits.

    Regressed on the motion, the force that the drive makes needs 0.01 of `pulse_n` beside it: it is left out.
    """
    table = np.genfromtxt(Path(folder) / f"{name}.csv", delimiter=",", names=True)
    time_s = table["time_s"]
    position, velocity, acceleration = derivatives(table["position_m"], np.median(np.diff(time_s)))
    force = NEWTON_PER_VOLT * table["drive_v"]
    # the force through the same window, so that both lose the same
    force = derivatives(force, np.median(np.diff(time_s)))[0]
    inner = slice(HALF_WINDOW, len(time_s) - HALF_WINDOW)
    columns = {
        "time_s": time_s[inner] - time_s[inner][0],
        "force_n": force,
        "position_m": position,
        "velocity_m_s": velocity,
        "acceleration_m_s2": acceleration,
    }
    columns = {key: values[::every] for key, values in columns.items()}
    return stretch_gap.Trial(columns, name=name, test=name.endswith("pulses"))


class Inverse:
    """force = mass acceleration + viscous velocity."""

    def simulate(self, params, effects, inputs):
        mass, viscous = params[:, :1], params[:, 1:2]
        return mass * inputs["acceleration_m_s2"] + viscous * inputs["velocity_m_s"]


class Forward:
    """mass dv/dt = force - viscous v, every trial from rest, the force held from sample to sample."""

    def __init__(self, dt_s):
        self.dt_s = dt_s

    def simulate(self, params, effects, inputs, trials):
        mass, viscous = params[:, 0], params[:, 1]
        force = inputs["force_n"]
        kept = np.exp(-viscous / mass * self.dt_s)
        out = np.zeros((len(params), force.shape[-1]))
        for part in trials:
            v = np.zeros(len(params))
            for i in range(part.samples.start, part.samples.stop):
                out[:, i] = v
                v = kept * v + (1.0 - kept) / viscous * force[..., i]
        return out


def diagnosed(form, folder, every):
    """The axis in one of its two forms."""
    data = [record(folder, name, every) for name in ("emps_identification", "emps_pulses")]
    parameters = {
        "mass": stretch_gap.Parameter(100.0, relative=0.2, unit="kg", least=1.0),
        "viscous": stretch_gap.Parameter(200.0, relative=0.5, unit="N s/m", least=1.0),
    }
    side, simulator, output, inputs = {
        "inverse": ("output", Inverse(), "force_n", ["velocity_m_s", "acceleration_m_s2"]),
        "forward": ("input", Forward(every * 1e-3), "velocity_m_s", ["force_n"]),
    }[form]
    return stretch_gap.diagnose(
        simulator,
        data,
        output=output,
        inputs=inputs,
        parameters=parameters,
        velocity="velocity_m_s",
        units={"force_n": "N", "velocity_m_s": "m/s", "acceleration_m_s2": "m/s^2"},
        wrap=[f"{side}.{kind}" for kind in KINDS] + [f"output.{kind}" for kind in TIMES],
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("--every", type=int, default=5, help="keep every so many samples of 1 kHz")
    parser.add_argument("--report", help="folder for the reports")
    args = parser.parse_args()
    for form in ("inverse", "forward"):
        found = diagnosed(form, args.folder, args.every)
        print(f"\n{form}: {found.sentence}")
        print("  parameters", {k: round(v, 2) for k, v in found.parameters.items()})
        print("  effects", found.effects)
        print("  how far", found.how_far)
        print("  model runs", found.model_runs)
        if args.report:
            found.report(Path(args.report) / f"emps_{form}.html")
    print("\npublished:", PUBLISHED)


if __name__ == "__main__":
    main()
