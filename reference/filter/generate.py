"""Reference values for stretch-filter. Run: python3 reference/filter/generate.py

Writes the CSV files next to this script; each names the tools it came from.
"""

import platform
from fractions import Fraction
from pathlib import Path

import numpy as np
import scipy
from scipy import integrate, signal

HERE = Path(__file__).parent
TOOLS = (f"# Python {platform.python_version()}, NumPy {np.__version__}, "
         f"SciPy {scipy.__version__}; reference/filter/generate.py\n")
FS = 100.0


def write(name, header, rows):
    with open(HERE / name, "w", newline="\n") as f:
        f.write(TOOLS)
        f.write(",".join(header) + "\n")
        for row in rows:
            f.write(",".join(repr(float(x)) if not isinstance(x, (int, np.integer)) else str(int(x))
                             for x in row) + "\n")


# A signal with noise, a reversal and an offset; the same for every tool.
rng = np.random.default_rng(20240607)
t = np.arange(120) / FS
x = 0.3 + 0.8 * np.abs(t - 0.6) + 0.1 * np.sin(9 * t) + 0.01 * rng.standard_normal(t.size)
write("signal.csv", ["time_s", "x"], zip(t, x))

def exact_taps(window, degree, order, delay):
    """Newest first, by the normal equations in rational numbers, rounded once."""
    half = Fraction(window - 1, 2)
    powers = [[(half - lag) ** k for k in range(degree + 1)] for lag in range(window)]
    m = [[sum(p[i] * p[j] for p in powers) for j in range(degree + 1)] for i in range(degree + 1)]
    at = half - delay
    b = [Fraction(0)] * (degree + 1)
    for k in range(order, degree + 1):
        factor = Fraction(1)
        for j in range(order):
            factor *= k - j
        b[k] = factor * at ** (k - order)
    for i in range(degree + 1):  # Gauss-Jordan: the matrix is positive definite
        pivot = m[i][i]
        m[i] = [v / pivot for v in m[i]]
        b[i] /= pivot
        for r in range(degree + 1):
            if r != i:
                f = m[r][i]
                m[r] = [v - f * w for v, w in zip(m[r], m[i])]
                b[r] -= f * b[i]
    return [float(sum(c * v for c, v in zip(b, p)) * int(FS) ** order) for p in powers]


# Taps, newest first (use="dot" gives them oldest first).
shapes = [(3, 1, 0, 0), (5, 2, 1, 0), (11, 2, 1, 0), (11, 2, 1, 5), (11, 3, 1, 2), (11, 2, 0, 0),
          (7, 3, 2, 1), (31, 3, 1, 0), (25, 4, 1, 12), (64, 5, 1, 7), (12, 2, 1, 3), (21, 6, 3, 4),
          (41, 10, 1, 0)]
rows = []
for window, degree, order, delay in shapes:
    taps = signal.savgol_coeffs(window, degree, deriv=order, delta=1 / FS,
                                pos=window - 1 - delay, use="dot")
    exact = exact_taps(window, degree, order, delay)
    # SciPy solves the Vandermonde system of the lags counted from `pos`.
    condition = np.linalg.cond(np.vander(np.arange(window) - (window - 1 - delay), degree + 1))
    rows += [(window, degree, order, delay, condition, lag, e, s)
             for lag, (e, s) in enumerate(zip(exact, taps[::-1]))]
write("savgol_taps.csv", ["window", "degree", "order", "delay", "condition", "lag", "exact", "scipy"], rows)

# Whole logs, one-sided polynomial fits at both ends.
logs = [(11, 2, 1), (11, 2, 0), (25, 4, 1), (7, 3, 2)]
rows = []
for window, degree, order in logs:
    y = signal.savgol_filter(x, window, degree, deriv=order, delta=1 / FS, mode="interp")
    rows += [(window, degree, order, i, v) for i, v in enumerate(y)]
write("savgol_log.csv", ["window", "degree", "order", "index", "y"], rows)

# Causal output on the signal.
rows = []
for window, degree, delay in [(11, 2, 0), (11, 2, 5), (31, 3, 0)]:
    taps = signal.savgol_coeffs(window, degree, deriv=1, delta=1 / FS,
                                pos=window - 1 - delay, use="dot")
    for i in range(window - 1, x.size):
        rows.append((window, degree, delay, i, float(np.dot(taps, x[i - window + 1:i + 1]))))
write("savgol_live.csv", ["window", "degree", "delay", "index", "y"], rows)

# Butterworth: response at a few frequencies, output from rest, noise gain, delay at DC.
rows, outputs, gains = [], [], []
for order in range(1, 9):
    for cutoff in [0.5, 5.0, 20.0, 45.0]:
        sos = signal.butter(order, cutoff, fs=FS, output="sos")
        f = np.array([0.0, 0.1, 1.0, cutoff, 10.0, 30.0, 49.0])
        _, h = signal.sosfreqz(sos, worN=f, fs=FS)
        rows += [(order, cutoff, fi, hi.real, hi.imag) for fi, hi in zip(f, h)]
        y = signal.sosfilt(sos, x)
        outputs += [(order, cutoff, i, v) for i, v in enumerate(y)]
        k = np.tan(np.pi * cutoff / FS)
        power, _ = integrate.quad(
            lambda w: 1 / (1 + (np.tan(w / 2) / k) ** (2 * order)), 0, np.pi,
            epsabs=1e-13, epsrel=1e-12, limit=500,
            points=[2 * np.pi * cutoff / FS])
        slope, _ = integrate.quad(
            lambda w: 4 * np.sin(w / 2) ** 2 / (1 + (np.tan(w / 2) / k) ** (2 * order)), 0, np.pi,
            epsabs=1e-13, epsrel=1e-12, limit=500,
            points=[2 * np.pi * cutoff / FS])
        # Numerical derivative of the phase near zero frequency.
        df = 1e-3
        _, h1 = signal.sosfreqz(sos, worN=[df], fs=FS)
        delay_s = -np.angle(h1[0]) / (2 * np.pi * df)
        gains.append((order, cutoff, np.sqrt(power / np.pi), FS * np.sqrt(slope / np.pi), delay_s))
write("butter_response.csv", ["order", "cutoff_hz", "frequency_hz", "re", "im"], rows)
write("butter_output.csv", ["order", "cutoff_hz", "index", "y"], outputs)
write("butter_gain.csv", ["order", "cutoff_hz", "noise_gain", "difference_noise_gain", "delay_s"],
      gains)

# Steady-state Kalman gains by the discrete algebraic Riccati equation.
from scipy.linalg import solve_discrete_are  # noqa: E402

rows = []
for index in [1e-3, 1e-2, 0.1, 0.5, 1.0, 3.0, 20.0]:
    F = np.array([[1.0, 1.0], [0.0, 1.0]])  # T = 1, unit measurement noise
    G = np.array([[0.5], [1.0]])
    H = np.array([[1.0, 0.0]])
    P = solve_discrete_are(F.T, H.T, index**2 * G @ G.T, np.eye(1))
    K = P @ H.T / (P[0, 0] + 1)
    # Noise gains by the Lyapunov equation of the closed loop.
    A = (np.eye(2) - K @ H) @ F
    S = scipy.linalg.solve_discrete_lyapunov(A, K @ K.T)
    rows.append((index, K[0, 0], K[1, 0], np.sqrt(S[0, 0]), np.sqrt(S[1, 1])))
write("tracker_gains.csv", ["tracking_index", "alpha", "beta", "value_noise_gain", "rate_noise_gain"],
      rows)
