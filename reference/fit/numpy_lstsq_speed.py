"""Speed and error of NumPy's least squares on the data of benches/fit.rs.

Run next to `cargo bench --bench fit` on the same machine and compare
nanoseconds a sample: `python3 numpy_lstsq_speed.py`. One thread, process CPU
time, the design matrix built inside the clock as in the bench; the lowest of
seven rounds.
"""
import os

os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"
import time

import numpy as np

TRUTH = np.array([0.058, 0.001, 0.774, -0.121, 2.30, 0.094, -2.26])


def log(samples, centre=1.24, width=0.02):
    k = np.arange(samples, dtype=float)
    r = 2.0 * np.modf(k * 0.7548776662466927)[0] - 1.0
    v = centre + width * (np.modf(k * 0.5698402909980532)[0] - 0.5)
    p00, p10, p01, p11, p02, p12, p03 = TRUTH
    return r, v, p00 + p01 * v + p02 * v * v + p03 * v * v * v + r * (p10 + p11 * v + p12 * v * v)


def design(r, v):
    return np.column_stack([np.ones_like(r), r, v, r * v, v * v, r * v * v, v * v * v])


def lstsq(r, v, z):
    return np.linalg.lstsq(design(r, v), z, rcond=None)[0]


def qr(r, v, z):
    q, t = np.linalg.qr(design(r, v))
    return np.linalg.solve(t, q.T @ z)


def normal_equations(r, v, z):
    a = design(r, v)
    return np.linalg.solve(a.T @ a, a.T @ z)


if __name__ == "__main__":
    print(f"numpy {np.__version__}, condition {np.linalg.cond(design(*log(20_000)[:2])):.2g}")
    samples = 1_000_000
    data = log(samples)
    for method in (lstsq, qr, normal_equations):
        best = float("inf")
        for _ in range(7):
            start = time.process_time()
            found = method(*data)
            best = min(best, time.process_time() - start)
        error = np.linalg.norm(found - TRUTH) / np.linalg.norm(TRUTH)
        print(f"{method.__name__:17} {best / samples * 1e9:6.0f} ns/sample  error {error:.1e}")
