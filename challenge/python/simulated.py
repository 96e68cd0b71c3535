"""A method for comparison that is trained on simulations of a case: approximate Bayesian computation (ABC) by a random forest."""
import numpy as np

from rivals import named, signatures

DRAWS = {"rig": 15}  # number of simulations per case without an effect and of each single effect
PAIRS = {"rig": 75}  # number of simulations of pairs of effects


def hypotheses(case):
    names = list(case.places)
    pairs = [[a, b] for i, a in enumerate(names) for b in names[i + 1 :]]
    return [[], *([n] for n in names), *pairs]


def drawn(case, hypothesis, random):
    """Simulates both outputs of the fit trials. Parameters are drawn within their tolerances, arguments more often near their off values."""
    effects = {}
    for name in hypothesis:
        triples = case.arguments(name)
        share = random.uniform(0.02, 1.0) ** 2
        if case.is_signed(name):
            share *= random.choice([-1.0, 1.0])
        first = triples[0][0] + (triples[0][2] - triples[0][0]) * share
        effects[name] = [first, *(t[0] + (t[2] - t[0]) * random.uniform(0.05, 1.0) for t in triples[1:])]
    out = []
    for stage in case.stages:
        mine = {n: v for n, v in effects.items() if case.stage_of(n) == stage}
        p, spread = case.centre(stage)
        y = case.simulate(stage, p + spread * random.normal(size=len(p)), mine, case.fit)
        out.append(case.noisy(stage, y, random))
    return out


class Summary:
    """Summary statistics of each stage's residual after parameters are projected out: its size, and its correlation with every signature."""

    def __init__(self, case):
        self.case, self.tools = case, []
        for stage in case.stages:
            _, columns, names = signatures(case, stage)
            tuned = columns[:, [i for i, n in enumerate(names) if n is None]]
            basis = np.linalg.qr(tuned[:, np.any(tuned != 0.0, axis=0)])[0]
            shapes = columns[:, [i for i, n in enumerate(names) if n]]
            shapes = shapes - basis @ (basis.T @ shapes)
            shapes = shapes / (np.linalg.norm(shapes, axis=0) + 1e-12)
            self.tools.append((case.simulate(stage, case.centre(stage)[0], {}, case.fit), basis, shapes))

    def of(self, outputs):
        numbers = []
        for stage, (plain, basis, shapes) in enumerate(self.tools):
            gap = self.case.in_noise(stage, outputs[stage] - plain, self.case.fit)
            gap = gap - basis @ (basis.T @ gap)
            size = np.linalg.norm(gap)
            numbers += [np.log(np.mean(gap**2)), np.dot(gap[1:], gap[:-1]) / size**2, np.mean(np.abs(gap)) / size]
            numbers += list(shapes.T @ gap / size) + list(np.arcsinh(shapes.T @ gap))
            parts = np.cumsum(self.case.trial_lengths(stage))[:-1]
            numbers += [np.log(np.mean(part**2) + 1e-9) for part in np.split(gap, parts)]
        return np.array(numbers)


def table(case, random, draws, pairs):
    """(summary statistics, indices of hypotheses, hypotheses) of simulations of a case, and the summary statistics of the case."""
    all_of, summary = hypotheses(case), Summary(case)
    one = [i for i, h in enumerate(all_of) if len(h) < 2]
    two = [i for i, h in enumerate(all_of) if len(h) == 2]
    labels = np.r_[np.repeat(one, draws), random.choice(two, pairs)]
    rows = np.array([summary.of(drawn(case, all_of[i], random)) for i in labels])
    seen = summary.of([case.measured(stage, case.fit) for stage in case.stages])
    return rows, labels, all_of, seen


def abc(case):
    """ABC by random forest (Pudlo 2016; scikit-learn, 300 trees, leaves of 3) trained on simulations of this case's inputs: 60
    of nothing and of each single effect, 180 of pairs (rig: 15 and 75); summaries fixed before any sealed set was made."""
    from sklearn.ensemble import RandomForestClassifier
    random = np.random.default_rng(1)
    plant = case.plant.NAME
    rows, labels, all_of, seen = table(case, random, DRAWS.get(plant, 60), PAIRS.get(plant, 180))
    forest = RandomForestClassifier(300, min_samples_leaf=3, random_state=1).fit(rows, labels)
    p = forest.predict_proba(seen[None])[0]
    return named(case, [(all_of[i], q) for i, q in zip(forest.classes_, p, strict=True) if q > 0.0])


METHODS = {"abc": (abc, "ABC random forest")}
