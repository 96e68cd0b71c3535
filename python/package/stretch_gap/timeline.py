"""Export of the curves of a diagnosis to the Rerun viewer."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

import numpy as np

from ._stretch import StretchError
from .outputs import replaceable
from .recordings import Array

CURVES = ("measured", "as_shipped", "retuned", "with_effects")


def write(
    path: str | os.PathLike[str],
    curves: Mapping[str, Sequence[Array]],
    spans: Sequence[tuple[str, int, float]],
    dt_s: float,
    sentence: str,
) -> None:
    """Write a Rerun recording with the measured curve, the simulated curves and their residuals for each trial and output.

    The curves hold all trials end to end. `spans` gives the name, the number of samples and the start in the session (s) of
    each trial.
    """
    try:
        import rerun  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError:
        raise StretchError("the package rerun-sdk is not installed; run pip install rerun-sdk") from None
    stream = rerun.RecordingStream("stretch")
    stream.save(replaceable(path, ".rrd"))
    stream.log("diagnosis", rerun.TextDocument(sentence), static=True)
    first = 0
    for trial, samples, start_s in spans:
        time_s = start_s + dt_s * np.arange(samples)
        for output, four in curves.items():
            part = {name: np.asarray(values)[first : first + samples] for name, values in zip(CURVES, four)}
            left = {f"left/{name}": part["measured"] - part[name] for name in CURVES[1:]}
            for name, values in {**part, **left}.items():
                entity = "/".join(rerun.escape_entity_path_part(p) for p in (trial, output, *name.split("/")))
                stream.send_columns(
                    entity,
                    indexes=[rerun.TimeColumn("session", duration=time_s)],
                    columns=rerun.Scalars.columns(scalars=values),
                )
        first += samples
    stream.flush()
