"""Figures with matplotlib, and the progress that a notebook shows."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from ._stretch import StretchError
from .recordings import Array, unknown
from .simulator import Asked


def output_of(curves: Mapping[str, Any], output: str | None) -> str:
    """Return the name of the output that is asked for: by default the first one. Raise an error if there is no such output."""
    name = output or next(iter(curves))
    if name not in curves:
        raise unknown("output", name, curves)
    return name


def draw(values: Mapping[str, Array], dt_s: float, output: str, title: str) -> Any:
    """Draw two axes above each other: the measured and the simulated curves, and measured minus simulated. Return the axes."""
    try:
        from matplotlib import pyplot  # type: ignore[import-not-found,unused-ignore]
    except ImportError:
        raise StretchError("the package matplotlib is not installed; run pip install matplotlib") from None
    figure, axes = pyplot.subplots(2, sharex=True, layout="constrained", height_ratios=(2, 1))
    measured = np.asarray(values["measured"])
    time_s = dt_s * np.arange(measured.size)
    for name, curve in values.items():
        label = name.replace("_", " ")
        axes[0].plot(time_s, curve, label=label, linewidth=2.5 if name == "measured" else 1.2)
        if name != "measured":
            axes[1].plot(time_s, measured - np.asarray(curve), label=label, color=axes[0].lines[-1].get_color(), linewidth=1.0)
    axes[0].set_ylabel(output)
    axes[1].set_ylabel("measured \N{MINUS SIGN} simulated")
    axes[1].set_xlabel("time, all recordings end to end, s")
    axes[0].legend()
    figure.suptitle(title, fontsize="medium", wrap=True)
    return axes


@contextmanager
def shown(
    progress: Callable[[str], Any] | None, asked: Asked | None, budget: int | None = None
) -> Iterator[Callable[[str], Any] | None]:
    """Yield the function that is called with progress messages.

    Without a function of the user, a notebook shows the step, the number of model runs and the elapsed time if tqdm is installed.
    Only with a budget of runs is the total known, and a bar shown.
    """
    if progress is not None or "ipykernel" not in sys.modules:
        yield progress
        return
    try:
        from tqdm.auto import tqdm  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError:
        yield None
        return
    runs = "{n_fmt} of at most {total_fmt} model runs" if budget else "{n_fmt} model runs"
    with tqdm(total=budget, bar_format="{desc}: " + "{bar} " * bool(budget) + runs + ", {elapsed}") as bar:
        if asked is None:
            yield bar.set_description_str
            return
        asked.counted = bar.update
        try:  # the bar counts the runs itself, also between two steps
            yield lambda words: bar.set_description_str(re.sub(r" \(\d+ model runs\)$", "", words))
        finally:
            asked.counted = None
