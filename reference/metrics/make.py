"""Reference values for stretch-metrics. Run in this folder: python3 make.py

Independent of the crate: SciPy for the paired t test, critical values and R^2,
NumPy for the errors and the correlations, mpmath with 40 digits for P of any size.
"""
import platform

import mpmath
import numpy as np
import scipy
from scipy import signal, stats

mpmath.mp.dps = 40
VERSIONS = (
    f"# Python {platform.python_version()}, NumPy {np.__version__}, "
    f"SciPy {scipy.__version__}, mpmath {mpmath.__version__}; make.py"
)


def save(name, columns):
    rows = zip(*columns.values())
    with open(name, "w") as out:
        print(VERSIONS, file=out)
        print(",".join(columns), file=out)
        for row in rows:
            print(",".join(repr(float(x)) for x in row), file=out)


rng = np.random.default_rng(20240501)
n = 1200
i = np.arange(n)
truth = 165 + 12 * np.sin(0.02 * i) + 3 * np.sin(0.071 * i + 1)
delay = 7.3
first = 165.4 + 1.05 * (12 * np.sin(0.02 * (i - delay)) + 3 * np.sin(0.071 * (i - delay) + 1))
first = first + rng.normal(0, 0.05, n)
noise = signal.lfilter([0.1], [1, -0.9], rng.normal(0, 1, n))
second = truth + 0.12 + noise
save("signals.csv", {"truth": truth, "first": first, "second": second})


def figures(estimate):
    e = estimate - truth
    sse, sst = np.sum(e**2), np.sum((truth - truth.mean()) ** 2)
    delta_s, delta_p = np.ptp(estimate), np.ptp(truth)
    lags = range(-20, 21)
    r = []
    for k in lags:
        a, b = (truth[: n - k], estimate[k:]) if k >= 0 else (truth[-k:], estimate[: n + k])
        r.append(stats.pearsonr(a, b).statistic)
    at = int(np.argmax(r))
    bend = r[at - 1] - 2 * r[at] + r[at + 1]
    return {
        "bias": e.mean(),
        "mae": np.abs(e).mean(),
        "rmse": np.sqrt(np.mean(e**2)),
        "std_dev": e.std(ddof=1),
        "max_abs": np.abs(e).max(),
        "average_estimate": 100 * np.abs(truth - estimate).mean() / delta_s,
        "average_truth": 100 * np.abs(truth - estimate).mean() / delta_p,
        "signed_estimate": 100 * np.mean(truth - estimate) / delta_s,
        "signed_truth": 100 * np.mean(truth - estimate) / delta_p,
        "r_squared": 1 - sse / sst,
        "correlation": stats.pearsonr(truth, estimate).statistic,
        "lag": lags[at] + 0.5 * (r[at - 1] - r[at + 1]) / bend,
        "lag_correlation": r[at],
    }


both = [figures(first), figures(second)]
save("figures.csv", {key: [f[key] for f in both] for key in both[0]})

# Paired t test of the squared errors, on samples and on means over blocks of 50.
a, b = np.abs(first - truth), np.abs(second - truth)
rows = {key: [] for key in ("block", "t", "dof", "p", "mean", "low", "high")}
for block in (1, 50):
    x, y = (v[: n // block * block].reshape(-1, block).mean(axis=1) for v in (a, b))
    result = stats.ttest_rel(x, y)
    low, high = result.confidence_interval(0.95)
    values = (block, result.statistic, result.df, result.pvalue, (x - y).mean(), low, high)
    for key, value in zip(rows, values):
        rows[key].append(value)
save("paired.csv", rows)

# Two-tailed P of Student's t, from ordinary to far below the least f64.
rows = {"t": [], "dof": [], "ln_p": [], "p": []}
for dof in (1, 2, 3, 4.5, 9, 29, 58, 59, 60, 61, 239, 1000, 47999, 1e6, 1e9):
    for t in (1e-9, 0.01, 0.3, 1, 1.5, 1.7, 1.8, 2, 3, 5, 12, 37, 150, 1e4, 1e12):
        v, x = mpmath.mpf(dof), mpmath.mpf(t)
        # The density's upper integral over its value at t, so that nothing underflows.
        ratio = lambda s: mpmath.exp(
            -(v + 1) / 2 * (mpmath.log1p(s * s / v) - mpmath.log1p(x * x / v))
        )
        width = (v + x * x) / ((v + 1) * x) if x > 1 else mpmath.mpf(1)
        ends = [x] + [x + width * k for k in (1, 3, 8, 20, 60)] + [mpmath.inf]
        ln = mpmath.loggamma((v + 1) / 2) - mpmath.loggamma(v / 2) - mpmath.log(v * mpmath.pi) / 2
        at_t = ln - (v + 1) / 2 * mpmath.log1p(x * x / v)
        ln_p = mpmath.log(2) + at_t + mpmath.log(mpmath.quad(ratio, ends))
        rows["t"].append(t)
        rows["dof"].append(dof)
        rows["ln_p"].append(ln_p)
        rows["p"].append(mpmath.exp(ln_p) if ln_p > -744 else 0)
save("student_t.csv", rows)

rows = {"p": [], "dof": [], "t": []}
for dof in (1, 2, 5, 9, 30, 239, 47999):
    for p in (0.9, 0.5, 0.1, 0.05, 0.01, 1e-6):
        rows["p"].append(p)
        rows["dof"].append(dof)
        rows["t"].append(stats.t.isf(p / 2, dof))
save("critical.csv", rows)
