"""Writes two logs of robots into this folder, in the forms in which robots write them: the motion of plain.csv, twice.

`lerobot/` is a data set of LeRobot's version 3 (a Parquet file of two episodes, names in meta/info.json); `protobuf.mcap` holds messages with the
description of theirs. Run in an environment with the packages of versions.txt, after make.py: python robots.py
"""

import json
import pathlib

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2
from mcap_protobuf.writer import Writer

HERE = pathlib.Path(__file__).parent
EPOCH_NS = 1_714_564_800_000_000_000  # 2024-05-01T12:00:00Z

table = np.genfromtxt(HERE / "plain.csv", delimiter=",", names=True)
time_s, length_mm, bridge_v = (table[name] for name in ("time_s", "length_mm", "bridge_v"))
count = len(time_s)


def lerobot():
    """Episode 0 is the motion, episode 1 the motion backwards."""
    folder = HERE / "lerobot"
    (folder / "data" / "chunk-000").mkdir(parents=True, exist_ok=True)
    (folder / "meta").mkdir(exist_ok=True)
    both = np.concatenate([np.column_stack([length_mm, bridge_v]), np.column_stack([length_mm, bridge_v])[::-1]])
    pair = pa.list_(pa.float64(), 2)
    columns = {
        "observation.state": pa.array(both.tolist(), pair),
        "action": pa.array((both + 1.0).tolist(), pa.list_(pa.float64())),
        "timestamp": pa.array(np.concatenate([time_s, time_s])),
        "frame_index": pa.array(np.tile(np.arange(count), 2)),
        "episode_index": pa.array(np.repeat([0, 1], count)),
        "task": pa.array(["stretch"] * (2 * count)),
        "uneven": pa.array([[0.0] * (1 + i % 2) for i in range(2 * count)], pa.list_(pa.float64())),
    }
    pq.write_table(pa.table(columns), folder / "data" / "chunk-000" / "file-000.parquet", row_group_size=37)
    names = ["length_mm", "bridge_v"]
    features = {"observation.state": {"names": names}, "action": {"names": {"motors": names}}, "timestamp": {"names": None}}
    (folder / "meta" / "info.json").write_text(json.dumps({"codebase_version": "v3.0", "fps": 100, "features": features}, indent=1) + "\n")


def protobuf():
    """A message with a stamp, numbers of several kinds, names beside an array, and a message within."""
    file = descriptor_pb2.FileDescriptorProto(name="rig.proto", package="rig", syntax="proto3", dependency=[timestamp_pb2.DESCRIPTOR.name])
    inner = file.message_type.add(name="Gauge")
    inner.field.add(name="bridge_v", number=1, type=2, label=1)  # a float
    inner.field.add(name="count", number=2, type=17, label=1)  # zigzag
    outer = file.message_type.add(name="State")
    outer.field.add(name="timestamp", number=1, type=11, label=1, type_name=".google.protobuf.Timestamp")
    outer.field.add(name="length_mm", number=2, type=1, label=1)
    outer.field.add(name="gauge", number=3, type=11, label=1, type_name=".rig.Gauge")
    outer.field.add(name="name", number=4, type=9, label=3)
    outer.field.add(name="position", number=5, type=1, label=3)
    outer.field.add(name="is_moving", number=6, type=8, label=1)
    pool = descriptor_pool.DescriptorPool()
    pool.AddSerializedFile(timestamp_pb2.DESCRIPTOR.serialized_pb)
    pool.Add(file)
    state = message_factory.GetMessageClass(pool.FindMessageTypeByName("rig.State"))
    with open(HERE / "protobuf.mcap", "wb") as out, Writer(out) as writer:
        for i in range(count):
            message = state(length_mm=length_mm[i], name=["elbow", "wrist"], position=[0.5 * length_mm[i], -1.0 * i])
            own_ns = EPOCH_NS + round(1e9 * time_s[i])
            message.timestamp.seconds, message.timestamp.nanos = divmod(own_ns, 10**9)
            message.gauge.bridge_v, message.gauge.count = bridge_v[i], -i
            message.is_moving = i % 2 == 1
            writer.write_message(topic="/rig", message=message, log_time=own_ns + 3_000_000, publish_time=own_ns + 3_000_000)


lerobot()
protobuf()
