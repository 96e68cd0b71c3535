"""Tests of reading files that the library of each format has written. Each is SKIPPED without its library."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
import zipfile

import numpy as np
import pytest
import stretch_gap
from stretch_gap import _stretch, arrays

BEGUN_NS = 1_714_564_800_000_000_000  # 2024-05-01T12:00:00Z
SAMPLES = 60
TIME_S = np.arange(SAMPLES) / 100
LENGTH_MM = np.round(165 + 14 * np.cos(3 * TIME_S), 3)
BRIDGE_V = np.round(1.24 + 0.033 * (180 - LENGTH_MM), 5)
SLOW_S = 0.05 + np.arange(12) / 25
PRESSURE_KPA = np.round(200 + 100 * SLOW_S, 2)

HEADER = """
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec"""
JOINTS = "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort" + HEADER
GAUGE = "bool ok\nint16 code\nfloat64 bridge_v\nfloat64[3] axes\nstring<=8 note\nuint8[] image"


def needs(module):
    return pytest.importorskip(module, reason=f"SKIPPED: no package {module.split('.')[0]}")


def stamp_ns(time_s):
    return BEGUN_NS + round(time_s * 1e9)


def is_the_same_in_the_program(path, folder, **how):
    """Return the recording of `read`. Assert that the program reads the same from the file that `convert` writes."""
    recording = stretch_gap.read(path, **how)
    out = folder / "converted.npz"
    stretch_gap.convert(path, out, force=True)
    asked = {"columns": list(how.get("columns", ())), "time": "time_s", "rate_hz": how.get("rate_hz"), "grid_hz": None}
    columns, _ = _stretch.read_file(str(out), asked)
    assert [name for name, _ in columns] == list(recording)
    for name, values in columns:
        np.testing.assert_array_equal(values, recording[name])
    return recording


def test_text_in_any_dialect_is_a_dict_of_columns(tmp_path):
    rows = "".join(f"{10 * i};{x:.3f};{v:.5f}\n" for i, (x, v) in enumerate(zip(LENGTH_MM, BRIDGE_V)))
    (tmp_path / "log.csv").write_text("Time (ms);Length (mm);Gauge (V)\n" + rows.replace(".", ","))
    recording = is_the_same_in_the_program(tmp_path / "log.csv", tmp_path)
    np.testing.assert_allclose(recording.time_s, TIME_S, atol=1e-12)
    np.testing.assert_array_equal(recording["length_mm"], LENGTH_MM)
    assert recording.units == {"time_s": "s", "length_mm": "mm", "gauge_v": "V"}
    assert "numbers have decimal commas" in recording.notes
    assert len(recording.to_frame()) in (SAMPLES, 3)
    calibration = stretch_gap.calibrate(
        recording["gauge_v"],
        recording["length_mm"],
        time_s=recording.time_s,
        model="linear",
        signal_name="gauge_v",
        reference_name="length_mm",
    )
    assert calibration.unit == "mm"
    found = stretch_gap.diagnose(
        lambda params, effects: params["offset"] + recording["gauge_v"] * -30.0,
        recording,
        output="length_mm",
        inputs=["gauge_v"],
        parameters={"offset": stretch_gap.Parameter(217.0, 5.0)},
    )
    assert found.sentence


def test_a_spreadsheet_is_refused_as_one(tmp_path):
    for name, member in (("real.xlsx", "xl/workbook.xml"), ("real.ods", "content.xml"), ("real.zip", "run.csv")):
        with zipfile.ZipFile(tmp_path / name, "w") as archive:
            archive.writestr(member, "<x/>")
    (tmp_path / "cut.real.xlsx").write_bytes((tmp_path / "real.xlsx").read_bytes()[:60])
    (tmp_path / "real.xls").write_bytes(bytes.fromhex("d0cf11e0a1b11ae1") + bytes(600))
    for path in sorted(tmp_path.iterdir()):
        what = {"ods": "OpenDocument", "zip": "ZIP"}.get(path.suffix[1:], "Excel")
        todo = "unpack it" if what == "ZIP" else "save the sheet as CSV"
        words = rf"real\.\w+: this {what} file cannot be read: (.*; )?{todo}"
        with pytest.raises(stretch_gap.StretchError, match=words):
            stretch_gap.read(path)
        with pytest.raises(stretch_gap.StretchError, match=words):
            stretch_gap.convert(path, tmp_path.parent / "out.npz")


def test_arrays_of_numpy_have_their_clocks(tmp_path):
    np.savez(
        tmp_path / "run.npz",
        **{"gauge.t": TIME_S, "gauge.both": np.column_stack([LENGTH_MM, BRIDGE_V])},
        **{"valve.t": SLOW_S, "valve.pressure_kpa": PRESSURE_KPA, "operator": np.array(["somebody"])},
    )
    recording = is_the_same_in_the_program(tmp_path / "run.npz", tmp_path)
    assert list(recording) == ["time_s", "gauge.both.0", "gauge.both.1", "pressure_kpa"]
    assert {name: len(columns["time_s"]) for name, columns in recording.clocks.items()} == {"gauge.t": 60, "valve.t": 12}
    assert recording.notes[0] == "left out: operator (text)"
    fields = np.array(list(zip(TIME_S, LENGTH_MM)), dtype=[("time_s", float), ("length_mm", np.float32)])
    np.save(tmp_path / "fields.npy", fields)
    assert list(stretch_gap.read(tmp_path / "fields.npy")) == ["time_s", "length_mm"]
    stamps = np.datetime64(BEGUN_NS, "ns") + (1e9 * TIME_S).round().astype("timedelta64[ns]")
    np.savez(tmp_path / "stamps.npz", time=stamps, length_mm=LENGTH_MM)
    recording = stretch_gap.read(tmp_path / "stamps.npz")
    np.testing.assert_allclose(recording.time_s, TIME_S, atol=1e-12)
    assert "2024-05-01T12:00:00" in recording.notes[0]


def json_mcap(path):
    writer_of = needs("mcap.writer")
    with path.open("wb") as out:
        writer = writer_of.Writer(out)
        writer.start(profile="", library="a test")
        schema = writer.register_schema(name="any", encoding="jsonschema", data=b'{"type":"object"}')
        for topic, times, message in (
            (
                "/gauge",
                TIME_S,
                lambda k: {"length_mm": LENGTH_MM[k], "bridge_v": BRIDGE_V[k], "timestamp": float(k), "unit": "mm"},
            ),
            ("/pressure", SLOW_S, lambda k: {"pressure_kpa": PRESSURE_KPA[k], "valves": [True, False], "time_s": k}),
        ):
            channel = writer.register_channel(topic=topic, message_encoding="json", schema_id=schema)
            for k, t in enumerate(times):
                data = json.dumps(message(k)).encode()
                writer.add_message(channel_id=channel, log_time=stamp_ns(t), publish_time=stamp_ns(t), data=data)
        broken = writer.register_channel(topic="/other", message_encoding="ros1", schema_id=schema)
        writer.add_message(channel_id=broken, log_time=stamp_ns(0.1), publish_time=stamp_ns(0.1), data=b"\1")
        writer.finish()
    return path


def test_messages_in_json_have_a_clock_a_topic(tmp_path):
    path = json_mcap(tmp_path / "run.mcap")
    needs("mcap_ros2"), needs("mcap_protobuf")
    recording = is_the_same_in_the_program(path, tmp_path)
    assert list(recording.clocks) == ["gauge.time_s", "pressure.time_s"]
    np.testing.assert_allclose(recording.clocks["gauge.time_s"]["time_s"], TIME_S, atol=1e-9)
    np.testing.assert_array_equal(recording.clocks["gauge.time_s"]["gauge.length_mm"], LENGTH_MM)
    np.testing.assert_array_equal(recording.clocks["pressure.time_s"]["pressure.time_s.value"], np.arange(12))
    # the slower topic begins later and ends earlier; the recording is not extrapolated beyond it
    assert (recording.time_s[0], recording.time_s.size) == (0.05, 45)
    np.testing.assert_allclose(recording["pressure_kpa"], 200 + 100 * recording.time_s, atol=0.0051)
    assert recording["pressure.valves.0"][0] == 1.0
    assert any(note.startswith("left out: /other (ros1") for note in recording.notes)
    assert "time counts from the first sample, 2024-05-01T12:00:00.000000000Z" in recording.notes
    only = is_the_same_in_the_program(path, tmp_path, columns=["bridge_v"])
    np.testing.assert_array_equal(only["bridge_v"], BRIDGE_V)
    assert stretch_gap.read(path, grid_hz=40.0).time_s.size == 18


def test_an_mcap_file_that_breaks_off_is_read_up_to_there(tmp_path):
    path = json_mcap(tmp_path / "run.mcap")
    needs("mcap_ros2"), needs("mcap_protobuf")
    whole = path.read_bytes()
    # each chunk of the file holds one message
    writer_of = importlib.import_module("mcap.writer")
    with path.open("wb") as out:
        writer = writer_of.Writer(out, chunk_size=1)
        writer.start(profile="", library="a test")
        channel = writer.register_channel(topic="/a", message_encoding="json", schema_id=0)
        for k in range(50):
            writer.add_message(channel_id=channel, log_time=10**7 * k, publish_time=0, data=b'{"b": %d}' % k)
        writer.finish()
    path.write_bytes(path.read_bytes()[:3000])
    recording = stretch_gap.read(path)
    assert 5 < recording["a.b"].size < 50
    assert any("the file breaks off after" in note for note in recording.notes)
    path.write_bytes(whole[:20])
    with pytest.raises(stretch_gap.StretchError, match=r"run\.mcap: this MCAP file cannot be read: .*mcap recover"):
        stretch_gap.read(path)


def joints(k):
    return {
        "header": {"stamp": dict(zip(("sec", "nanosec"), divmod(stamp_ns(TIME_S[k]), 10**9))), "frame_id": "base"},
        "name": ["elbow", "wrist"],
        "position": [float(LENGTH_MM[k]), float(np.sin(k))],
        "velocity": [],
        "effort": [],
    }


def test_messages_of_ros_in_mcap_have_their_own_stamps_and_names(tmp_path):
    ros = needs("mcap_ros2.writer")
    needs("mcap_protobuf")
    path = tmp_path / "ros2.mcap"
    with path.open("wb") as out:
        writer = ros.Writer(out)
        states, gauge = (
            writer.register_msgdef("sensor_msgs/msg/JointState", JOINTS),
            writer.register_msgdef("rig_msgs/msg/Gauge", GAUGE),
        )
        for k, t in enumerate(TIME_S):
            late = stamp_ns(t) + 2_000_000 + 1000 * (k % 7)
            writer.write_message(topic="/joint_states", schema=states, message=joints(k), log_time=late, publish_time=late)
            message = {"ok": True, "code": -k, "bridge_v": float(BRIDGE_V[k]), "axes": [1.0, 2.0, float(k)]}
            message |= {"note": "abc"[: k % 4], "image": bytes(range(100))}
            writer.write_message(topic="/gauge", schema=gauge, message=message, log_time=stamp_ns(t), publish_time=late)
        writer.finish()
    recording = is_the_same_in_the_program(path, tmp_path)
    assert "the time is taken from the stamps in the messages: /joint_states" in recording.notes
    np.testing.assert_allclose(recording.time_s, TIME_S, atol=1e-9)
    np.testing.assert_array_equal(recording["joint_states.position.elbow"], LENGTH_MM)
    np.testing.assert_array_equal(recording["gauge.code"], -np.arange(SAMPLES))
    np.testing.assert_array_equal(recording["gauge.axes.2"], np.arange(SAMPLES))
    assert not [name for name in recording if "image" in name or "stamp" in name]


def test_messages_of_protobuf(tmp_path):
    writer_of = needs("mcap_protobuf.writer")
    needs("mcap_ros2")
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2

    file = descriptor_pb2.FileDescriptorProto(name="rig.proto", package="rig", syntax="proto3")
    file.dependency.append(timestamp_pb2.DESCRIPTOR.name)
    inner, outer = file.message_type.add(name="Gauge"), file.message_type.add(name="State")
    inner.field.add(name="bridge_v", number=1, type=1, label=1)
    inner.field.add(name="count", number=2, type=17, label=1)  # zigzag
    outer.field.add(name="timestamp", number=1, type=11, label=1, type_name=".google.protobuf.Timestamp")
    outer.field.add(name="gauge", number=2, type=11, label=1, type_name=".rig.Gauge")
    outer.field.add(name="absent", number=3, type=11, label=1, type_name=".rig.Gauge")
    outer.field.add(name="name", number=4, type=9, label=3)
    outer.field.add(name="position", number=5, type=1, label=3)
    outer.field.add(name="is_moving", number=6, type=8, label=1)
    pool = descriptor_pool.DescriptorPool()
    pool.AddSerializedFile(timestamp_pb2.DESCRIPTOR.serialized_pb)
    pool.Add(file)
    state = message_factory.GetMessageClass(pool.FindMessageTypeByName("rig.State"))
    path = tmp_path / "protobuf.mcap"
    with path.open("wb") as out, writer_of.Writer(out) as writer:
        for k, t in enumerate(TIME_S):
            message = state(name=["elbow", "wrist"], position=[LENGTH_MM[k], -1.0 * k], is_moving=k % 2 == 1)
            message.timestamp.seconds, message.timestamp.nanos = divmod(stamp_ns(t), 10**9)
            message.gauge.bridge_v, message.gauge.count = BRIDGE_V[k], -k
            writer.write_message(topic="/rig", message=message, log_time=stamp_ns(t) + 3_000_000, publish_time=0)
    recording = is_the_same_in_the_program(path, tmp_path)
    np.testing.assert_allclose(recording.time_s, TIME_S, atol=1e-9)
    np.testing.assert_array_equal(recording["bridge_v"], BRIDGE_V)
    np.testing.assert_array_equal(recording["rig.gauge.count"], -np.arange(SAMPLES))
    np.testing.assert_array_equal(recording["rig.position.wrist"], -np.arange(SAMPLES))
    # protobuf does not store zeros, so a missing number is 0; a missing message has no columns
    np.testing.assert_array_equal(recording["rig.is_moving"][:2], [0.0, 1.0])
    assert not [name for name in recording if "absent" in name]


def bag_of_ros2(folder, typesys, writer):
    """Write a bag in SQLite as ROS 2 Humble does."""
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    kinds = store.types
    with writer as out:
        states = out.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=store)
        gauge = out.add_connection("/gauge", "std_msgs/msg/Float64", typestore=store)
        for k, t in enumerate(TIME_S):
            plain = joints(k)
            header = kinds["std_msgs/msg/Header"](
                stamp=kinds["builtin_interfaces/msg/Time"](**plain["header"]["stamp"]), frame_id="base"
            )
            state = kinds["sensor_msgs/msg/JointState"](
                header=header,
                name=plain["name"],
                position=np.array(plain["position"]),
                velocity=np.array([]),
                effort=np.array([]),
            )
            out.write(states, stamp_ns(t) + 3_000_000, store.serialize_cdr(state, states.msgtype))
            out.write(gauge, stamp_ns(t), store.serialize_cdr(kinds["std_msgs/msg/Float64"](data=BRIDGE_V[k]), gauge.msgtype))


def test_bags_of_ros2_are_read_as_folder_and_as_file(tmp_path):
    rosbag2, typesys = needs("rosbags.rosbag2"), needs("rosbags.typesys")
    folder = tmp_path / "run"
    bag_of_ros2(folder, typesys, rosbag2.Writer(folder, version=8))
    of_folder = is_the_same_in_the_program(folder, tmp_path)
    of_file = stretch_gap.read(next(folder.glob("*.db3")))
    for recording in (of_folder, of_file):
        assert "the time is taken from the stamps in the messages: /joint_states" in recording.notes
        np.testing.assert_allclose(recording.time_s, TIME_S, atol=1e-9)
        np.testing.assert_array_equal(recording["joint_states.position.elbow"], LENGTH_MM)
        np.testing.assert_array_equal(recording["gauge.data"], BRIDGE_V)
    broken = tmp_path / "broken.db3"
    broken.write_bytes(b"SQLite format 3\0" + bytes(100))
    with pytest.raises(stretch_gap.StretchError, match=r"broken\.db3: this ROS bag cannot be read"):
        stretch_gap.read(broken)


def test_bags_of_ros1(tmp_path):
    rosbag1, typesys = needs("rosbags.rosbag1"), needs("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    number = store.types["std_msgs/msg/Float64"]
    path = tmp_path / "run.bag"
    with rosbag1.Writer(path) as out:
        gauge = out.add_connection("/gauge", "std_msgs/msg/Float64", typestore=store)
        for k, t in enumerate(TIME_S):
            out.write(gauge, stamp_ns(t), store.serialize_ros1(number(data=BRIDGE_V[k]), gauge.msgtype))
    recording = is_the_same_in_the_program(path, tmp_path)
    np.testing.assert_allclose(recording.time_s, TIME_S, atol=1e-9)
    np.testing.assert_array_equal(recording["gauge.data"], BRIDGE_V)


def scope(labels, values, **more):
    """Return a Simulink log of the kind "Structure With Time"."""
    signals = np.zeros(len(labels), dtype=[("values", "O"), ("dimensions", "O"), ("label", "O"), ("title", "O")])
    for i, (label, value) in enumerate(zip(labels, values)):
        signals[i] = (value, 1.0, label, label)
    return {"time": TIME_S.reshape(-1, 1), "signals": signals, "blockName": "model/Scope", **more}


def test_what_simulink_logs_is_called_by_its_labels(tmp_path):
    io = needs("scipy.io")
    path, columns = tmp_path / "scope.mat", [LENGTH_MM.reshape(-1, 1), BRIDGE_V.reshape(-1, 1)]
    noted = {
        "date": np.array([2024, 2, 17], dtype=np.uint16),
        "timestamp": np.array([15, 30, 59], dtype=np.uint8),
        "trial": 1.0,
    }
    for more in ({}, {"information": noted}):
        io.savemat(path, {"ScopeData": scope(["length_mm", "Gauge (V)"], columns, **more)})
        recording = is_the_same_in_the_program(path, tmp_path)
        np.testing.assert_array_equal(recording.time_s, TIME_S)
        assert list(recording) == ["time_s", "length_mm", "ScopeData.gauge_v"]
        np.testing.assert_array_equal(recording["ScopeData.gauge_v"], BRIDGE_V)
        assert any("blockName" in note for note in recording.notes)
    assert any("ScopeData.information.date, ScopeData.information.timestamp" in note for note in recording.notes)
    # the columns of a matrix are numbered; a signal without a label is called by its number
    both = np.column_stack([LENGTH_MM, BRIDGE_V])
    for label, name in (("two", "simout.two"), ("", "simout.signal_1")):
        io.savemat(path, {"simout": scope([label], [both])})
        recording = stretch_gap.read(path)
        assert list(recording) == ["time_s", f"{name}.0", f"{name}.1"]
        np.testing.assert_array_equal(recording[f"{name}.1"], BRIDGE_V)


def test_variables_structures_and_cells_of_matlab(tmp_path):
    io = needs("scipy.io")
    sparse = needs("scipy.sparse")
    path = tmp_path / "log.mat"
    series = {"Name": "bridge_v", "Time": TIME_S.reshape(-1, 1), "Data": BRIDGE_V.reshape(1, 1, -1), "IsTimeFirst": False}
    held = {"t": TIME_S, "length_mm": LENGTH_MM.astype(np.float32), "note": "Monday", "z": TIME_S + 1j}
    held["cells"] = np.array([TIME_S + 1.0, "text"], dtype=object)
    io.savemat(
        path, {"log": held, "ts": series, "s": sparse.eye(3), "code": np.arange(SAMPLES, dtype=np.int16)}, do_compression=True
    )
    recording = is_the_same_in_the_program(path, tmp_path)
    assert {"length_mm", "log.cells.0", "bridge_v", "code"} <= set(recording)
    np.testing.assert_array_equal(recording["bridge_v"], BRIDGE_V)
    said = " ".join(recording.notes)
    assert "log.note (text)" in said and "log.z (complex numbers)" in said and "sparse" in said
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(stretch_gap.StretchError, match=r"log\.mat: this MAT file cannot be read"):
        stretch_gap.read(path)


def test_without_a_clock_a_rate_is_asked_for(tmp_path):
    io = needs("scipy.io")
    io.savemat(tmp_path / "a.mat", {"bridge_v": BRIDGE_V})
    with pytest.raises(stretch_gap.StretchError, match="there is no time"):
        stretch_gap.read(tmp_path / "a.mat")
    recording = is_the_same_in_the_program(tmp_path / "a.mat", tmp_path, rate_hz=100.0)
    np.testing.assert_allclose(recording.time_s, TIME_S, atol=1e-12)
    io.savemat(tmp_path / "a.mat", {"bridge_v": BRIDGE_V, "fs": 50.0})
    assert stretch_gap.read(tmp_path / "a.mat").time_s[1] == 0.02


def test_groups_of_hdf5_are_clocks_and_attributes_are_units(tmp_path):
    h5py = needs("h5py")
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as out:
        out["gauge/time_s"], out["gauge/length_mm"] = TIME_S, LENGTH_MM
        out.create_dataset("gauge/bridge", data=BRIDGE_V, compression="gzip").attrs["units"] = "V"
        out["pressure/time_s"], out["pressure/pressure_kpa"] = SLOW_S, PRESSURE_KPA
        out["note"] = "Monday"
        out["lost"] = h5py.SoftLink("/nowhere")
        out["gauge/again"] = out["gauge"]
    recording = is_the_same_in_the_program(path, tmp_path, columns=["bridge_v", "length_mm"])
    np.testing.assert_array_equal(recording["bridge_v"], BRIDGE_V)
    assert recording.time_s.size == SAMPLES
    assert list(stretch_gap.read(path, ["pressure_kpa"]).clocks)[-1] == "pressure/time_s"
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(stretch_gap.StretchError, match=r"run\.h5: this HDF5 file cannot be read"):
        stretch_gap.read(path)


def seven_three(h5py, path, variables):
    """Write a MATLAB 7.3 file: HDF5 after a header. Arrays of structures and cells are references, texts are numbers."""
    with h5py.File(path, "w", userblock_size=512) as out:
        kept = out.create_group("#refs#")

        def refer(value):
            name = f"#refs#/{len(kept)}"
            put(name, value)
            return out[name].ref

        def put(name, value):
            if isinstance(value, dict):
                out.create_group(name).attrs["MATLAB_class"] = np.bytes_("struct")
                for key, part in value.items():
                    put(f"{name}/{key}", part)
            elif isinstance(value, str):
                out[name] = np.array([[ord(letter)] for letter in value], dtype=np.uint16)
                out[name].attrs["MATLAB_class"] = np.bytes_("char")
            elif isinstance(value, list) and isinstance(value[0], dict):
                out.create_group(name).attrs["MATLAB_class"] = np.bytes_("struct")
                for key in value[0]:
                    refers = np.array([[refer(one[key])] for one in value], dtype=h5py.ref_dtype)
                    out.create_dataset(f"{name}/{key}", data=refers, dtype=h5py.ref_dtype)
            elif isinstance(value, list):
                refers = np.array([[refer(one)] for one in value], dtype=h5py.ref_dtype)
                out.create_dataset(name, data=refers, dtype=h5py.ref_dtype).attrs["MATLAB_class"] = np.bytes_("cell")
            else:
                out[name] = np.atleast_2d(value)  # a column of MATLAB is a row in HDF5
                out[name].attrs["MATLAB_class"] = np.bytes_("double")

        for name, value in variables.items():
            put(name, value)
        out["object"] = np.array([[7, 8]], dtype=np.uint32)
        out["object"].attrs["MATLAB_class"] = np.bytes_("timeseries")
        out["object"].attrs["MATLAB_object_decode"] = np.int32(3)
    with path.open("r+b") as out:
        out.write(b"MATLAB 7.3 MAT-file, made by a test".ljust(124) + b"\x00\x02IM")


def test_matlab_7_3_gives_what_version_5_gives(tmp_path):
    h5py = needs("h5py")
    path = tmp_path / "run.mat"
    signals = [{"values": LENGTH_MM, "label": "length_mm"}, {"values": BRIDGE_V, "label": "Gauge (V)"}]
    log = {"t": TIME_S, "cells": [TIME_S + 1.0, "text"], "note": "Monday"}
    series = {"Name": "angle_deg", "Time": TIME_S, "Data": TIME_S**2}
    seven_three(h5py, path, {"ScopeData": {"time": TIME_S, "signals": signals}, "log": log, "ts": series})
    recording = is_the_same_in_the_program(path, tmp_path)
    assert list(recording.clocks) == ["ScopeData.time", "log.t", "ts.Time"]
    np.testing.assert_array_equal(recording.time_s, TIME_S)
    np.testing.assert_array_equal(recording["length_mm"], LENGTH_MM)
    np.testing.assert_array_equal(recording["ScopeData.gauge_v"], BRIDGE_V)
    np.testing.assert_array_equal(recording["log.cells.0"], TIME_S + 1.0)
    np.testing.assert_array_equal(recording["ts.angle_deg"], TIME_S**2)
    assert any("object (an object of MATLAB's class timeseries" in note for note in recording.notes)
    # a single signal is a structure instead of an array of structures, and its matrix is transposed
    seven_three(h5py, path, {"simout": {"time": TIME_S, "signals": {"values": np.array([LENGTH_MM, BRIDGE_V]), "label": "two"}}})
    recording = stretch_gap.read(path)
    np.testing.assert_array_equal(recording["simout.two.1"], BRIDGE_V)


def test_tables_of_parquet(tmp_path):
    pa, pq = needs("pyarrow"), needs("pyarrow.parquet")
    columns = {
        "time": pa.array(BEGUN_NS // 1000 + (TIME_S * 1e6).round().astype("int64"), pa.timestamp("us", tz="UTC")),
        "length_mm": pa.array(LENGTH_MM),
        "bridge": pa.array(BRIDGE_V),
        "on": pa.array([k % 2 == 0 for k in range(SAMPLES)]),
        "holes": pa.array([None if k == 7 else k for k in range(SAMPLES)]),
        "word": pa.array(["a"] * SAMPLES),
    }
    table = pa.table(columns)
    table = table.cast(pa.schema([f.with_metadata({"unit": "V"}) if f.name == "bridge" else f for f in table.schema]))
    pq.write_table(table, tmp_path / "run.parquet", row_group_size=25)
    recording = is_the_same_in_the_program(tmp_path / "run.parquet", tmp_path)
    np.testing.assert_allclose(recording.time_s, TIME_S, atol=1e-9)
    assert list(recording) == ["time_s", "length_mm", "bridge_v", "on"]
    np.testing.assert_array_equal(recording["bridge_v"], BRIDGE_V)
    assert any(note.startswith("left out: word (") for note in recording.notes)


def test_an_episode_of_lerobot_goes_by_the_names_of_its_description(tmp_path):
    pa, pq = needs("pyarrow"), needs("pyarrow.parquet")
    path = tmp_path / "data" / "chunk-000" / "file-000.parquet"
    path.parent.mkdir(parents=True)
    (tmp_path / "meta").mkdir()
    both = np.column_stack([LENGTH_MM, BRIDGE_V])
    both = np.concatenate([both, both[::-1]])
    columns = {
        "observation.state": pa.array(both.tolist(), pa.list_(pa.float64(), 2)),
        "action": pa.array((both + 1.0).tolist(), pa.list_(pa.float64())),
        "timestamp": pa.array(np.concatenate([TIME_S, TIME_S])),
        "episode_index": pa.array(np.repeat([0, 1], SAMPLES)),
        "uneven": pa.array([[0.0] * (1 + i % 2) for i in range(2 * SAMPLES)], pa.list_(pa.float64())),
    }
    pq.write_table(pa.table(columns), path, row_group_size=37)
    names = ["length_mm", "bridge_v"]
    features = {"observation.state": {"names": names}, "action": {"names": {"motors": names}}, "timestamp": {"names": None}}
    (tmp_path / "meta" / "info.json").write_text(json.dumps({"features": features}))
    first = is_the_same_in_the_program(path, tmp_path)
    np.testing.assert_array_equal(first["observation.state.length_mm"], LENGTH_MM)
    np.testing.assert_array_equal(first["action.bridge_v"], BRIDGE_V + 1.0)
    said = " ".join(first.notes)
    assert "episodes 0 to 1, and 0 is read" in said and "uneven" in said
    second = stretch_gap.read(f"{path}#1")
    np.testing.assert_array_equal(second["observation.state.bridge_v"], BRIDGE_V[::-1])
    with pytest.raises(stretch_gap.StretchError, match="there is no episode 7 in it; it holds 0 to 1"):
        stretch_gap.read(f"{path}#7")


@pytest.mark.parametrize(
    "head, module, extra",
    [
        (b"\x89MCAP0\r\n", "mcap.reader", "ros"),
        (b"SQLite format 3\0", "rosbags.typesys", "ros"),
        (b"#ROSBAG V2.0\n", "rosbags.highlevel", "ros"),
        (b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM", "scipy.io", "matlab"),
        (b" " * 512 + b"\x89HDF\r\n\x1a\n", "h5py", "matlab"),
        (b"PAR1", "pyarrow.parquet", "parquet"),
    ],
)
def test_a_missing_library_is_an_error_that_names_the_extra(head, module, extra, tmp_path, monkeypatch):
    # with None the import fails as if the module were not installed
    monkeypatch.setitem(sys.modules, module, None)
    (tmp_path / "run").write_bytes(head + bytes(600))
    with pytest.raises(stretch_gap.StretchError, match=rf'is not installed: pip install "stretch-gap\[{extra}\]"'):
        stretch_gap.read(tmp_path / "run")
    # a module that was built with all features reads Parquet itself
    own = "|Parquet error" if extra == "parquet" else ""
    with pytest.raises(stretch_gap.StretchError, match=rf"convert .* \(pip install .stretch-gap\[{extra}\]{own}"):
        _stretch.read_file(str(tmp_path / "run"), {"columns": [], "time": "time_s", "rate_hz": None, "grid_hz": None})


def test_notes_list_a_few_names_and_count_the_rest():
    assert arrays.listed(["a", "b", "c", "d", "e"]) == "a, b, c, d, e"
    assert arrays.listed(list("abcdefg")) == "a, b, c, d and 3 more"


def test_the_command_writes_a_file_whole_or_says_why_not(tmp_path):
    rows = "".join(f"{t},{x},{v}\n" for t, x, v in zip(TIME_S, LENGTH_MM, BRIDGE_V))
    (tmp_path / "in.csv").write_text("time_s,length_mm,file\n" + rows)

    def run(*arguments):
        command = [sys.executable, "-m", "stretch_gap", "convert", *arguments]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)

    done = run("in.csv", "out.npz")
    assert done.returncode == 0, done.stderr
    assert done.stdout == "wrote out.npz: 3 arrays: time_s, length_mm, file\n"
    np.testing.assert_array_equal(stretch_gap.read(tmp_path / "out.npz")["file"], BRIDGE_V)
    for wrong, sentence in ((("in.csv", "out.csv"), "must end in .npz"), (("no.mat", "o.npz"), "no.mat: cannot open it")):
        refused = run(*wrong)
        assert refused.returncode == 1 and sentence in refused.stderr, refused.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in.csv", "out.npz"]


def test_messages_name_the_arguments_of_read(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("\n".join(["x,y_mm", *(f"{i},{i / 8}" for i in range(60))]))
    with pytest.raises(
        stretch_gap.StretchError, match="which column is the time with time=COLUMN, or time=100hz if there is none"
    ):
        stretch_gap.read(path)
    with pytest.raises(stretch_gap.StretchError, match="say which with time=x:s or x:ms, or rename it x_ms"):
        stretch_gap.read(path, time="x")
    for time, step_s in [("x:ms", 0.001), ("100hz", 0.01)]:
        assert stretch_gap.read(path, time=time).time_s[1] == pytest.approx(step_s)
