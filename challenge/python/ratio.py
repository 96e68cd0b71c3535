"""A method for comparison from the package `sbi`: neural ratio estimation of the active effects.

    python3 ratio.py DEVELOPMENT_SET [draws]

trains on the same simulations as `neural.py`, and writes `PLANT.ratio` to this folder. It needs PyTorch and `sbi`.
"""
import time

import numpy as np

from case import load
from neural import PRIOR, remembered, simulations, teach
from rivals import named
from simulated import hypotheses


def indicators(names, labels):
    """One row per hypothesis, with 1 for each effect that acts and 0 for the others."""
    return np.array([[float(name in label) for name in names] for label in labels], dtype=np.float32)


def learn(folder, draws=None):
    """Trains a ratio estimator for each number of summary statistics. Returns the estimators with their cost."""
    import torch
    from sbi.inference import SNRE_B
    torch.manual_seed(1)
    torch.set_num_threads(1)
    began, nets = time.process_time(), {}
    names = sorted(load(folder)[3])
    by_width, runs = simulations(folder, draws)
    for width, (rows, labels) in by_width.items():
        inference = SNRE_B(show_progress_bars=False)
        theta = torch.tensor(indicators(names, [label.split() for label in labels]))
        shown = torch.tensor(np.array(rows), dtype=torch.float32)
        nets[width] = inference.append_simulations(theta, shown).train()
    return {"nets": nets, "names": names, "simulations": runs, "seconds": time.process_time() - began}


def ratio(case):
    """Neural ratio estimation with a model indicator (sbi 0.22, SNRE_B, its residual network and its defaults, amortised): the
    indicator is one number an effect, 1 where it acts; simulations, summaries and priors as of the neural posterior; nothing is
    tuned; its training is not among the simulations of a case."""
    import sbi.inference  # needed before a stored network is loaded, because modules of sbi import each other
    import torch
    torch.set_num_threads(1)
    learnt, seen = remembered(case, "ratio")
    all_of = hypotheses(case)
    theta = torch.tensor(indicators(learnt["names"], all_of))
    shown = torch.tensor(np.tile(seen, (len(all_of), 1)), dtype=torch.float32)
    with torch.no_grad():
        ratios = learnt["nets"][len(seen)]([theta, shown]).numpy().ravel().astype(float)
    sizes = np.array([len(hypothesis) for hypothesis in all_of])
    prior = np.array(PRIOR)[sizes] / np.bincount(sizes)[sizes]
    weights = prior * np.exp(ratios - ratios.max())
    believed = zip(all_of, weights / weights.sum(), strict=True)
    return named(case, [(sorted(names), float(p)) for names, p in believed])


METHODS = {"ratio": (ratio, "neural ratio estimation (sbi)")}

if __name__ == "__main__":
    teach(learn, "ratio")
