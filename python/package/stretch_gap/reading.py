"""Recordings from files.

The native module reads text, also compressed with gzip. Any other format is read by the library of its maintainers, which is an
extra of this package. The result is a set of named arrays. The reader of NPZ files in the native module then decides which
arrays are clocks, and resamples the channels to one clock. A file written by `convert` therefore gives the program `stretch`
the same data as `read` gives here.
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
from .arrays import Arrays
from .frames import frame
from .recordings import Array

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
"""Offset and bytes by which a format is recognised, and the reader of the format."""


class Recording(Mapping[str, Array]):
    """Recording read from a file: a mapping from column names to arrays on one clock.

    `read` returns this class. All columns, `time_s` among them, have the shape `(samples,)`. A clock is a series of time stamps
    that columns share. Functions that take a dict of columns also take a `Recording`.

    Attributes
    ----------
    name : str
        Name of the file.
    clocks : dict of str to dict of str to ndarray
        Data before the resampling, by clock: the time stamps `time_s` of the clock, and its columns.
    notes : list of str
        Sentences on what was guessed, renamed, resampled or left out.

    Examples
    --------
    >>> import pathlib
    >>> import tempfile
    >>> import stretch_gap
    >>> folder = tempfile.TemporaryDirectory()
    >>> path = pathlib.Path(folder.name, "run.csv")
    >>> _ = path.write_text(chr(10).join(["time_s,length_mm", *(f"{i / 100},{165 + i / 8}" for i in range(60))]))
    >>> recording = stretch_gap.read(path)
    >>> list(recording), recording.name
    (['time_s', 'length_mm'], 'run.csv')
    >>> folder.cleanup()
    """

    def __init__(self, name: str, columns: dict[str, Array], clocks: dict[str, dict[str, Array]], notes: Sequence[str]) -> None:
        self.name = name
        self.clocks = clocks
        self.notes = list(notes)
        self._columns = columns

    def __getitem__(self, column: str) -> Array:
        return self._columns[column]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    @property
    def time_s(self) -> Array:
        """Time stamps of the samples, ndarray of shape `(samples,)`, in seconds."""
        return self._columns["time_s"]

    @property
    def units(self) -> dict[str, str]:
        """Units by column, dict of str to str, from the last part of each name. Empty if the name has no unit."""
        return {column: _stretch.unit_of(column) for column in self._columns}

    def to_frame(self) -> Any:
        """Return the columns as a table with one row for each sample.

        Returns
        -------
        pandas.DataFrame or dict of str to list
            The table. A dict of columns if pandas is not installed.

        Examples
        --------
        >>> [float(x) for x in recording.to_frame()["length_mm"][:2]]
        [165.0, 165.125]
        """
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
    """Read a recording from a file.

    The format is recognised by the first bytes of the file: text in any dialect (also compressed with gzip), NPY, NPZ, MCAP,
    ROS 1 and ROS 2 bags, MAT, HDF5 or Parquet. Formats other than text and NumPy need an extra, such as `stretch-gap[ros]`.

    Each topic, group or structure with its own time is a clock. Columns on several clocks are resampled by linear interpolation
    to the fastest of these clocks, or to an even grid, within the time that all of them cover. Nothing is extrapolated.

    Parameters
    ----------
    path : str or path-like
        File to read, or the folder of a ROS 2 bag. `"FILE#3"` reads episode 3 of a LeRobot data set.
    columns : sequence of str, optional
        Required columns. Only the clocks of these columns are used. A column can be named by the last part of its path if only
        one path has this ending. By default all columns and clocks are used.
    time : str, default "time_s"
        Column or array of the time. Its unit may follow, as in `"stamp:ms"`, and the order of dates, as in `"date:dmy"`. If there
        is no column `time_s`, usual names for a time are recognised as well.
    rate_hz : float, optional
        Sample rate in Hz. It replaces a time column in the file. Required if the file has neither a time nor a rate.
    grid_hz : float, optional
        Rate in Hz of an even grid to which all columns are resampled.

    Returns
    -------
    Recording
        Columns on one clock, with their units and notes on what was guessed or left out.

    Raises
    ------
    StretchError
        If the file cannot be read, if a column is missing, if there is no time, or if the library of the format is not installed.

    Examples
    --------
    >>> import pathlib
    >>> import tempfile
    >>> import stretch_gap
    >>> folder = tempfile.TemporaryDirectory()
    >>> path = pathlib.Path(folder.name, "run.csv")
    >>> rows = [f"{i / 100},{165 + i / 8}" for i in range(60)]
    >>> _ = path.write_text(chr(10).join(["time_s,length_mm", *rows]))
    >>> recording = stretch_gap.read(path)
    >>> recording["length_mm"].size
    60
    >>> recording.units
    {'time_s': 's', 'length_mm': 'mm'}
    >>> folder.cleanup()
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
    """Return the named arrays of a file.

    Return None if the format is not in `READERS`, because the program then reads the file.
    """
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
    if head.startswith(b"PK") and not tables.has_arrays(file):
        return None  # the reader of the program says what the archive contains
    return next((reader for at, magic, reader in READERS if head.startswith(magic, at)), None)


def convert(path: str | os.PathLike[str], out: str | os.PathLike[str], *, force: bool = False) -> Arrays:
    """Convert a recording to an NPZ file that the program `stretch` reads.

    The NPZ file contains all clocks and columns of the recording. Nothing is resampled, except that text with several clocks is
    read as `read` reads it. If writing fails, no partial file is left.

    Parameters
    ----------
    path : str or path-like
        Recording to read, in any format of `read`.
    out : str or path-like
        File to write. Its name must end in `.npz`.
    force : bool, default False
        Whether to replace `out` if it exists.

    Returns
    -------
    stretch_gap.arrays.Arrays
        Arrays that were written (`numbers`, a dict by path), and `notes` on what was guessed or left out.

    Raises
    ------
    StretchError
        If the recording cannot be read or contains no numbers, or if `out` does not end in `.npz`, is the recording itself,
        exists although `force` is False, or cannot be written.

    Examples
    --------
    >>> import pathlib
    >>> import tempfile
    >>> import stretch_gap
    >>> folder = tempfile.TemporaryDirectory()
    >>> path = pathlib.Path(folder.name, "run.csv")
    >>> rows = [f"{i / 100},{165 + i / 8}" for i in range(60)]
    >>> _ = path.write_text(chr(10).join(["time_s,length_mm", *rows]))
    >>> written = stretch_gap.convert(path, path.with_suffix(".npz"))
    >>> list(written.numbers)
    ['time_s', 'length_mm']
    >>> folder.cleanup()
    """
    if Path(out).suffix != ".npz":
        raise StretchError(f"{os.fspath(out)}: the name of the output file must end in .npz")
    if Path(out).exists() and Path(out).samefile(path):
        raise StretchError(f"{os.fspath(out)}: this is the recording {os.fspath(path)} itself; choose another output file")
    if Path(out).is_file() and not force:
        raise StretchError(
            f"{os.fspath(out)}: this file exists; choose another output file, or replace it with force=True (--force)"
        )
    found = contents(path)
    if found is None:
        recording = read(path)
        found = Arrays(recording.name)
        found.numbers.update(recording)
        found.notes += recording.notes
    if not found.numbers:
        raise StretchError(f"{os.fspath(path)}: the recording contains no numbers ({'; '.join(found.notes) or 'it is empty'})")
    # A unique name, so that no other file is overwritten.
    part = Path(f"{os.fspath(out)}.{uuid.uuid4().hex}.part")
    try:
        # numpy.savez does not accept an array with the name "file".
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
