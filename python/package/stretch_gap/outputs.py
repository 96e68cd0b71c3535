"""Check of output paths: a result never replaces a file of another kind."""

from __future__ import annotations

import os
from pathlib import Path

from ._stretch import StretchError


def replaceable(path: str | os.PathLike[str], *endings: str) -> str:
    """Check that a result may be written to a path, and return the path as text.

    An existing file is replaced only if its name has one of the `endings`. A result can therefore replace an earlier result,
    but never a recording, a simulator or a notebook. For any other existing file a `StretchError` is raised.
    """
    if Path(path).is_file() and Path(path).suffix not in endings:
        wanted = " or ".join(endings)
        raise StretchError(
            f"{os.fspath(path)}: this file is not replaced, because its name does not end in {wanted}; choose another name"
        )
    return os.fspath(path)
