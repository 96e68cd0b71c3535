"""Files that are written, and what they may replace."""

from __future__ import annotations

import os
from pathlib import Path

from ._stretch import StretchError


def replaceable(path: str | os.PathLike[str], *endings: str) -> str:
    """A path to write to, as text: what is there is nothing, or a file with one of these endings, which an earlier run wrote. A
    `StretchError` otherwise: a recording, a simulator or a notebook is not replaced by a result."""
    if Path(path).is_file() and Path(path).suffix not in endings:
        wanted = " or ".join(endings)
        raise StretchError(f"{os.fspath(path)}: it is a file of another kind; name one to write that ends in {wanted}")
    return os.fspath(path)
