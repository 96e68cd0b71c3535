"""A method for comparison that is trained once per plant and then answers fast: neural posterior estimation of the active effects.

    python3 neural.py DEVELOPMENT_SET [draws]

trains on simulations with the inputs of a development set, whose labels are not read, and writes `PLANT.net` to this folder.
"""
import pickle
import sys
import time
from pathlib import Path

import numpy as np

from case import Case, load
from rivals import named
from simulated import Summary, drawn, hypotheses

DRAWS = {"servo": 150, "thermal": 150, "rig": 150}  # number of simulations for each case of the development set
PRIOR = (0.25, 0.5, 0.25)  # prior probabilities of no, one and two effects


def shown(case, random, draws):
    """Summary statistics of simulations of a case, and the effects that acted in each."""
    summary, by_size = Summary(case), [[], [], []]
    for hypothesis in hypotheses(case):
        by_size[len(hypothesis)].append(hypothesis)
    rows, labels = [], []
    for _ in range(draws):
        choices = by_size[random.choice(3, p=PRIOR)]
        hypothesis = choices[random.integers(len(choices))]
        rows.append(summary.of(drawn(case, hypothesis, random)))
        labels.append(" ".join(sorted(hypothesis)))
    return rows, labels


def simulations(folder, draws=None):
    """Summary statistics and labels by the number of statistics (the rig has two: with and without pressure), and the number of runs."""
    runs, random, by_width = 0, np.random.default_rng(1), {}
    about, plant, names, places = load(folder)
    kind = Case
    if plant.NAME == "rig":
        from rig_case import RigCase as kind
    for name in names:
        case = kind(Path(folder) / name, plant, places)
        rows, labels = shown(case, random, draws or DRAWS[plant.NAME])
        kept = by_width.setdefault(len(rows[0]), ([], []))
        kept[0].extend(rows)
        kept[1].extend(labels)
        runs += case.runs
    return by_width, runs


def learn(folder, draws=None):
    """Trains a network for each number of summary statistics. Returns the networks with their cost."""
    from sklearn.neural_network import MLPClassifier
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler
    began, nets = time.process_time(), {}
    by_width, runs = simulations(folder, draws)
    for width, (rows, labels) in by_width.items():
        net = make_pipeline(StandardScaler(), MLPClassifier((128, 64), alpha=1e-2, max_iter=60, random_state=1))
        nets[width] = net.fit(np.array(rows), labels)
    return {"nets": nets, "simulations": runs, "seconds": time.process_time() - began}


def remembered(case, ending):
    """Returns the networks for the plant of a case, and the summary statistics of the case."""
    learnt = pickle.loads((Path(__file__).parent / f"{case.plant.NAME}.{ending}").read_bytes())
    seen = Summary(case).of([case.measured(stage, case.fit) for stage in case.stages])
    if len(seen) not in learnt["nets"]:
        raise SystemExit(f"{case.folder}: no network was taught {len(seen)} numbers: add such a case to the development set")
    return learnt, seen


def teach(learn, ending):
    """Learns from the development set that the command line names, and writes `PLANT.ending` here."""
    taught = learn(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else None)
    out = Path(__file__).parent / f"{load(sys.argv[1])[1].NAME}.{ending}"
    out.write_bytes(pickle.dumps(taught))
    print(f"wrote {out}: {taught['simulations']} simulations, {taught['seconds']:.0f} s")


def neural(case):
    """Neural posterior estimation of the model indicator (amortised): a network (scikit-learn, 128 and 64 units) that learnt from
    150 simulations of each case of a development set (40 of servo and thermal, 10 of the rig) which effects act; summaries as of the
    forest; priors 0.25, 0.5 and 0.25 of nothing, one and two; its training is not among the simulations of a case."""
    learnt, seen = remembered(case, "net")
    net = learnt["nets"][len(seen)]
    p = net.predict_proba(seen[None])[0]
    return named(case, [(label.split(), q) for label, q in zip(net.classes_, p, strict=True)])


METHODS = {"neural": (neural, "neural posterior of the model indicator")}

if __name__ == "__main__":
    teach(learn, "net")
