"""A recorded trial of the rig on a grid of 100 Hz, with the additional quantities that a simulation needs."""
import numpy as np
from scipy.signal import medfilt, savgol_filter

import rig
from rig_operators import played

STRIDE = 7  # every seventh row is compared; 50 and 60 Hz remain visible
GAP_S, AFTER_GAP_S = 0.035, 1.5  # commands in a gap are unknown: rows in it and after it are left out
OUTLIER = 10.0  # samples farther than this from the median of five, in multiples of the noise, are replaced
MAD = 1.4826  # standard deviation of a normal variable divided by its median absolute deviation


def roughness(x):
    """Estimates the noise from second differences, in which slow motion is small."""
    return MAD * np.median(np.abs(np.diff(x, 2))) / np.sqrt(6.0)


def table_of(path):
    """Columns of a trial by name. Empty cells are NaN."""
    names = path.open().readline().strip().split(",")
    try:
        rows = np.loadtxt(path, delimiter=",", skiprows=1)
    except ValueError:
        rows = np.genfromtxt(path, delimiter=",", skip_header=1)
    return dict(zip(names, rows.T, strict=True))


class Trial:
    """Commands and measurements at 100 Hz. Gaps are interpolated, and isolated outliers are replaced by the median of five."""

    def __init__(self, path, start_s):
        rows = table_of(path)
        at = np.arange(round((rows["time_s"][-1] - rows["time_s"][0]) * rig.RATE_HZ) + 1) * rig.DT_S
        given = rows["time_s"] - rows["time_s"][0]
        held = np.clip(np.searchsorted(given, at + 0.5 * rig.DT_S) - 1, 0, len(given) - 1)
        self.inlet, self.outlet = (np.nan_to_num(rows[c][held]) for c in rig.INPUTS)
        self.outputs = [self.cleaned(at, given, rows[c]) if c in rows else None for c in rig.OUTPUTS]
        pressure, length, _ = self.outputs
        self.length = np.ascontiguousarray(savgol_filter(length, 7, 2))
        self.wound = 1.0 if np.median(length[:50]) < 165.0 else -1.0  # 1 if the chamber was filled before the trial, -1 if it was vented
        self.has_pressure = pressure is not None
        if self.has_pressure:
            self.pressure = np.ascontiguousarray(savgol_filter(pressure, 7, 2))
            self.start_kpa = float(np.median(pressure[:50]))
        self.y = (1.0 - self.length / rig.L_0) / rig.PARAMETERS[1]["k_max"]
        turned = np.sign(np.diff(played(self.length, 0.15, self.wound), append=0.0))
        turned[-1] = 0.0
        moved = np.maximum.accumulate(np.where(turned != 0.0, np.arange(len(turned)), -1))
        self.moving = np.where(moved >= 0, turned[moved], -self.wound)
        self.t_s = (start_s + at, at)
        rows, ends = np.arange(3, len(at), STRIDE), given[1:][np.diff(given) > GAP_S]
        unknown = [(at[rows] > end - np.diff(given).max()) & (at[rows] < end + AFTER_GAP_S) for end in ends]
        self.rows = rows[~np.any(unknown, axis=0)] if unknown else rows
        self.travel = 0.0  # travel of the strain before this trial; the case sets it
        self.hum = np.zeros(len(at))

    @staticmethod
    def cleaned(at, given, values):
        good = np.isfinite(values)
        x = np.interp(at, given[good], values[good])
        usual = medfilt(x, 5)
        return np.where(np.abs(x - usual) > OUTLIER * max(roughness(x), 1e-9), usual, x)

    def line(self, hertz):
        """Amplitudes of cosine and sine of one frequency in the voltage, fitted to its second differences."""
        phase = 2.0 * np.pi * hertz * self.t_s[1]
        basis = np.stack([np.cos(phase), np.sin(phase)])
        rough = np.diff(self.outputs[2], 2) / (2.0 * np.cos(2.0 * np.pi * hertz * rig.DT_S) - 2.0)
        limit = 6.0 * MAD * np.median(np.abs(rough))
        parts = np.linalg.lstsq(basis[:, 1:-1].T, np.clip(rough, -limit, limit), rcond=1e-6)[0]
        return parts, parts @ basis
