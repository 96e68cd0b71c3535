"""Readers of MATLAB files of all versions, including Simulink logs, and of HDF5. Structures and groups become paths."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ._stretch import tidy_column
from .arrays import Arrays, library, with_unit

DEEPEST = 16
"""Largest depth of nested structures that is read."""
MOST_ITEMS = 64
"""Largest number of items of a cell array or of an array of structures that is read."""


class Unread(str):
    """Placeholder of a value that is left out. The text is the reason."""


def read_mat(path: Path, found: Arrays) -> None:
    """Read a MAT file of version 5, which MATLAB writes with `save` up to the option `-v7`."""
    io = library("scipy.io", "matlab")
    try:
        variables = io.loadmat(path, simplify_cells=True)
    # SciPy has no specific exception for damaged files.
    except Exception as error:
        raise found.cannot("MAT file", error, "save it again with -v7") from error
    walk({name: value for name, value in variables.items() if not name.startswith("__")}, found, "", ".")


def read_hdf5(path: Path, found: Arrays) -> None:
    """Read an HDF5 file, or a MAT file of version 7.3, which is HDF5 with a header."""
    h5py = library("h5py", "matlab")
    try:
        with h5py.File(path, "r") as file:
            walk(Tree(h5py, file).group(file), found, "", "." if file.userblock_size else "/")
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        raise found.cannot("HDF5 file", error, "write it again, or export it as CSV") from error


def walk(value: Any, found: Arrays, path: str, separator: str, depth: int = 0) -> None:
    """Store all numbers of a value, and of the values in it, under their paths."""
    if isinstance(value, np.ndarray) and value.dtype == object:
        value = value.ravel(order="F").tolist()
    if isinstance(value, Mapping) and depth < DEEPEST:
        for name, part in _named(dict(value), path.rpartition(separator)[2]).items():
            walk(part, found, f"{path}{separator}{name}" if path else str(name), separator, depth + 1)
    elif isinstance(value, list) and len(value) <= MOST_ITEMS and depth < DEEPEST:
        for i, part in enumerate(value):
            walk(part, found, f"{path}{separator}{i}", separator, depth + 1)
    elif isinstance(value, (Mapping, list)):
        found.leave(path, f"it has {len(value)} items, or is nested too deeply")
    elif isinstance(value, Unread):
        found.leave(path, value)
    elif isinstance(value, str):
        found.leave(path, "text")
    elif hasattr(value, "toarray"):
        found.leave(path, "a sparse matrix; save full(x) instead")
    elif type(value).__name__ in ("MatlabOpaque", "MatlabFunction"):
        found.leave(path, "an object of MATLAB; save its numbers, for example [ts.Time ts.Data]")
    elif np.size(value):
        found.take(path, value)


def _named(fields: dict[Any, Any], own: str) -> dict[Any, Any]:
    """Return the fields of a structure, with the signals of a Simulink log and of a timeseries under their own names.

    A Simulink log is a "Structure With Time". `own` is the name of the structure itself.
    """
    if "signals" in fields and "time" in fields:
        signals = fields.pop("signals")
        for i, signal in enumerate(signals if isinstance(signals, list) else [signals]):
            if isinstance(signal, Mapping) and "values" in signal:
                label = signal.get("label")
                name = tidy_column(label) if isinstance(label, str) and label.strip() else f"signal_{i + 1}"
                fields[name if name not in fields else f"{name}_{i + 1}"] = signal["values"]
            else:
                fields[f"signals_{i + 1}"] = Unread("not a signal of a Simulink log")
    elif "Data" in fields and "Time" in fields:
        name = fields.pop("Name", "")
        fields[tidy_column(name) if isinstance(name, str) and name else own or "Data"] = fields.pop("Data")
    return fields


class Tree:
    """Converter of an HDF5 file: groups become dicts, arrays of structures and cells become lists, data sets become arrays."""

    def __init__(self, h5py: Any, file: Any) -> None:
        self.h5py = h5py
        self.file = file
        self.seen: set[tuple[int, int]] = set()

    def group(self, group: Any) -> Any:
        """Return a group as a dict.

        Return a list if it is an array of structures, which MATLAB stores as a group of references.
        """
        about = self.h5py.h5o.get_info(group.id)
        if (about.fileno, about.addr) in self.seen:
            return Unread("it is a link to a group that was already read")
        self.seen.add((about.fileno, about.addr))
        # Names that begin with # are reserved for MATLAB.
        parts = {name: group.get(name) for name in group if not name.startswith("#")}
        fields = [part for part in parts.values() if self.refers(part) and not _class(part)]
        if fields and len(fields) == len(parts):
            rows = {name: part[()].ravel()[: MOST_ITEMS + 1] for name, part in parts.items()}
            count = min(len(row) for row in rows.values())
            return [{name: self.value(self.file[row[i]]) for name, row in rows.items()} for i in range(count)]
        return {with_unit(name, _unit(part)): self.value(part) for name, part in parts.items()}

    def value(self, node: Any) -> Any:
        """Return the content of a node."""
        if isinstance(node, self.h5py.Group):
            return self.group(node)
        if not isinstance(node, self.h5py.Dataset):
            return Unread("a broken link")
        if "MATLAB_object_decode" in node.attrs:
            return Unread(f"an object of MATLAB's class {_class(node)}; save its numbers, for example [ts.Time ts.Data]")
        if node.attrs.get("MATLAB_empty") or not node.size:
            return []
        if self.refers(node):
            return [self.value(self.file[one]) for one in node[()].ravel()[: MOST_ITEMS + 1]]
        if _class(node) == "char":
            return "".join(chr(letter) for letter in np.ravel(node[()]))
        if self.h5py.check_string_dtype(node.dtype):
            return "text"
        return node[()]

    def refers(self, node: Any) -> bool:
        """Return whether a node contains references to other nodes."""
        return isinstance(node, self.h5py.Dataset) and self.h5py.check_ref_dtype(node.dtype) is self.h5py.Reference


def _class(node: Any) -> str:
    name = node.attrs.get("MATLAB_class", b"")
    return name.decode() if isinstance(name, bytes) else str(name)


def _unit(node: Any) -> Any:
    attributes = getattr(node, "attrs", {})
    return attributes.get("units", attributes.get("unit"))
