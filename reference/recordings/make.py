"""Writes the recordings in this folder with the tools that people write them with.

One motion, made here: 60 samples at 100 Hz of length_mm and bridge_v, and a pressure_kpa at 25 Hz on a separate clock. `lerobot/` is a
data set of LeRobot (a Parquet file of two episodes, names in meta/info.json).
Run in an environment with the packages of versions.txt: python make.py
"""

import gzip
import importlib.metadata as metadata
import json
import pathlib
import sys

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

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


def lerobot():
    """A data set of LeRobot's version 3: episode 0 is the motion, episode 1 the motion backwards."""
    folder = HERE / "lerobot"
    (folder / "data" / "chunk-000").mkdir(parents=True, exist_ok=True)
    (folder / "meta").mkdir(exist_ok=True)
    both = np.concatenate([np.column_stack([length_mm, bridge_v]), np.column_stack([length_mm, bridge_v])[::-1]])
    pair = pa.list_(pa.float64(), 2)
    columns = {
        "observation.state": pa.array(both.tolist(), pair),
        "action": pa.array((both + 1.0).tolist(), pa.list_(pa.float64())),
        "timestamp": pa.array(np.concatenate([time_s, time_s])),
        "frame_index": pa.array(np.tile(np.arange(N), 2)),
        "episode_index": pa.array(np.repeat([0, 1], N)),
        "task": pa.array(["stretch"] * (2 * N)),
        "uneven": pa.array([[0.0] * (1 + i % 2) for i in range(2 * N)], pa.list_(pa.float64())),
    }
    pq.write_table(pa.table(columns), folder / "data" / "chunk-000" / "file-000.parquet", row_group_size=37)
    names = ["length_mm", "bridge_v"]
    features = {"observation.state": {"names": names}, "action": {"names": {"motors": names}}, "timestamp": {"names": None}}
    (folder / "meta" / "info.json").write_text(json.dumps({"codebase_version": "v3.0", "fps": 100, "features": features}, indent=1) + "\n")


lerobot()

tools = ["numpy", "pyarrow"]
lines = [f"python {sys.version.split()[0]}"] + [f"{tool} {metadata.version(tool)}" for tool in tools]
(HERE / "versions.txt").write_text("\n".join(lines) + "\n")
