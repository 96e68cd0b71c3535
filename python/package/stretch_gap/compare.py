"""Comparison of two recordings of the same quantity."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any

from . import _stretch
from . import problem as entries
from ._stretch import StretchError
from .diagnosis import Diagnosis, run


def compare(
    a: entries.Data,
    b: entries.Data,
    *,
    signal: str | Sequence[str] = (),
    rate_hz: float | None = None,
    depth: int = 4,
    seed: int = 1,
    threads: int = 0,
    progress: Callable[[str], Any] | None = None,
) -> Diagnosis:
    """Compare two recordings of the same quantity: gain, offset, sign, unit, delay, clock drift, and what these leave.

    The second recording is compared with the first, in the time in which both were recorded. If their clocks differ, they are
    aligned by cross-correlation. What gain, offset and clock leave is diagnosed as the gap of a simulator: the first recording
    is the simulator, the second the rig.

    Parameters
    ----------
    a : dict of str to array_like, data frame, Trial, str or path-like
        First recording, as in the argument `data` of `diagnose`.
    b : dict of str to array_like, data frame, Trial, str or path-like
        Second recording.
    signal : str or sequence of str, default ()
        Columns to compare, each as a name or as `"first=second"`. By default all columns with the same name.
    rate_hz : float, optional
        Sample rate in Hz of recordings that have neither `time_s` nor a rate.
    depth : int, default 4
        Largest number of effects that are named together, at least 1.
    seed : int, default 1
        Seed of the random resampling from which intervals are computed.
    threads : int, default 0
        Number of threads for the computation, as in `diagnose`.
    progress : callable, optional
        Function that is called with a short text at each step.

    Returns
    -------
    Diagnosis
        `Diagnosis.compared` holds the numbers, and `Diagnosis.report` the report with its figures. Its `fix` cannot be run.

    Raises
    ------
    StretchError
        If the recordings show no common motion or cannot be compared. The message says what to do.

    Warns
    -----
    DoubtWarning
        If samples count as lost because a column has no number there (code `missing_samples`), or if the time stamps seem to
        be in milliseconds (`slow_clock`).

    Examples
    --------
    The second recorder is 35 ms late, and has another gain.

    >>> import numpy as np
    >>> import stretch_gap
    >>> time_s = np.arange(0, 60, 0.01)
    >>> angle = lambda t: 20 * np.sin(1.3 * t) + 10 * np.sin(3.1 * t)
    >>> noise = 0.05 * np.random.default_rng(0).normal(size=(2, time_s.size))
    >>> a = {"time_s": time_s, "angle_deg": angle(time_s) + noise[0]}
    >>> b = {"time_s": time_s, "angle_deg": 1.7 * angle(time_s - 0.035) + noise[1]}
    >>> found = stretch_gap.compare(a, b)
    >>> found.verdict, round(found.compared[0]["gain"]["value"], 2), round(found.compared[0]["delay_s"]["value"], 3)
    ('parameters', 1.7, 0.035)
    """
    both = []
    for data, name in ((a, "a"), (b, "b")):
        trials = entries.trials(data, rate_hz)
        if len(trials) != 1:
            raise StretchError(f"{name} holds {len(trials)} recordings; give one recording")
        columns = [column for column in trials[0].columns if column not in entries.CLOCKS]
        recording, *_ = entries.recorded(trials, rate_hz, columns)[0]
        both.append({**recording, "name": trials[0].name or name})
    first, second = both
    checked = _stretch.Problem.compared(first, second, entries.texts("signal", signal))
    how = {
        "name": " and ".join(one["name"] for one in both),
        "depth": entries.whole("depth", depth, 1),
        "seed": entries.whole("seed", seed, 0),
        "threads": entries.whole("threads", threads, 0),
        "budget": None,
        "batch": 1,
        "answers_all": False,
        "takes_inputs": True,
        "experiment": False,
    }
    return run(checked, json.loads(checked.session), None, how, progress, [], {}, {})
