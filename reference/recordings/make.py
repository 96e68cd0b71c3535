"""Writes the recordings in this folder with the tools that people write them with.

One motion, made here: 60 samples at 100 Hz of length_mm and bridge_v, and a pressure_kpa at 25 Hz on a clock of its own.
Run in an environment with the packages of versions.txt: python make.py
"""

import gzip
import importlib.metadata as metadata
import json
import math
import pathlib
import sys

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.io
from mcap.writer import Writer
from mcap_ros2.writer import Writer as Ros2Writer

HERE = pathlib.Path(__file__).parent
N = 60
EPOCH_NS = 1_714_564_800_000_000_000  # 2024-05-01T12:00:00Z

time_s = np.arange(N) / 100
length_mm = np.round(165 + 14 * np.cos(3 * time_s), 3)
bridge_v = np.round(1.24 + 0.033 * (180 - length_mm), 5)
slow_t = 0.05 + np.arange(12) / 25
pressure_kpa = np.round(200 + 100 * slow_t, 2)


def csv(path, text):
    (HERE / path).write_text(text, encoding="utf-8", newline="")


def rows(separator, head, numbers, form=lambda x: repr(float(x))):
    lines = [separator.join(head)] + [separator.join(form(x) for x in row) for row in numbers]
    return "\n".join(lines) + "\n"


table = np.column_stack([time_s, length_mm, bridge_v])
plain = rows(",", ["time_s", "length_mm", "bridge_v"], table)
csv("plain.csv", plain)
with gzip.GzipFile(HERE / "packed.csv.gz", "wb", mtime=0) as out:
    out.write(plain.encode())

np.save(HERE / "matrix.npy", table)
fields = [("time_s", "<f8"), ("length_mm", "<f8"), ("bridge_v", "<f4")]
np.save(HERE / "fields.npy", np.array([tuple(row) for row in table], dtype=fields))
np.savez(
    HERE / "two_clocks.npz",
    t=time_s,
    length_mm=length_mm,
    bridge_v=bridge_v,
    pressure_t=slow_t,
    pressure_kpa=pressure_kpa,
    operator=np.array(["somebody"]),
)
np.savez_compressed(
    HERE / "stamps.npz",
    time=np.datetime64(EPOCH_NS, "ns") + (np.round(time_s * 1e9)).astype("timedelta64[ns]"),
    both=np.asfortranarray(np.column_stack([length_mm, bridge_v])),
)

scipy.io.savemat(HERE / "plain.mat", {"t": time_s, "length_mm": length_mm, "bridge_v": bridge_v})
scipy.io.savemat(
    HERE / "structure.mat",
    {
        "log": {
            "t": time_s.reshape(-1, 1),
            "length_mm": length_mm.astype(np.float32),
            "bridge_v": bridge_v,
            "note": "Monday",
        },
        "code": np.arange(N, dtype=np.int16),
        "pressure": {"t": slow_t, "pressure_kpa": pressure_kpa},
    },
    do_compression=True,
)

with h5py.File(HERE / "groups.h5", "w", libver="earliest", track_order=False) as out:
    for group, values in {
        "gauge": {"time_s": time_s, "length_mm": length_mm, "bridge_v": bridge_v},
        "pressure": {"time_s": slow_t, "pressure_kpa": pressure_kpa},
    }.items():
        for name, value in values.items():
            packed = {"compression": "gzip", "shuffle": True} if name == "length_mm" else {}
            out.create_dataset(f"{group}/{name}", data=value, track_times=False, **packed)
    out["note"] = "Monday"

# MATLAB 7.3 is HDF5 behind a header of 512 bytes.
with h5py.File(HERE / "seven_three.mat", "w", userblock_size=512, libver="earliest") as out:
    for name, value in {"t": time_s, "length_mm": length_mm, "bridge_v": bridge_v}.items():
        out.create_dataset(f"log/{name}", data=value.reshape(1, -1), track_times=False)
with open(HERE / "seven_three.mat", "r+b") as out:
    out.write(b"MATLAB 7.3 MAT-file, made by make.py".ljust(124) + b"\x00\x02IM")

columns = {
    "time": pa.array(EPOCH_NS // 1000 + (time_s * 1e6).round().astype("int64"), pa.timestamp("us", tz="UTC")),
    "length_mm": pa.array(length_mm),
    "bridge_v": pa.array(bridge_v, pa.float32()),
    "count": pa.array(range(N), pa.int32()),
    "on": pa.array([k % 2 == 0 for k in range(N)]),
    "holes": pa.array([None if k == 7 else float(k) for k in range(N)]),
    "word": pa.array(["a"] * N),
}
for packing in ["snappy", "zstd", "gzip", "lz4"]:
    pq.write_table(pa.table(columns), HERE / f"{packing}.parquet", compression=packing, row_group_size=25)


def json_mcap(path, topics):
    with open(HERE / path, "wb") as out:
        writer = Writer(out)
        writer.start(profile="", library="make.py")
        for topic, (times, message) in topics.items():
            schema = writer.register_schema(
                name=topic.strip("/"), encoding="jsonschema", data=b'{"type":"object"}'
            )
            channel = writer.register_channel(topic=topic, message_encoding="json", schema_id=schema)
            for k, t in enumerate(times):
                stamp = EPOCH_NS + round(t * 1e9)
                data = json.dumps(message(k)).encode()
                writer.add_message(channel_id=channel, log_time=stamp, publish_time=stamp, data=data)
        writer.finish()


json_mcap(
    "json.mcap",
    {
        "/gauge": (
            time_s,
            lambda k: {"length_mm": float(length_mm[k]), "bridge_v": float(bridge_v[k]), "unit": "mm"},
        ),
        "/pressure": (slow_t, lambda k: {"pressure_kpa": float(pressure_kpa[k]), "valves": [1, 0]}),
    },
)

HEADER = """
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec"""
JOINTS = (
    "# joints\nuint8 MODE=3\nstd_msgs/Header header\n\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort"
    + HEADER
)
GAUGE = "std_msgs/Header header\nbool ok\nint16 code\nfloat32 bridge_v\nfloat64[3] axes\nstring<=8 note\nuint8[] image" + HEADER


def header(t):
    stamp = EPOCH_NS + round(t * 1e9)
    return {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": "base"}


with open(HERE / "ros2.mcap", "wb") as out:
    writer = Ros2Writer(out)
    joints = writer.register_msgdef("sensor_msgs/msg/JointState", JOINTS)
    gauge = writer.register_msgdef("rig_msgs/msg/Gauge", GAUGE)
    for k, t in enumerate(time_s):
        late = EPOCH_NS + round(t * 1e9) + 2_000_000 + 1000 * (k % 7)
        writer.write_message(
            topic="/joint_states",
            schema=joints,
            message={
                "header": header(t),
                "name": ["elbow", "wrist"],
                "position": [float(length_mm[k]), math.sin(k)],
                "velocity": [],
                "effort": [],
            },
            log_time=late,
            publish_time=late,
        )
        writer.write_message(
            topic="/gauge",
            schema=gauge,
            message={
                "header": header(t + 0.005),
                "ok": True,
                "code": -k,
                "bridge_v": float(bridge_v[k]),
                "axes": [1.0, 2.0, float(k)],
                "note": "abc"[: k % 4],
                "image": bytes(range(100)),
            },
            log_time=late + 5_000_000,
            publish_time=late,
        )
    writer.finish()

tools = ["numpy", "scipy", "h5py", "pyarrow", "mcap", "mcap-ros2-support"]
lines = [f"python {sys.version.split()[0]}"] + [f"{tool} {metadata.version(tool)}" for tool in tools]
(HERE / "versions.txt").write_text("\n".join(lines) + "\n")
