"""Contract of all readers: the same numbers from every format, and one line about what is damaged."""

import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from asammdf import MDF, Signal
from mcap.writer import Writer

from tests.measurements import recorders
from tests.measurements.recorders import ANGLE, RECORDERS, VOLTAGE, T, tables
from tests.measurements.systems import motor, write
from unmodelled import BadInput, read_logs
from unmodelled.base import additions
from unmodelled.logs.readers import known
from unmodelled.logs.readers.reader import START, Table

FORMATS = pytest.mark.parametrize("name", RECORDERS)


def recorded(folder: Path, name: str) -> Path:
    folder.mkdir(exist_ok=True)
    return RECORDERS[name].write(folder / RECORDERS[name].file)


def with_mapping(folder: Path, name: str, time: str | None = None) -> Path:
    recorder = RECORDERS[name]
    signals = {"angle": recorder.angle, "voltage": recorder.voltage}
    return write(folder, {}, files=recorded(folder, name).name, signals=signals, time=time or recorder.time)


@FORMATS
def test_every_format_gives_the_same_logs(tmp_path: Path, name: str) -> None:
    logs = read_logs(with_mapping(tmp_path, name), motor())
    assert logs.ids == ("a",) and logs.period == pytest.approx(0.002, rel=1e-6)
    single = 1e-7 if name in ("ulog", "dataflash") else 1e-12
    np.testing.assert_allclose(logs.y[:, 0], ANGLE, atol=single)
    expected = ANGLE if RECORDERS[name].voltage.endswith("position[1]") else VOLTAGE
    np.testing.assert_allclose(logs.u[:, 0], expected, atol=10 * single)


@FORMATS
def test_tables_keep_the_contract(tmp_path: Path, name: str) -> None:
    found = tables(recorded(tmp_path, name))
    assert found
    for table in found:
        assert len(table) > 0
        for column in table.columns.values():
            assert column.dtype == np.float64 and column.shape == (len(table),)
        for cells in table.texts.values():
            assert len(cells) == len(table) and all(isinstance(cell, str) for cell in cells)
        assert {*table.units, *table.aliases.values()} <= {*table.columns, *table.texts}
        assert not {*table.aliases} & {*table.columns}
    clocks = [table.clock for table in found if table.clock is not None]
    assert (not clocks) == (RECORDERS[name].time is not None)
    for clock in clocks:
        np.testing.assert_allclose(clock, T, atol=1e-9)


@FORMATS
def test_exactly_one_reader_recognises_a_file(tmp_path: Path, name: str) -> None:
    path = recorded(tmp_path, name)
    start = b"" if path.is_dir() else path.read_bytes()[:START]
    found = [reader.name for reader in known.READERS if reader.recognises(path, start)]
    assert found[:1] and set(found[1:]) <= {"CSV"}


@FORMATS
def test_damaged_files_are_one_line(tmp_path: Path, name: str) -> None:
    """Cut off at the head, in the middle and at the end, and with noise over the middle."""
    path = recorded(tmp_path, name)
    if path.is_dir():
        path = next(path.glob("*.db3"))
    whole, generator = path.read_bytes(), np.random.default_rng(1)
    middle = len(whole) // 2
    noise = generator.integers(0, 256, len(whole) - 600, np.uint8).tobytes()
    for content in (whole[: START // 8], whole[:middle], whole[:-9], whole[:500] + noise):
        path.write_bytes(content)
        try:
            found = tables(path)
        except BadInput as error:
            assert str(error).startswith(str(path)) and "\n" not in str(error)
        else:  # what is left can be a table
            assert all(len(column) == len(table) for table in found for column in table.columns.values())


@pytest.mark.parametrize(
    ("name", "module", "install"),
    [
        ("mdf", "asammdf", "asammdf"),
        ("mcap", "mcap.reader", "mcap mcap-ros2-support"),
        ("bag_1", "rosbags.highlevel", "rosbags"),
        ("ulog", "pyulog", "pyulog"),
        ("dataflash", "pymavlink.DFReader", "pymavlink"),
        ("tdms", "nptdms", "npTDMS"),
        ("wpilog", "wpiutil.log", "robotpy-wpiutil"),
    ],
)
def test_a_library_that_is_missing_is_named_with_the_command(
    tmp_path: Path, name: str, module: str, install: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = recorded(tmp_path, name)
    reader = known.reader_of(path)
    assert reader is not None and reader.install == install
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(BadInput, match=f"is not installed: pip install {install}$"):
        known._read(reader, path, None)


class Weighed:
    """A reader of another package: a file of numbers that begins with a word."""

    name, install, isolated = "weighed", "", False

    def recognises(self, path: Path, start: bytes) -> bool:
        return start.startswith(b"WEIGHED")

    def read(self, path: Path, wanted: object) -> list[Table]:
        values = np.array([float(line) for line in path.read_text().splitlines()[1:]])
        return [Table("", {"mass": values}, {"mass": "kg"})]


def test_other_packages_add_readers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    point = EntryPoint("weighed", f"{__name__}:WEIGHED", known.GROUP)
    monkeypatch.setattr(additions, "entry_points", lambda group: [point] if group == known.GROUP else [])
    known.readers.cache_clear()
    try:
        (tmp_path / "a.txt").write_text("WEIGHED\n1\n2.5\n")
        (table,) = tables(tmp_path / "a.txt")
        assert table.columns["mass"].tolist() == [1.0, 2.5]
        (tmp_path / "a.txt").write_text("WEIGHED\n1\nx\n")
        with pytest.raises(BadInput, match="not in format weighed, or damaged"):
            tables(tmp_path / "a.txt")
        broken = EntryPoint("broken", "no_such_module:READER", known.GROUP)
        monkeypatch.setattr(additions, "entry_points", lambda group: [broken])
        known.readers.cache_clear()
        with pytest.raises(BadInput, match=r"reader broken .* cannot be loaded"):
            tables(tmp_path / "a.txt")
    finally:
        known.readers.cache_clear()


WEIGHED = Weighed()


def test_stamps_in_messages_are_a_clock_too(tmp_path: Path) -> None:
    logs = read_logs(with_mapping(tmp_path, "mcap", "header.stamp"), motor())
    assert logs.period == pytest.approx(0.002, rel=1e-5)


def test_a_formula_in_a_file_is_not_executed(tmp_path: Path) -> None:
    with_mapping(tmp_path, "mdf")
    with MDF(version="4.10") as file:
        drive = Signal(VOLTAGE, T, name="voltage", conversion={"formula": "2*X1"})
        file.append([Signal(ANGLE, T, name="angle"), drive], acq_name="arm")
        file.save(tmp_path / "a.mf4", overwrite=True)
    (table,) = tables(tmp_path / "a.mf4")
    assert list(table.columns) == ["angle"]
    words = r"channel 'voltage' is converted by a formula .* not executed: export"
    with pytest.raises(BadInput, match=words):
        read_logs(tmp_path, motor())


def test_pickled_objects_are_not_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", x=np.array([{"a": 1}], dtype=object))
    with pytest.raises(BadInput, match="not in format NumPy, or damaged"):
        tables(tmp_path / "a.npz")


def test_messages_that_cannot_be_decoded_are_named(tmp_path: Path) -> None:
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/image", "protobuf", 0)
        writer.add_message(channel, 0, b"\x08\x01", 0)
        writer.finish()
    with pytest.raises(BadInput, match="messages of /image are in protobuf: convert them"):
        tables(tmp_path / "a.mcap")


def test_csv_of_pandas_with_an_index(tmp_path: Path) -> None:
    pd.DataFrame(recorders.LOG).to_csv(tmp_path / "a.csv")
    (table,) = tables(tmp_path / "a.csv")
    assert list(table.columns) == ["1", "t", "angle", "speed", "voltage"]


def test_an_index_beside_a_file_is_not_trusted(tmp_path: Path) -> None:
    path = recorded(tmp_path, "tdms")
    path.with_suffix(".tdms_index").write_bytes(b"TDSh" + path.read_bytes()[4:60])
    assert len(tables(path)[0]) == len(T)
