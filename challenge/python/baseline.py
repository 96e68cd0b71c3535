"""The baseline: re-tunes the nominal simulator, adds each candidate in turn, and picks the one with the least error on a held-out trial.

    python3 baseline.py SET submission.json
"""
import sys

import numpy as np

from case import solve

LEAST_GAIN = 0.02  # smallest reduction of the held-out error, as a share, for which an effect is named
CONFIDENT = 0.9  # probability of the picked answer; the rest is divided equally among all other answers


def held_out_error(case, stage, names):
    """Root mean square error, in multiples of the noise, on the last fit trial, after a fit to the other fit trials."""
    p, effects, _ = case.retune(stage, names, trials=case.fit[:-1])
    return float(np.sqrt(np.mean(case.residual(stage, p, effects, case.fit[-1:]) ** 2)))


def baseline(case):
    """Answers a case: the hypotheses with probabilities, the verdict, the stage, and the closed share of the gap."""
    plain = [held_out_error(case, stage, []) for stage in case.stages]
    gains = {}
    for name in case.places:
        stage = case.stage_of(name)
        gains[name] = 1.0 - held_out_error(case, stage, [name]) / plain[stage]
    best = max(gains, key=gains.get)
    is_named = gains[best] > LEAST_GAIN
    picked = [best] if is_named else []
    answers = [[], ["unknown"], *([name] for name in gains)]
    others = (1.0 - CONFIDENT) / (len(answers) - 1)
    believed = [(a, CONFIDENT if a == picked else others) for a in answers]
    verdict = "effect" if is_named else "parameters"
    return believed, verdict, case.places.get(best) if is_named else None, case.closed(picked) if is_named else 0.0


if __name__ == "__main__":
    setup = f"shipped with the challenge; nothing tuned: named from a gain of {LEAST_GAIN:.0%} of the held-out error on"
    solve(sys.argv[1], baseline, "least held-out RMSE", setup, sys.argv[2])
