"""Files that are written, and what they may replace."""

from __future__ import annotations

import os
from pathlib import Path

from ._stretch import StretchError


def replaceable(path: str | os.PathLike[str], *endings: str) -> str:
    """Checks that a result may be written to a path, and returns the path as text.

    A file that exists is replaced only if its name has one of these endings. So a result replaces an earlier result, but never a
    recording, a simulator or a notebook. Any other file is refused with a `StretchError`.
    """
    if Path(path).is_file() and Path(path).suffix not in endings:
        wanted = " or ".join(endings)
        raise StretchError(f"{os.fspath(path)}: it is a file of another kind; name one to write that ends in {wanted}")
    return os.fspath(path)
