"""Reference values for stretch-fit: `python3 surfaces.py` rewrites the CSV files here.

Least squares in 60-digit arithmetic (mpmath) on the samples as stored in
binary64, so the ill-conditioned coefficients are exact to every digit shown;
t and F quantiles and the robust fits from SciPy; those of statsmodels next to them.
"""
import mpmath as mp
import numpy as np
import scipy
import scipy.optimize
import scipy.stats
import statsmodels
import statsmodels.api as sm

mp.mp.dps = 60
TOOLS = f"# numpy {np.__version__}, scipy {scipy.__version__}, mpmath {mp.__version__}, statsmodels {statsmodels.__version__}\n"
PAPER = {(0, 0): 0.058, (1, 0): 0.001, (0, 1): 0.774, (1, 1): -0.121, (0, 2): 2.30, (1, 2): 0.094, (0, 3): -2.26}
SAMPLES = 240


def exponents(i_max, j_max):
    top = max(i_max, j_max)
    return [(i, t - i) for t in range(top + 1) for i in range(t, -1, -1) if i <= i_max and t - i <= j_max]


def save(name, columns):
    names = list(columns)
    with open(name, "w") as file:
        file.write(TOOLS)
        file.write(",".join(names) + "\n")
        for row in zip(*columns.values()):
            file.write(",".join(repr(float(x)) for x in row) + "\n")


def samples(seed, centre, width, noise, outliers):
    rng = np.random.default_rng(seed)
    r = rng.uniform(-1, 1, SAMPLES)
    v = centre + width * rng.uniform(-0.5, 0.5, SAMPLES)
    z = sum(c * r**i * v**j for (i, j), c in PAPER.items()) + noise * rng.standard_normal(SAMPLES)
    w = rng.uniform(0.2, 3.0, SAMPLES)
    wild = rng.choice(SAMPLES, outliers, replace=False)
    y = z.copy()
    y[wild] += rng.uniform(0.5, 3.0, outliers)
    return r, v, z, w, y


def exact(r, v, z, w, terms):
    """Coefficients, SSE, SST, R^2, standard errors, (A^T W A)^-1, all in mpmath."""
    a = mp.matrix([[mp.mpf(x) ** i * mp.mpf(y) ** j for i, j in terms] for x, y in zip(r, v)])
    n, p = a.rows, a.cols
    b = mp.matrix([mp.mpf(x) for x in z])
    ws = [mp.mpf(x) for x in w]
    wa = mp.matrix([[a[i, j] * ws[i] for j in range(p)] for i in range(n)])
    inverse = mp.inverse(a.T * wa)
    c = inverse * (wa.T * b)
    e = b - a * c
    sse = sum(ws[i] * e[i] ** 2 for i in range(n))
    mean = sum(ws[i] * b[i] for i in range(n)) / sum(ws)
    sst = sum(ws[i] * (b[i] - mean) ** 2 for i in range(n))
    s2 = sse / (n - p)
    return c, sse, sst, s2, inverse


def t_two_sided(level, dof):
    """Two-sided Student quantile in 60 digits."""
    half = mp.mpf(1) / 2
    guess = mp.mpf(float(scipy.stats.t.ppf(0.5 + level / 2, dof)))
    tail = lambda t: mp.betainc(mp.mpf(dof) / 2, half, 0, dof / (dof + t * t), regularized=True)
    return mp.findroot(lambda t: tail(t) - (1 - mp.mpf(level)), guess)


def f_quantile(level, p, dof):
    guess = mp.mpf(float(scipy.stats.f.ppf(level, p, dof)))
    cdf = lambda f: mp.betainc(mp.mpf(p) / 2, mp.mpf(dof) / 2, 0, p * f / (p * f + dof), regularized=True)
    return mp.findroot(lambda f: cdf(f) - mp.mpf(level), guess)


CASES = {"well": (1, 0.35, 1.0), "ill": (2, 1.24, 0.02)}
ORDERS = [(0, 1), (1, 2), (1, 3), (1, 4), (2, 3), (2, 2), (3, 1), (5, 5)]
POINTS = {"well": [(0.0, 0.3), (-0.8, 0.1), (0.9, 0.8)], "ill": [(0.0, 1.24), (-0.8, 1.232), (0.9, 1.249)]}

coefficients = {k: [] for k in ("ill", "weighted", "i", "j", "rate_power", "volts_power", "coefficient", "standard_error", "lower_95", "upper_95")}
statistics = {k: [] for k in ("ill", "weighted", "i", "j", "sse", "r_squared", "adjusted_r_squared", "rmse", "condition")}
prediction = {k: [] for k in ("ill", "weighted", "rate", "volts", "estimate", "leverage", "surface", "observation", "surface_everywhere", "observation_everywhere")}
for ill, (name, (seed, centre, width)) in enumerate(CASES.items()):
    r, v, z, w, y = samples(seed, centre, width, 0.02 if not ill else 1e-6, 24)
    save(f"{name}.csv", {"rate": r, "volts": v, "value": z, "weight": w, "with_outliers": y})
    for weighted in (0, 1):
        ws = w if weighted else np.ones(SAMPLES)
        for i_max, j_max in ORDERS:
            if ill and (i_max, j_max) == (5, 5):
                continue  # condition beyond 1e13: nothing is determined in binary64
            terms = exponents(i_max, j_max)
            c, sse, sst, s2, inverse = exact(r, v, z, ws, terms)
            n, p = SAMPLES, len(terms)
            t = t_two_sided(0.95, n - p)
            for k, (i, j) in enumerate(terms):
                se = mp.sqrt(s2 * inverse[k, k])
                for key, x in zip(coefficients, (ill, weighted, i_max, j_max, i, j, c[k], se, c[k] - t * se, c[k] + t * se)):
                    coefficients[key].append(x)
            r2 = 1 - sse / sst
            a = np.array([[x**i * y_**j for i, j in terms] for x, y_ in zip(r, v)]) * np.sqrt(ws)[:, None]
            row = (ill, weighted, i_max, j_max, sse, r2, 1 - (1 - r2) * (n - 1) / (n - p), mp.sqrt(s2), np.linalg.cond(a))
            for key, x in zip(statistics, row):
                statistics[key].append(x)
            if (i_max, j_max) == (1, 3):
                f = f_quantile(0.95, p, n - p)
                for x, y_ in POINTS[name]:
                    g = mp.matrix([mp.mpf(x) ** i * mp.mpf(y_) ** j for i, j in terms])
                    h = (g.T * inverse * g)[0]
                    widths = [t * mp.sqrt(s2 * h), t * mp.sqrt(s2 * (1 + h)), mp.sqrt(p * f * s2 * h), mp.sqrt(p * f * s2 * (1 + h))]
                    for key, value in zip(prediction, (ill, weighted, x, y_, (g.T * c)[0], h, *widths)):
                        prediction[key].append(value)
save("coefficients.csv", coefficients)
save("statistics.csv", statistics)
save("prediction.csv", prediction)

# Quantiles at several levels and degrees of freedom.
q = {"level": [], "terms": [], "dof": [], "t": [], "f": []}
for level in (0.5, 0.9, 0.95, 0.99, 0.999):
    for p, dof in ((2, 1), (2, 3), (7, 30), (7, 993), (12, 1200), (7, 10**5), (21, 10**6)):
        for key, x in zip(q, (level, p, dof, t_two_sided(level, dof), f_quantile(level, p, dof))):
            q[key].append(x)
save("quantiles.csv", q)


# Robust fits of poly13 on the well-conditioned samples with a tenth spoilt.
def bisquare(a, z, tune=4.685):
    n, p = a.shape
    qa, _ = np.linalg.qr(a)
    h = np.minimum(0.9999, (qa**2).sum(1))
    adjust = 1 / np.sqrt(1 - h)
    c = np.linalg.lstsq(a, z, rcond=None)[0]
    ols_s = np.sqrt(((z - a @ c) ** 2).sum() / (n - p))
    mad = lambda e: np.median(np.sort(np.abs(e))[p - 1 :]) / 0.6745
    for _ in range(500):
        e = (z - a @ c) * adjust
        u = e / (tune * mad(e))
        w = np.where(np.abs(u) < 1, (1 - u**2) ** 2, 0)
        c = np.linalg.lstsq(a * np.sqrt(w)[:, None], z * np.sqrt(w), rcond=None)[0]
    e = (z - a @ c) * adjust
    s = mad(e) * tune
    psi = lambda u: u * np.where(np.abs(u) < 1, (1 - u**2) ** 2, 0)
    u, step = e / s, 1e-5
    m1 = np.mean((psi(u + step) - psi(u - step)) / (2 * step))
    m2 = ((1 - h) * psi(u) ** 2).sum() / (n - p)
    robust_s = (1 + p / n * (1 - m1) / m1) * np.sqrt(m2) * s / m1
    return c, max(robust_s, np.sqrt((ols_s**2 * p**2 + robust_s**2 * n) / (p**2 + n)))


def least_absolute(a, z):
    n, p = a.shape
    cost = np.concatenate([np.zeros(p), np.ones(2 * n)])
    split = np.hstack([a, np.eye(n), -np.eye(n)])
    bounds = [(None, None)] * p + [(0, None)] * (2 * n)
    found = scipy.optimize.linprog(cost, A_eq=split, b_eq=z, bounds=bounds, method="highs-ds")
    return found.x[:p]


r, v, z, w, y = samples(*CASES["well"], 0.02, 24)
a = np.array([[x**i * y_**j for i, j in exponents(1, 3)] for x, y_ in zip(r, v)])
bi, sigma = bisquare(a, y)
save(
    "robust.csv",
    {
        "bisquare": bi,
        "bisquare_sigma": [sigma] * 7,
        "least_absolute": least_absolute(a, y),
        "statsmodels_bisquare": sm.RLM(y, a, M=sm.robust.norms.TukeyBiweight(4.685)).fit(maxiter=500, tol=1e-12).params,
        "plain": np.linalg.lstsq(a, y, rcond=None)[0],
    },
)
