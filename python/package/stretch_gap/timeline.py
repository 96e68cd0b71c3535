"""The curves of a diagnosis on the time line of Rerun's viewer."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ._stretch import StretchError
from .outputs import replaceable

Array = NDArray[np.float64]
CURVES = ("measured", "as_shipped", "retuned", "with_effects")


def write(
    path: str | os.PathLike[str],
    curves: Mapping[str, Sequence[Array]],
    spans: Sequence[tuple[str, int, float]],
    dt_s: float,
    sentence: str,
) -> None:
    """Writes a recording of Rerun: by trial and output the measured curve, the simulated ones, and what is left of each.

    `spans` are name, samples and session time, s, of the trials that follow each other in the curves.
    """
    try:
        import rerun  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError:
        raise StretchError("the package rerun-sdk is not installed; pip install rerun-sdk") from None
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
