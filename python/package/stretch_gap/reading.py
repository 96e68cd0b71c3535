"""Recordings from files.

The program's own reader takes text and gzip. Every other format is read by the library that its owners keep, an extra of this
package. Whatever was read becomes named arrays; which of them are clocks, and how channels on several clocks come to one, is
decided by the program's reader of NPZ files. So a file that `convert` wrote gives the program what `read` gives here.
"""

from __future__ import annotations

import os
import uuid
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import _stretch, matlab, messages, tables
from ._stretch import StretchError
from .arrays import Array, Arrays
from .frames import frame

HDF5 = b"\x89HDF\r\n\x1a\n"
READERS: tuple[tuple[int, bytes, Callable[[Path, Arrays], None]], ...] = (
    (0, b"\x89MCAP0\r\n", messages.read_mcap),
    (0, b"SQLite format 3\0", messages.read_bag),
    (0, b"#ROSBAG", messages.read_bag),
    (0, HDF5, matlab.read_hdf5),
    (512, HDF5, matlab.read_hdf5),
    (0, b"MATLAB 5.0 MAT-file", matlab.read_mat),
    (124, b"\x00\x01IM", matlab.read_mat),
    (124, b"\x01\x00MI", matlab.read_mat),
    (0, b"PAR1", tables.read_parquet),
    (0, b"\x93NUMPY", tables.read_numpy),
    (0, b"PK\x03\x04", tables.read_numpy),
)
"""The layout of a file of a format, and its reader."""


class Recording(Mapping[str, Array]):
    """Columns on one clock, `time_s` among them. Every function of the package that takes a dict of columns takes it."""

    def __init__(self, name: str, columns: dict[str, Array], clocks: dict[str, dict[str, Array]], notes: Sequence[str]) -> None:
        self.name = name
        """Name of the file."""
        self.clocks = clocks
        """The same before it was brought to one clock: for each clock of the file its instants, `time_s`, and its columns."""
        self.notes = list(notes)
        """What was guessed, renamed, resampled or left out."""
        self._columns = columns

    def __getitem__(self, column: str) -> Array:
        return self._columns[column]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    @property
    def time_s(self) -> Array:
        """The instants, s."""
        return self._columns["time_s"]

    @property
    def units(self) -> dict[str, str]:
        """The unit of each column, from the last part of its name; empty where the name has none."""
        return {column: _stretch.unit_of(column) for column in self._columns}

    def to_frame(self) -> Any:
        """The columns as a pandas frame; a dict of lists where there is no pandas."""
        return frame([dict(zip(self._columns, row)) for row in zip(*self._columns.values())])

    def __repr__(self) -> str:
        columns = ", ".join(column for column in self._columns if column != "time_s")
        clocks = f", from {len(self.clocks)} clocks" if len(self.clocks) > 1 else ""
        return f"<Recording {self.name}: {self.time_s.size} samples of {columns}{clocks}>"


def read(
    path: str | os.PathLike[str],
    columns: Sequence[str] | None = None,
    *,
    time: str = "time_s",
    rate_hz: float | None = None,
    grid_hz: float | None = None,
) -> Recording:
    """Reads a recording: text in any dialect, NPY, NPZ, MCAP, ROS bags, MAT, HDF5, Parquet, any of which its first bytes tell.

    Each topic, group or structure with its own time is a clock. Channels on several clocks are brought to that of the
    fastest, or to a grid of `grid_hz`, by straight lines and within the time that all of them cover. With `columns` only the
    clocks of these count; a column is found by the last part of its path where only one ends so. `time` is the column or
    array of the time where it has an unusual name. `rate_hz` is for recordings without any time.
    """
    how = {"columns": list(columns or ()), "time": time, "rate_hz": rate_hz, "grid_hz": grid_hz}
    found = contents(path)
    if found is None:
        made, notes = _stretch.read_file(os.fspath(path), how)
        clocks = [(time, made)]
    else:
        given = [(name, list(a.shape), a.astype(np.float64).ravel()) for name, a in found.numbers.items()]
        made, clocks, notes = _stretch.read_arrays(os.fspath(path), given, found.notes, how)
    return Recording(Path(path).name, dict(made), {name: dict(one) for name, one in clocks}, notes)


def contents(path: str | os.PathLike[str]) -> Arrays | None:
    """The named arrays of a file; None of a table of text, which is none of those formats."""
    file = Path(path)
    found = Arrays(os.fspath(path))
    if (file / "metadata.yaml").is_file():
        messages.read_bag(file, found)
    elif reader := _reader(tables.file_of(file)):
        reader(file, found)
    else:
        return None
    found.finish()
    return found


def _reader(file: Path) -> Callable[[Path, Arrays], None] | None:
    try:
        with file.open("rb") as stream:
            head = stream.read(520)
    except OSError as error:
        raise StretchError(f"{file}: cannot open it: {error.strerror}") from None
    return next((reader for at, magic, reader in READERS if head.startswith(magic, at)), None)


def convert(path: str | os.PathLike[str], out: str | os.PathLike[str], *, force: bool = False) -> Arrays:
    """Writes what a file holds as an NPZ file that the program reads, with all its clocks; gives what was written. A file that is
    there is a recording, which only `force` replaces."""
    if Path(out).suffix != ".npz":
        raise StretchError(f"{os.fspath(out)}: the name of what is written must end in .npz")
    if Path(out).exists() and Path(out).samefile(path):
        raise StretchError(f"{os.fspath(out)}: it is {os.fspath(path)}, which is read; name another file to write")
    if Path(out).is_file() and not force:
        raise StretchError(f"{os.fspath(out)}: it is a recording that is there; name another file, or replace it with force")
    found = contents(path)
    if found is None:
        recording = read(path)
        found = Arrays(recording.name)
        found.numbers.update(recording)
        found.notes += recording.notes
    if not found.numbers:
        raise StretchError(f"{os.fspath(path)}: there are no numbers in it ({'; '.join(found.notes) or 'it is empty'})")
    # a name that no other file has
    part = Path(f"{os.fspath(out)}.{uuid.uuid4().hex}.part")
    try:
        # numpy.savez takes no array that is called "file"
        with zipfile.ZipFile(part, "x") as archive:
            for name, values in found.numbers.items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                    np.lib.format.write_array(member, np.asarray(values), allow_pickle=False)
        part.replace(out)
    except OSError as error:
        raise StretchError(f"{os.fspath(out)}: cannot write it: {error.strerror}") from None
    finally:
        part.unlink(missing_ok=True)
    return found
