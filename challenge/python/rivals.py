"""Methods for comparison, run on one set: `python3 rivals.py SET METHOD submission.json [cases]`. Each docstring states the settings."""
import sys

import numpy as np

from baseline import baseline
from case import solve


def named(case, believed):
    """Returns the answer that follows from the most probable hypothesis."""
    names, _ = max(believed, key=lambda b: b[1])
    if names == ["unknown"]:
        return believed, "unknown", None, 0.0
    if not names:
        return believed, "parameters", None, 0.0
    return believed, "effect", case.places[names[0]], case.closed(names)


def spread(case, names, confidence=0.9):
    """For a method without probabilities: gives 0.9 to the named effects, and divides the rest among all other answers."""
    answers = [[], ["unknown"], *([name] for name in case.places)]
    others = [a for a in answers if a != sorted(names)]
    rest = (1.0 - confidence) / len(others)
    return [(sorted(names), confidence), *((a, rest) for a in others)]


def singles(case):
    """For no effect and each single effect: sum of squares of the fit over both stages, and number of additional arguments. Also the samples."""
    plain = [case.retune(stage)[2] for stage in case.stages]
    samples = sum(len(case.measured(stage, case.fit)) for stage in case.stages)
    table = {(): (sum(plain), 0)}
    for name in case.places:
        stage = case.stage_of(name)
        table[(name,)] = (sum(plain) - plain[stage] + case.retune(stage, [name])[2], case.free(name))
    return table, samples


def weighed(table, samples):
    """Normalised exp(-BIC/2). The noise is known, so BIC = chi-square + k ln n."""
    bic = {names: chi + k * np.log(samples) for names, (chi, k) in table.items()}
    least = min(bic.values())
    weights = {names: np.exp(-0.5 * min(b - least, 400.0)) for names, b in bic.items()}
    total = sum(weights.values())
    return [(list(names), float(w / total)) for names, w in weights.items()]


def bic(case):
    """BIC over nothing and single effects, weights exp(-BIC/2); nothing is tuned."""
    return named(case, weighed(*singles(case)))


def forward(case):
    """Forward selection by F tests at 0.01 over the number of candidates (Bonferroni), three at most; nothing is tuned."""
    from scipy.stats import f as f_distribution
    chosen, plain = [], [case.retune(stage)[2] for stage in case.stages]
    samples = sum(len(case.measured(stage, case.fit)) for stage in case.stages)
    while len(chosen) < 3:
        tried = {}
        for name in case.places.keys() - set(chosen):
            stage = case.stage_of(name)
            mine = [n for n in chosen if case.stage_of(n) == stage] + [name]
            tried[name] = (case.retune(stage, mine)[2], case.free(name))
        if not tried:
            break

        def p_value(item):
            name, (chi, k) = item
            freedom = samples - len(case.nominal(0)[0]) - len(chosen) - k
            rest = sum(plain) - plain[case.stage_of(name)] + chi
            return f_distribution.sf((sum(plain) - rest) / k / (rest / freedom), k, freedom), chi

        best, (chi, _) = min(tried.items(), key=p_value)
        if p_value((best, tried[best]))[0] > 0.01 / len(case.places):
            break
        plain[case.stage_of(best)] = chi
        chosen.append(best)
    return named(case, spread(case, chosen))


def signatures(case, stage):
    """Changes of a stage's output by each candidate and each parameter, in multiples of the noise, around the re-tuned nominal simulator."""
    p, _, _ = case.retune(stage)
    plain = case.simulate(stage, p, {}, case.fit)
    columns, names = [], []
    for name in case.places:
        if case.stage_of(name) == stage:
            triples = case.arguments(name)
            moved = case.simulate(stage, p, {name: [t[1] for t in triples]}, case.fit)
            columns.append(case.in_noise(stage, moved - plain, case.fit))
            names.append(name)
    for i, tolerance in enumerate(case.nominal(stage)[1]):
        q = p.copy()
        q[i] += tolerance
        columns.append(case.in_noise(stage, case.simulate(stage, q, {}, case.fit) - plain, case.fit))
        names.append(None)
    return case.residual(stage, p, {}, case.fit), np.array(columns).T, names


def sindy(case):
    """PySINDy's STLSQ on the residual with one column a candidate and a parameter, scaled to unit root mean square; threshold 0.1
    times the noise and alpha 0.05, its default; chosen by hand before any sealed set was made."""
    import pysindy
    chosen = []
    for stage in case.stages:
        gap, columns, names = signatures(case, stage)
        size = np.sqrt(np.mean(columns**2, axis=0))
        keep = size > 1e-9
        optimizer = pysindy.STLSQ(threshold=0.1, alpha=0.05)
        optimizer.fit(columns[:, keep] / size[keep], gap[:, None])
        coefficients = np.ravel(optimizer.coef_)
        kept = [name for name, k in zip(names, keep, strict=True) if k]
        chosen += [n for n, c in zip(kept, coefficients, strict=True) if n and abs(c) > 0.0]
    return named(case, spread(case, chosen[:4]))


def joint(case):
    """All candidates of a stage free at once with the parameters, bounded least squares as mujoco.sysid does it; those
    count whose first argument is more than 3 standard errors and 2 % of its range from off; no more is tuned."""
    chosen = []
    for stage in case.stages:
        mine = [n for n in case.places if case.stage_of(n) == stage]
        case.retune(stage, mine)
        found = case.last
        covariance = np.linalg.pinv(found.jac.T @ found.jac)
        at = len(found.x) - sum(len(case.arguments(n)) for n in mine)
        for name in mine:
            error = np.sqrt(max(covariance[at, at], 1e-18))
            if abs(found.x[at]) > max(3.0 * error, 0.02):
                chosen.append(name)
            at += len(case.arguments(name))
    return named(case, spread(case, chosen))


CMA_RUNS = {"rig": 30}


def cma(case):
    """CMA-ES (pycma, its defaults, seed 1, sigma 0.3 of a tolerance or range) for nothing and each candidate, 300 runs each (rig:
    30, over the arguments); then BIC."""
    import cma as pycma

    def least(stage, names):
        cost, begin, lowest, highest = case.search(stage, names)
        if not len(begin):
            return cost(begin)
        runs = CMA_RUNS.get(case.plant.NAME, 300)
        options = {"seed": 1, "maxfevals": runs, "verbose": -9, "bounds": [list(lowest), list(highest)]}
        return pycma.fmin2(cost, begin, 0.3, options)[1].result.fbest

    plain = [least(stage, []) for stage in case.stages]
    samples = sum(len(case.measured(stage, case.fit)) for stage in case.stages)
    table = {(): (sum(plain), 0)}
    for name in case.places:
        stage = case.stage_of(name)
        table[(name,)] = (sum(plain) - plain[stage] + least(stage, [name]), case.free(name))
    return named(case, weighed(table, samples))


METHODS = {"held_out": (baseline, "least held-out RMSE"), "bic": (bic, "BIC over single effects"),
           "forward": (forward, "forward selection, F test"), "sindy": (sindy, "PySINDy, STLSQ on signatures"),
           "joint": (joint, "joint fit, all candidates free"), "cma": (cma, "CMA-ES per candidate, BIC")}

if __name__ == "__main__":
    if sys.argv[2] in ("abc", "neural", "ratio"):
        import neural
        import ratio
        import simulated
        METHODS |= simulated.METHODS | neural.METHODS | ratio.METHODS
    method, name = METHODS[sys.argv[2]]
    limit = int(sys.argv[4]) if len(sys.argv) > 4 else None
    solve(sys.argv[1], method, name, " ".join(method.__doc__.split()), sys.argv[3], limit)
