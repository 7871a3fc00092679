"""Files of every format that is read, made by the format's own writer; and their bytes where it has none."""

import json
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from asammdf import MDF, Signal
from mcap.writer import Writer as McapWriter
from mcap_ros2.writer import Writer as RosWriter
from nptdms import ChannelObject, TdmsWriter
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_typestore
from scipy.io import savemat
from wpiutil import DataLogWriter
from wpiutil.log import DoubleArrayLogEntry, DoubleLogEntry

from tests.measurements.systems import run
from unmodelled.base.errors import Faults
from unmodelled.logs.readers.known import read_files
from unmodelled.logs.readers.reader import Table


def tables(path: Path) -> list[Table]:
    faults = Faults()
    found = read_files([path], None, faults)
    faults.check()
    return found[path]


#: The numbers in every file, over time in s from 0.
LOG = {name: np.round(column, 6) for name, column in run(80).items()}
T, ANGLE, VOLTAGE = LOG["t"], LOG["angle"], LOG["voltage"]
NANOSECONDS = (T * 1e9).round().astype(int) + 1_764_041_247_000_000_000
JOINTS = ["hip", "knee"]
JOINT_STATE = """std_msgs/Header header
string[] name
float64[] position
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec"""


def csv(path: Path) -> Path:
    pd.DataFrame(LOG).to_csv(path, index=False)
    return path


def parquet(path: Path) -> Path:
    rows = [[0.0, float(angle)] for angle in ANGLE]
    pq.write_table(pa.table({"t": T, "position": rows, "voltage": VOLTAGE}), path)
    return path


def hdf5(path: Path) -> Path:
    with h5py.File(path, "w") as file:
        group = file.create_group("arm")
        group["t"], group["voltage"] = T, VOLTAGE
        group["position"] = np.stack([0.0 * ANGLE, ANGLE])  # MATLAB writes a matrix like this
        group["voltage"].attrs["unit"] = "V"
    return path


def mat(path: Path) -> Path:
    position = np.column_stack([0.0 * ANGLE, ANGLE])
    savemat(path, {"arm": {"t": T, "drive": {"voltage": VOLTAGE}, "position": position}, "m": 0.5})
    return path


def npz(path: Path) -> Path:
    np.savez(path, t=T, position=np.column_stack([0.0 * ANGLE, ANGLE]), voltage=VOLTAGE)
    return path


def mdf(path: Path) -> Path:
    with MDF(version="4.10") as file:
        file.append([Signal(np.rad2deg(ANGLE), T, name="angle", unit="deg")], acq_name="arm")
        file.append([Signal(VOLTAGE, T, name="voltage", unit="V")], acq_name="drive")
        return Path(file.save(path, overwrite=True))


def json_records(path: Path) -> Path:
    rows = zip(T.tolist(), ANGLE.tolist(), VOLTAGE.tolist(), strict=True)
    entries = [{"t": t, "position": [0.0, angle], "voltage": voltage} for t, angle, voltage in rows]
    path.write_text(json.dumps({"entries": entries, "m": 0.5}))
    return path


def mcap(path: Path) -> Path:
    with path.open("wb") as file:
        writer = RosWriter(file)
        schema = writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
        for stamp, angle in zip(NANOSECONDS.tolist(), ANGLE, strict=True):
            header = {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": "base"}
            message = {"header": header, "name": JOINTS, "position": [0.0, angle]}
            writer.write_message("/joint_states", schema, message, stamp, stamp)
        writer.finish()
    return path


def mcap_json(path: Path) -> Path:
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start()
        schema = writer.register_schema("drive", "jsonschema", b"{}")
        channel = writer.register_channel("/drive", "json", schema)
        other = writer.register_channel("/image", "protobuf", 0)
        for stamp, angle, voltage in zip(NANOSECONDS.tolist(), ANGLE, VOLTAGE, strict=True):
            data = json.dumps({"voltage": voltage, "position": [0.0, angle]}).encode()
            writer.add_message(channel, stamp, data, stamp)
            writer.add_message(other, stamp, b"\x08\x01", stamp)
        writer.finish()
    return path


def bag_1(path: Path) -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    kinds = store.types
    with rosbag1.Writer(path) as bag:
        joints = bag.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=store)
        drive = bag.add_connection("/drive", "std_msgs/msg/Float64", typestore=store)
        for k, stamp in enumerate(NANOSECONDS.tolist()):
            time = kinds["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
            header = kinds["std_msgs/msg/Header"](seq=k, stamp=time, frame_id="base")
            none = np.empty(0)
            state = kinds["sensor_msgs/msg/JointState"](header, JOINTS, np.array([0.0, ANGLE[k]]), none, none)
            bag.write(joints, stamp, store.serialize_ros1(state, joints.msgtype))
            voltage = kinds["std_msgs/msg/Float64"](data=VOLTAGE[k])
            bag.write(drive, stamp, store.serialize_ros1(voltage, drive.msgtype))
    return path


def bag_2(path: Path) -> Path:
    store = get_typestore(Stores.ROS2_HUMBLE)
    with rosbag2.Writer(path, version=8) as bag:
        drive = bag.add_connection("/drive", "std_msgs/msg/Float64", typestore=store)
        arm = bag.add_connection("/arm", "std_msgs/msg/Float64", typestore=store)
        for k, stamp in enumerate(NANOSECONDS.tolist()):
            for connection, value in ((drive, VOLTAGE[k]), (arm, ANGLE[k])):
                message = store.types["std_msgs/msg/Float64"](data=value)
                bag.write(connection, stamp, store.serialize_cdr(message, connection.msgtype))
    return path


def ulog(path: Path) -> Path:
    """A file by the format's documentation: pyulog writes only what it has read."""

    def message(kind: bytes, data: bytes) -> bytes:
        return struct.pack("<Hc", len(data), kind) + data

    parts = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0), message(b"B", bytes(40))]
    parts.append(message(b"F", b"arm:uint64_t timestamp;float[2] position;float voltage;"))
    parts += [message(b"A", struct.pack("<BH", copy, copy) + b"arm") for copy in (0, 1)]
    for k, t in enumerate((T * 1e6).round().astype(int).tolist()):
        for copy in (0, 1):
            values = struct.pack("<HQfff", copy, t, 0.0, ANGLE[k] * (1 - copy), VOLTAGE[k])
            parts.append(message(b"D", values))
    path.write_bytes(b"".join(parts))
    return path


def messages(path: Path) -> Path:
    """A text log by the documentation of ArduPilot, with two sensors of a kind."""
    lines = [
        "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns",
        "FMT, 130, 40, ARM, QBff, TimeUS,I,Rest,Position",
        "FMT, 140, 40, MOT, Qfc, TimeUS,Volt,Temp",
        "UNIT, 0, 115, s",
        "UNIT, 0, 118, V",
        "UNIT, 0, 35, instance",
        "MULT, 0, 70, 0.000001",
        "FMTU, 0, 130, s#--, F---",
        "FMTU, 0, 140, sv-, F--",
    ]
    for t, angle, voltage in zip((T * 1e6).round().astype(int).tolist(), ANGLE, VOLTAGE, strict=True):
        lines += [f"ARM, {t}, 0, 0.0, {angle}", f"ARM, {t}, 1, 0.5, 0.5", f"MOT, {t}, {voltage}, 31.5"]
    path.write_text("\n".join(lines) + "\n")
    return path


def long(path: Path) -> Path:
    """One table for all sensors, as home automation and databases of time series write it."""
    rows = zip(T.tolist(), ANGLE.tolist(), VOLTAGE.tolist(), strict=True)
    lines = [f"{name},{v},{t}" for t, a, u in rows for name, v in (("sensor.knee", a), ("drive", u))]
    path.write_text("\n".join(["entity,state,time", *lines]) + "\n")
    return path


def dataflash(path: Path) -> Path:
    """A binary log by the documentation of ArduPilot, whose library only reads."""

    def message(kind: int, form: str, *values: object) -> bytes:
        return b"\xa3\x95" + struct.pack(f"<B{form}", kind, *values)

    def defined(kind: int, name: str, types: str, form: str, columns: str) -> bytes:
        size = 3 + struct.calcsize(f"<{form}")
        texts = (name.encode(), types.encode(), columns.encode())
        return message(128, "BB4s16s64s", kind, size, *texts)

    parts = [
        defined(128, "FMT", "BBnNZ", "BB4s16s64s", "Type,Length,Name,Format,Columns"),
        defined(129, "UNIT", "QbZ", "Qb64s", "TimeUS,Id,Label"),
        defined(131, "MULT", "Qbd", "Qbd", "TimeUS,Id,Mult"),
        defined(132, "FMTU", "QBNN", "QB16s16s", "TimeUS,FmtType,UnitIds,MultIds"),
        defined(133, "ARM", "QBff", "QBff", "TimeUS,I,Rest,Position"),
        defined(134, "MOT", "Qfc", "Qfh", "TimeUS,Volt,Temp"),
        *(message(129, "Qb64s", 0, ord(k), v) for k, v in (("s", b"s"), ("v", b"V"), ("#", b"instance"))),
        message(131, "Qbd", 0, ord("F"), 1e-6),
        message(132, "QB16s16s", 0, 133, b"s#--", b"F---"),
        message(132, "QB16s16s", 0, 134, b"sv-", b"F--"),
    ]
    for t, angle, voltage in zip((T * 1e6).round().astype(int).tolist(), ANGLE, VOLTAGE, strict=True):
        parts += [message(133, "QBff", t, 0, 0.0, angle), message(133, "QBff", t, 1, 0.5, 0.5)]
        parts.append(message(134, "Qfh", t, voltage, 3150))
    path.write_bytes(b"".join(parts))
    return path


def tdms(path: Path) -> Path:
    wave = {"wf_start_time": np.datetime64("2026-03-01T12:00:00"), "wf_increment": T[1] - T[0]}
    wave["wf_start_offset"] = 0.0
    with TdmsWriter(path) as file:
        own = [("angle", np.rad2deg(ANGLE), "deg"), ("voltage", VOLTAGE, "V")]
        file.write_segment([ChannelObject("arm", n, v, {**wave, "unit_string": unit}) for n, v, unit in own])
        file.write_segment([ChannelObject("notes", "who", ["a", "b"])])
    return path


def wpilog(path: Path) -> Path:
    log = DataLogWriter(str(path))
    position, voltage = DoubleArrayLogEntry(log, "/arm/position"), DoubleLogEntry(log, "/arm/voltage")
    for t, angle, u in zip((T * 1e6).round().astype(int).tolist(), ANGLE.tolist(), VOLTAGE, strict=True):
        position.append([0.0, angle], t + 1)  # a stamp of zero is the time of writing
        voltage.append(float(u), t + 1)
    log.stop()
    return path


@dataclass(frozen=True)
class Recorder:
    """A format: the writer of a file, the name of the file, its columns, and its time if it has no clock."""

    write: Callable[[Path], Path]
    file: str
    angle: str
    voltage: str
    time: str | None = None


RECORDERS = {
    "csv": Recorder(csv, "a.csv", "angle", "voltage", "t"),
    "parquet": Recorder(parquet, "a.parquet", "position[1]", "voltage", "t"),
    "hdf5": Recorder(hdf5, "a.h5", "arm.position[1]", "arm.voltage", "t"),
    "mat": Recorder(mat, "a.mat", "arm.position[1]", "arm.drive.voltage", "arm.t"),
    "npz": Recorder(npz, "a.npz", "position[1]", "voltage", "t"),
    "mdf": Recorder(mdf, "a.mf4", "arm.angle", "voltage"),
    "json": Recorder(json_records, "a.json", "entries.position[1]", "voltage", "t"),
    "mcap": Recorder(mcap, "a.mcap", "/joint_states.position[knee]", "/joint_states.position[1]"),
    "mcap_json": Recorder(mcap_json, "a.mcap", "/drive.position[1]", "/drive.voltage"),
    "bag_1": Recorder(bag_1, "a.bag", "/joint_states.position[knee]", "/drive.data"),
    "bag_2": Recorder(bag_2, "a", "/arm.data", "/drive.data"),
    "messages": Recorder(messages, "a.log", "ARM.Position", "MOT.Volt"),
    "long": Recorder(long, "a.csv", "sensor.knee.state", "drive.state"),
    "dataflash": Recorder(dataflash, "a.bin", "ARM.Position", "MOT.Volt"),
    "tdms": Recorder(tdms, "a.tdms", "arm.angle", "arm.voltage"),
    "wpilog": Recorder(wpilog, "a.wpilog", "/arm/position.value[1]", "/arm/voltage.value"),
    "ulog": Recorder(ulog, "a.ulg", "arm.position[1]", "arm.voltage"),
}
