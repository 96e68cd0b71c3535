"""Checks the diagnosis of a gauge alone by hand, with other forms than the catalogue's.

    python3 reference/gauge/by_hand.py [DATA]

DATA holds knit_sleeve and cylinder_friction (default: STRETCH_DATA, else ../shared/data next to the project, which
carries no recordings of others; book/src/results/gauge_alone.md says whose they are).

Straight lines, splines, exponentials and stops by least squares (numpy, scipy), on the
first three quarters of a record; the last quarter is only looked at. Nothing here is shared with the program.
"""

import os
import pathlib
import sys

import numpy as np
from scipy.interpolate import BSpline
from scipy.signal import lfilter


def read(file, reference, signal):
    data = np.genfromtxt(file, delimiter=",", names=True)
    x, y = data[reference], data[signal]
    return data["time_s"], (x - x.min()) / np.ptp(x), y


def curve(e, pieces=7):
    """Cubic B-splines: any smooth curve of e."""
    knots = np.r_[[0] * 3, np.linspace(0, 1, pieces - 2), [1] * 3]
    return BSpline.design_matrix(np.clip(e, 0, 1 - 1e-9), knots, 3).toarray()


def late(e, skew_s, dt_s=0.01):
    return np.interp(np.arange(len(e)) - skew_s / dt_s, np.arange(len(e)), e)


def lag(e, tau_s, dt_s=0.01):
    kept = np.exp(-dt_s / tau_s)
    return lfilter([1 - kept], [1, -kept], e, zi=[kept * e[0]])[0]


def stop(e, width):
    """What friction holds back: follows e, but no further than the width."""
    out = np.zeros(len(e))
    for i in range(1, len(e)):
        out[i] = min(max(out[i - 1] + e[i] - e[i - 1], -width), width)
    return out


def left(y, columns, fit):
    weights, *_ = np.linalg.lstsq(columns[fit], y[fit], rcond=None)
    return y - columns @ weights


def best(y, build, grid, fit):
    return min(grid, key=lambda value: np.mean(left(y, build(value), fit)[fit] ** 2))


def sleeve(file, signal):
    t, e, y = read(file, "angle_deg", signal)
    n = len(e)
    fit = np.arange(n) < 0.75 * n
    one, part = np.ones(n), np.arange(n) / n
    base = left(y, np.c_[one, e], fit)

    def say(name, columns):
        rest = left(y, columns, fit)
        closed = [1 - np.mean(rest[p] ** 2) / np.mean(base[p] ** 2) for p in (fit, ~fit)]
        print(f"  {name:34} {100 * closed[0]:4.0f} % fitted {100 * closed[1]:4.0f} % not fitted")

    print(f"{file}, {signal}: closed of the mean square that a line leaves")
    skews, taus = np.arange(-0.1, 0.2, 0.005), np.geomspace(0.03, 20, 20)
    widths = np.geomspace(0.01, 0.4, 12)
    s = best(y, lambda v: np.c_[one, late(e, v)], skews, fit)
    say(f"line, {s:.3f} s late", np.c_[one, late(e, s)])
    say("curve", curve(e))
    s = best(y, lambda v: curve(late(e, v)), skews, fit)
    say(f"curve, {s:.3f} s late", curve(late(e, s)))
    tau = best(y, lambda v: np.c_[curve(e), lag(e, v)], taus, fit)
    say(f"curve and lag of {tau:.2f} s", np.c_[curve(e), lag(e, tau)])
    w = best(y, lambda v: np.c_[curve(e), stop(e, v)], widths, fit)
    say(f"curve and stop of {w:.3f} of the range", np.c_[curve(e), stop(e, w)])
    say("curve, lag and stop", np.c_[curve(e), lag(e, tau), stop(e, w)])
    say("curve, lag and drift", np.c_[curve(e), lag(e, tau), part, e * part])


def cylinder(file):
    t, e, y = read(file, "length_mm", "force_n")
    fit = np.arange(len(e)) < 0.75 * len(e)
    one = np.ones(len(e))
    speed = np.convolve(np.gradient(e, t), np.ones(15) / 15, "same")
    way, side = np.zeros(len(e)), 0.0
    for i, v in enumerate(speed):
        side = np.sign(v) if abs(v) > 0.01 else side
        way[i] = side
    base = left(y, np.c_[one, e], fit)
    rest = left(y, np.c_[one, e, way], fit)
    closed = [1 - np.mean(rest[p] ** 2) / np.mean(base[p] ** 2) for p in (fit, ~fit)]
    weights, *_ = np.linalg.lstsq(np.c_[one, e, way][fit], y[fit], rcond=None)
    print(f"{file}: direction alone closes {100 * closed[0]:.0f} % fitted, {100 * closed[1]:.0f} % not fitted;")
    print(f"  {weights[2]:+.1f} N with the direction, {weights[1]:+.1f} N over the stroke, {np.std(rest):.2f} N left")


if __name__ == "__main__":
    beside = pathlib.Path(__file__).resolve().parents[3] / "shared" / "data"
    named = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("STRETCH_DATA", beside)
    data = pathlib.Path(named)
    if not data.is_dir():
        sys.exit(f"SKIPPED: there is no folder {data}")
    for name in ("s1", "s2", "s3", "s4"):
        sleeve(data / "knit_sleeve/heel_curl_90_1.csv", name)
    cylinder(data / "cylinder_friction/stroke_3bar.csv")
