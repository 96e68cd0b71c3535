"""Readers of Parquet files, LeRobot data sets among them, and of NumPy files."""

from __future__ import annotations

import json
import re
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from .arrays import Arrays, library, with_unit

EPISODE = "episode_index"
"""Column of LeRobot tables with the number of the episode of each row."""


def file_of(path: Path) -> Path:
    """Return the path without the number of an episode: `FILE#3` is episode 3 of `FILE`."""
    return path if path.exists() else Path(re.sub(r"#\d+$", "", str(path)))


def has_arrays(path: Path) -> bool:
    """Return whether a ZIP archive is complete and contains arrays of NumPy."""
    try:
        with zipfile.ZipFile(path) as archive:
            return any(name.endswith(".npy") for name in archive.namelist())
    except (OSError, zipfile.BadZipFile):
        return False


def read_numpy(path: Path, found: Arrays) -> None:
    """Read an NPY or NPZ file. Arrays of objects are left out."""
    try:
        held = np.load(path, allow_pickle=False)
        if isinstance(held, np.ndarray):
            found.take("" if held.dtype.names else "column_0", held)
            return
        names = held.files
    except (OSError, ValueError, EOFError) as error:
        raise found.cannot("NumPy file", error, "save it again with numpy.savez") from error
    with held:
        for name in names:
            try:
                found.take(name, held[name])
            except ValueError as error:
                found.leave(name, str(error))


def read_parquet(path: Path, found: Arrays) -> None:
    """Read columns of numbers, of time stamps, and of lists of equal length.

    From a table of several episodes, read one episode.
    """
    pyarrow, parquet = library("pyarrow", "parquet"), library("pyarrow.parquet", "parquet")
    file = file_of(path)
    try:
        table = parquet.ParquetFile(file).read()
    except (pyarrow.ArrowException, OSError) as error:
        raise found.cannot("Parquet file", error, "write it again, or export it as CSV") from error
    asked = int(str(path).rpartition("#")[2]) if file != path else None
    table = _episode(table, asked, found)
    features = _features(file)
    for field, column in zip(table.schema, table.columns):
        name = with_unit(field.name, (field.metadata or {}).get(b"units", (field.metadata or {}).get(b"unit")))
        values = _numbers(pyarrow.types, field.type, column)
        if values is None:
            found.leave(field.name, "no numbers, or lists of several lengths")
        elif values.ndim == 2:
            names = features.get(field.name, [])
            for i, item in enumerate(values.T):
                found.take(f"{name}.{names[i] if i < len(names) else i}", item)
        else:
            found.take(name, values)


def _numbers(types: Any, kind: Any, column: Any) -> Any:
    """Return the values of a column, with NaN for missing values. Return None if the column does not contain numbers."""
    if types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind):
        lengths = set(column.combine_chunks().value_lengths().to_pylist())
        inner = _numbers(types, kind.value_type, column.combine_chunks().flatten())
        return inner.reshape(len(column), -1) if len(lengths) == 1 and inner is not None and None not in lengths else None
    if types.is_timestamp(kind):
        return np.asarray(column.cast("timestamp[ns]")).astype("datetime64[ns]")
    if types.is_boolean(kind):
        column = column.cast("uint8")
    elif not (types.is_integer(kind) or types.is_floating(kind)):
        return None
    return np.asarray(column.cast("float64", safe=False))


def _episode(table: Any, asked: int | None, found: Arrays) -> Any:
    """Return the requested episode of a table, or else the first episode."""
    if EPISODE not in table.column_names:
        if asked is not None:
            raise found.cannot("Parquet file", f"there is no column {EPISODE}", "leave the # and what follows out")
        return table
    episodes = np.asarray(table[EPISODE])
    least, most = int(episodes.min()), int(episodes.max())
    wanted = int(episodes[0]) if asked is None else asked
    if wanted not in episodes:
        raise found.cannot("Parquet file", f"there is no episode {wanted} in it", f"it holds {least} to {most}")
    if asked is None and most > least:
        found.notes.append(f"it holds the episodes {least} to {most}, and {wanted} is read; FILE#{most} reads another")
    return table.filter(episodes == wanted)


def _features(file: Path) -> dict[str, list[str]]:
    """Return the names of the items of LeRobot columns, from `meta/info.json` above `data/chunk-000/file.parquet`."""
    try:
        features = json.loads((file.resolve().parents[2] / "meta" / "info.json").read_text(encoding="utf-8"))["features"]
        named = {key: feature.get("names") for key, feature in features.items()}
    except (OSError, ValueError, LookupError, AttributeError, TypeError):
        return {}
    # The names are a list, or a dict with one list under a key such as `motors`.
    lists = {key: next(iter(names.values()), None) if isinstance(names, dict) else names for key, names in named.items()}
    return {key: [str(name) for name in names] for key, names in lists.items() if isinstance(names, list)}
