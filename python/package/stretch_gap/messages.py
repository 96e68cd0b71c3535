"""Readers of MCAP files and ROS bags. Each topic is a clock, and each number in its messages is a column."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .arrays import Arrays, library, listed
from .recordings import Array

LONGEST = 64
"""Length of the longest array whose numbers become columns. Images and scans are longer."""
STAMPS = (
    ("header.stamp.sec", "header.stamp.nanosec"),
    ("header.stamp.sec", "header.stamp.nsec"),
    ("stamp.sec", "stamp.nanosec"),
    ("timestamp.sec", "timestamp.nsec"),
    ("header.stamp.seconds", "header.stamp.nanos"),
    ("stamp.seconds", "stamp.nanos"),
    ("timestamp.seconds", "timestamp.nanos"),
    ("time.seconds", "time.nanos"),
)
"""Fields with the time of measurement inside a message: seconds, and nanoseconds of the same stamp."""

Decode = Callable[[], Any]


class Topic:
    """Columns of one topic. Each message adds one row; a number that is missing in a message is NaN."""

    def __init__(self) -> None:
        self.logged_ns: list[int] = []
        self.columns: dict[str, list[float]] = {}
        self.texts: dict[str, str] = {}

    def take(self, logged_ns: int, message: Any) -> None:
        """Add a message that was logged at the given time, in nanoseconds."""
        row = len(self.logged_ns)
        for path, value in leaves(message):
            if isinstance(value, str):
                if row == 0:
                    self.texts[path] = value
                continue
            column = self.columns.setdefault(path, [])
            column += [float("nan")] * (row - len(column)) + [value]
        self.logged_ns.append(logged_ns)

    def arrays(self) -> dict[str, Array]:
        """Return the columns, all of the same length.

        Items of arrays are named as in the first message, for example by the joints.
        """
        rows, named = len(self.logged_ns), {}
        for path, values in self.columns.items():
            array, _, item = path.rpartition(".")
            group, dot, _ = array.rpartition(".")
            name = self.texts.get(f"{group}{dot}name.{item}") if array and item.isdigit() else None
            named[f"{array}.{name}" if name else path] = np.array(values + [float("nan")] * (rows - len(values)))
        return named


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, float | str]]:
    """Yield the numbers and texts of a message, each with its path."""
    if isinstance(value, (bool, int, float, np.number, np.bool_)):
        yield path, float(value)
    elif isinstance(value, str):
        yield path, value
    elif value is not None and not isinstance(value, (bytes, bytearray, memoryview)):
        for name, part in _parts(value):
            yield from leaves(part, f"{path}.{name}" if path else str(name))


def _parts(value: Any) -> Iterator[tuple[Any, Any]]:
    if isinstance(value, Mapping):
        yield from value.items()
    elif isinstance(value, (Sequence, np.ndarray)):
        if len(value) <= LONGEST:
            yield from enumerate(value)
    elif hasattr(value, "DESCRIPTOR"):  # protobuf; an absent message has no numbers
        for field in value.DESCRIPTOR.fields:
            if not (field.message_type and field.has_presence) or value.HasField(field.name):
                yield field.name, getattr(value, field.name)
    else:
        fields: Sequence[str] = tuple(getattr(value, "__dataclass_fields__", ())) or getattr(value, "__slots__", ())
        for name in fields:
            yield name, getattr(value, name)


def read_mcap(path: Path, found: Arrays) -> None:
    """Read an MCAP file with messages in JSON, in protobuf, or in CDR with `ros2msg` schemas (ROS 2)."""
    reader = library("mcap.reader", "ros")
    factories = [library(f"mcap_{kind}.decoder", "ros").DecoderFactory() for kind in ("ros2", "protobuf")]
    decoders: dict[int, Callable[[bytes], Any]] = {}

    def decoded(schema: Any, channel: Any, message: Any) -> Any:
        if channel.id not in decoders:
            ways = [json.loads] if channel.message_encoding == "json" else []
            ways += filter(None, (one.decoder_for(channel.message_encoding, schema) for one in factories))
            if not ways:
                raise ValueError(f"{channel.message_encoding} with a schema in {schema.encoding if schema else 'nothing'}")
            decoders[channel.id] = ways[0]
        return decoders[channel.id](message.data)

    with path.open("rb") as stream:
        rows = reader.NonSeekingReader(stream).iter_messages(log_time_order=False)
        every = ((row[1].topic, row[2].log_time, partial(decoded, *row)) for row in rows)
        take(every, found, "MCAP file", "record it again, or try `mcap recover`")


def read_bag(path: Path, found: Arrays) -> None:
    """Read a ROS 2 bag (file or folder) or a ROS 1 bag.

    If a bag does not define its messages, those of ROS 2 Humble are assumed.
    """
    typesys, reader = library("rosbags.typesys", "ros"), library("rosbags.highlevel", "ros")

    def rows() -> Iterator[tuple[str, int, Decode]]:
        with reader.AnyReader([path], default_typestore=typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)) as bag:
            for connection, logged_ns, raw in bag.messages():
                yield connection.topic, logged_ns, partial(bag.deserialize, raw, connection.msgtype)

    take(rows(), found, "ROS bag", "copy it again, or try `ros2 bag reindex`")


def take(rows: Iterator[tuple[str, int, Decode]], found: Arrays, what: str, todo: str) -> None:
    """Store all messages. A topic with an unreadable message is left out. A truncated file is read up to its end."""
    topics: dict[str, Topic] = {}
    unread: dict[str, str] = {}
    count = 0
    while True:
        try:
            topic, logged_ns, decode = next(rows)
        except StopIteration:
            break
        # The libraries raise exceptions of many classes, including those of their own dependencies.
        except Exception as error:
            if not count:
                raise found.cannot(what, error or type(error).__name__, todo) from error
            found.notes.append(
                f"the file breaks off after {count} messages ({error or type(error).__name__}); only these are read"
            )
            break
        count += 1
        if topic in unread:
            continue
        try:
            topics.setdefault(topic, Topic()).take(logged_ns, decode())
        except Exception as error:
            unread[topic] = " ".join(str(error).split()) or type(error).__name__
            topics.pop(topic, None)
    for topic, why in sorted(unread.items()):
        found.leave(topic, why)
    if not topics:
        why = listed([f"{topic} ({why})" for topic, why in sorted(unread.items())])
        raise found.cannot(what, f"no topic can be read: {why}" if why else "the file contains no messages", todo)
    _as_arrays(topics, found)


def _as_arrays(topics: dict[str, Topic], found: Arrays) -> None:
    stamped, doubled = [], []
    for name, topic in sorted(topics.items()):
        columns, stamps_ns = topic.arrays(), np.array(topic.logged_ns, dtype=np.int64)
        own_ns = _own_stamps(columns)
        if own_ns is not None:
            stamped.append(name)
            stamps_ns = own_ns
        rising, first = np.unique(stamps_ns, return_index=True)
        if rising.size < stamps_ns.size:
            doubled.append(f"{name} ({stamps_ns.size - rising.size})")
        path = name.strip("/") or "messages"
        found.take_stamps(f"{path}.time_s", rising)
        for column, values in columns.items():
            # The name `time_s` is used for the clock.
            column = "time_s.value" if column == "time_s" else column
            found.take(f"{path}.{column}" if column else path, values[first])
    if stamped:
        found.notes.append(f"the time is taken from the stamps in the messages: {listed(stamped)}")
    if doubled:
        found.notes.append(f"messages with the same stamp as an earlier message are left out: {listed(doubled)}")


def _own_stamps(columns: dict[str, Array]) -> np.ndarray[Any, np.dtype[np.int64]] | None:
    """Return the stamps in the messages, ns, if most of them increase, and remove their columns. Otherwise return None."""
    for pair in STAMPS:
        if all(name in columns and np.isfinite(columns[name]).all() for name in pair):
            seconds, nanoseconds = (columns[name].astype(np.int64) for name in pair)
            stamps = seconds * 1_000_000_000 + nanoseconds
            if 2 * np.count_nonzero(np.diff(stamps) > 0) > stamps.size:
                for name in pair:
                    del columns[name]
                return stamps
    return None
