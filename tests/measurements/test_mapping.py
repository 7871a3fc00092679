"""Mappings: the same arrays as from a tidy log folder, untidy rows and clocks, and what is refused."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from tests.machines.folders import system_of, text_of
from tests.measurements.systems import (
    ANGLE,
    SPEED,
    Array,
    motor,
    refused,
    rows,
    run,
    write,
    write_folder,
    write_tables,
)
from unmodelled import Logs, read_logs
from unmodelled.systems.units import parse_logged


def assert_equal(found: Logs, expected: Logs) -> None:
    assert found.ids == expected.ids and found.period == expected.period
    for name in ("offsets", "t", "y", "u", "x", "c"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-12, atol=1e-12)


def test_a_mapping_gives_what_the_tidy_folder_gives(tmp_path: Path) -> None:
    logs = {"a": run(400, rate=7.0), "b": run(60)}
    expected = read_logs(write_folder(tmp_path / "tidy", logs), motor())
    found = read_logs(write(tmp_path / "raw", logs), motor())
    assert_equal(found, expected)
    assert found.notes == expected.notes
    assert_equal(read_logs(tmp_path / "raw" / "mapping.yaml", motor()), expected)


def test_a_mapping_may_lie_elsewhere_and_have_another_name(tmp_path: Path) -> None:
    write(tmp_path / "raw", {"a": run(60), "b": run(60)})
    mapping = write(tmp_path / "mappings", {}, files="../raw/[a].csv") / "mapping.yaml"
    assert read_logs(mapping.rename(mapping.with_name("first.yml")), motor()).ids == ("a",)


def test_equal_names_of_files_are_told_apart_by_their_folders(tmp_path: Path) -> None:
    for day in ("monday", "tuesday"):
        write_tables(tmp_path / "raw" / day, {"log": run(60)})
    ids = read_logs(write(tmp_path / "raw", {}, files=["*/*.csv"]), motor()).ids
    assert [name.rpartition("-")[2] for name in ids] == ["log", "log"]
    assert ["monday" in ids[0], "tuesday" in ids[1]] == [True, True]


def test_units_sign_scale_and_offset(tmp_path: Path) -> None:
    log = run(60)
    expected = read_logs(write_folder(tmp_path / "tidy", {"a": log}), motor())
    raw = {"t": log["t"] * 1e6 + 5e12, "angle [deg]": -np.rad2deg(log["angle"])}
    raw["counts"] = (log["voltage"] - 2.0) / 0.25
    signals: dict[str, Any] = {"angle": {"column": "angle", "sign": -1}}
    signals["voltage"] = {"column": "counts", "scale": 0.25, "offset": 2}
    write(tmp_path / "raw", {"a": raw}, signals=signals, time={"column": "t", "unit": "us"})
    assert_equal(read_logs(tmp_path / "raw", motor()), expected)


def test_a_unit_of_the_mapping_goes_before_that_of_the_file(tmp_path: Path) -> None:
    log = {**run(60), "angle [rad]": np.rad2deg(run(60)["angle"])}
    signals = {"angle": {"column": "angle [rad]", "unit": "deg"}, "voltage": "voltage"}
    write(tmp_path, {"a": log}, signals=signals)
    np.testing.assert_allclose(read_logs(tmp_path, motor()).y[:, 0], run(60)["angle"])


def test_a_system_in_degrees_reads_a_file_in_radians(tmp_path: Path) -> None:
    signals = {"angle": {"column": "angle", "unit": "rad"}, "voltage": "voltage"}
    write(tmp_path, {"a": run(60)}, signals=signals)
    system = motor([replace(ANGLE, logged=parse_logged("deg")[1])])
    np.testing.assert_allclose(read_logs(tmp_path, system).y[:, 0], run(60)["angle"], rtol=1e-12)


def test_a_rate_stands_for_a_clock(tmp_path: Path) -> None:
    log = {name: column for name, column in run(60).items() if name != "t"}
    write(tmp_path, {"a": log}, time={"rate": "500 Hz"})
    found = read_logs(tmp_path, motor())
    assert found.period == pytest.approx(0.002) and len(found.t) == 60


def test_rows_out_of_order_and_repeated_stamps_are_mended_and_counted(tmp_path: Path) -> None:
    log = run(100)
    order = np.r_[0:20, 21, 20, 22:50, 49, 49, 50:100]
    write(tmp_path / "raw", {"a": rows(log, order)})
    found = read_logs(tmp_path / "raw", motor())
    assert_equal(found, read_logs(write_folder(tmp_path / "tidy", {"a": log}), motor()))
    assert found.notes[:2] == (
        "rows out of order, sorted by time: 1",
        "rows that repeat a time stamp, left out: 2",
    )


def test_rows_without_a_value_are_left_out_or_read_between_others(tmp_path: Path) -> None:
    log = run(100)
    angle, voltage = log["angle"].copy(), np.linspace(0.0, 1.0, 100)
    angle[:2] = np.nan
    voltage[[40, 41]] = np.nan
    write(tmp_path, {"a": {**log, "angle": angle, "voltage": voltage}})
    found = read_logs(tmp_path, motor())
    assert len(found.t) == 98
    np.testing.assert_allclose(found.u[:, 0], np.linspace(0.0, 1.0, 100)[2:])
    assert found.notes[:2] == (
        "rows without a time or a value of theta, left out: 2",
        "V has empty cells, and was read between the others",
    )


def test_stamps_that_are_damaged_are_left_out(tmp_path: Path) -> None:
    log = run(100)
    log["t"] = log["t"] + 5.0
    log["t"][[3, 70]] = [1e98, np.nan]
    write(tmp_path, {"a": log})
    found = read_logs(tmp_path, motor())
    assert found.notes[0] == "rows without a time or a value of theta, left out: 2"
    assert found.period == pytest.approx(0.002)


def test_files_without_a_usable_row_are_refused(tmp_path: Path) -> None:
    log = run(60)
    write(tmp_path, {"a": {**log, "t": log["t"] * 1e9 + 1.7e18}})
    assert "time.column: " in (told := refused(tmp_path)) and "no row has a time below 1e+11 s" in told
    content = {"arm": {name: log[name] for name in ("t", "angle")}}
    content["drive"] = {"t": [1e99] * 60, "voltage": log["voltage"]}
    write_json(tmp_path / "other", content, signals={"angle": "angle", "voltage": "voltage"})
    assert "its signals have no time in common" in refused(tmp_path / "other")


def test_what_is_beyond_any_measurement_is_no_number(tmp_path: Path) -> None:
    log = run(100)
    log["voltage"] = np.linspace(0.0, 1.0, 100)
    log["voltage"][50] = 1e200
    write(tmp_path, {"a": log})
    np.testing.assert_allclose(read_logs(tmp_path, motor()).u[:, 0], np.linspace(0.0, 1.0, 100))


def test_a_clock_that_starts_again_begins_an_experiment(tmp_path: Path) -> None:
    parts = [run(60), run(70, rate=5.0)]
    write(tmp_path / "raw", {"a": {k: np.concatenate([p[k] for p in parts]) for k in parts[0]}})
    found = read_logs(tmp_path / "raw", motor())
    assert found.ids == ("a-1", "a-2") and np.diff(found.offsets).tolist() == [60, 70]
    assert found.notes[0] == "starts of time within a file, where another experiment begins: 1"


def test_names_of_columns_may_have_any_characters(tmp_path: Path) -> None:
    log = run(60)
    content = {"{a} 1": {"t": log["t"], "x{0}": log["angle"]}, "b.c": {"t": log["t"][1:], "u": log["t"][1:]}}
    signals = {"angle": "{a} 1.x{0}", "voltage": "b.c.u"}
    assert len(read_logs(write_json(tmp_path, content, signals=signals), motor()).t) == 59


def test_runs_of_equal_values_are_experiments(tmp_path: Path) -> None:
    log = run(300)
    which = np.repeat(["cold", "warm", "cold"], 100)
    load = np.repeat([0.5, 0.75, 0.1], 100)
    constants = {"m": {"column": "load"}, "oil": {"column": "which"}, "day": 3}
    write(tmp_path, {"a": {**log, "which": which, "load": load}}, split_by="which", constants=constants)
    found = read_logs(tmp_path, motor())
    assert found.ids == ("cold-1", "warm", "cold-2")
    assert found.c[:, 0].tolist() == [0.5, 0.75, 0.1]
    assert found.experiments["oil"].tolist() == ["cold", "warm", "cold"]
    assert found.experiments["day"].tolist() == [3.0] * 3


def test_constants_follow_from_the_paths_of_the_files(tmp_path: Path) -> None:
    constants = {"m": {"files": {"*unload*": 0.5, "*load*": 2.5}}}
    constants["payload"] = {"files": {"un*": "none", "*": "box"}}
    write(tmp_path, {"a_load": run(100), "unload": run(100)}, constants=constants)
    found = read_logs(tmp_path, motor())
    assert found.c[:, 0].tolist() == [2.5, 0.5]
    assert found.experiments["payload"].tolist() == ["box", "none"]


def test_long_records_are_cut(tmp_path: Path) -> None:
    write(tmp_path, {"a": run(430)}, cut="0.2 s")  # 0.86 s
    found = read_logs(tmp_path, motor())
    assert found.ids == ("a-1", "a-2", "a-3", "a-4") and set(np.diff(found.offsets)) == {100}
    np.testing.assert_allclose(found.y[100:200, 0], run(430)["angle"][100:200])
    assert found.notes[0] == "rests of less than half the length of a cut, left out: 1"


def write_json(folder: Path, content: Any, **keys: Any) -> Path:
    write(folder, {}, files="*.json", **keys)
    (folder / "a.json").write_text(json.dumps(content, default=np.ndarray.tolist))
    return folder


def test_signals_of_other_clocks_are_read_at_the_instants_of_the_first_output(tmp_path: Path) -> None:
    log, slow = run(400), np.arange(0.0, 0.9, 0.01) - 0.005
    content = {
        "arm": {"t": log["t"], "angle": log["angle"]},
        "drive": {"t": slow, "voltage": 3.0 * slow},
        "speed": {"t": slow, "omega": np.cos(3.0 * slow)},
        "m": 0.5,
    }
    signals = {"angle": "arm.angle", "voltage": "drive.voltage", "speed": "omega"}
    system = motor([ANGLE, SPEED])
    write_json(tmp_path, content, signals=signals, constants={"m": {"column": "m"}})
    found = read_logs(tmp_path, system)
    np.testing.assert_allclose(found.y[:, 0], log["angle"])
    np.testing.assert_allclose(found.u[:, 0], 3.0 * log["t"], atol=1e-12)
    np.testing.assert_allclose(found.y[:, 1], np.cos(3.0 * log["t"]), atol=2e-6)  # a cubic spline
    held = replace(system, inputs=(replace(system.inputs[0], hold=True),))
    last = np.floor((log["t"] + 0.005) / 0.01 + 1e-9) * 0.01 - 0.005
    np.testing.assert_allclose(read_logs(tmp_path, held).u[:, 0], 3.0 * last, atol=1e-12)
    assert found.notes[:2] == (
        "omega of another clock was read at the instants of angle",
        "V of another clock was read at the instants of angle",
    )


def test_an_output_is_not_read_within_a_gap_of_its_own_clock(tmp_path: Path) -> None:
    log = run(400)
    kept = np.r_[0:200, 260:400]
    content = {"arm": {name: log[name] for name in ("t", "angle", "voltage")}}
    content["speed"] = {"t": log["t"][kept], "omega": log["speed"][kept]}
    signals = {"angle": "angle", "voltage": "voltage", "speed": "speed.omega"}
    found = read_logs(write_json(tmp_path, content, signals=signals), motor([ANGLE, SPEED]))
    assert [name.rpartition(".")[2] for name in found.ids] == ["part1", "part2"]
    assert np.diff(found.offsets).tolist() == [200, 140]


def test_a_wrapped_angle_of_another_clock_is_unwrapped_first(tmp_path: Path) -> None:
    t, late = np.arange(400) * 0.002, np.arange(400) * 0.002 + 0.001
    turning = (30.0 * late + np.pi) % (2.0 * np.pi) - np.pi
    content = {"arm": {"t": t, "omega": np.cos(t), "voltage": t}, "angle": {"t": late, "angle": turning}}
    signals = {"speed": "omega", "voltage": "voltage", "angle": "angle.angle"}
    found = read_logs(write_json(tmp_path, content, signals=signals), motor([SPEED, ANGLE]))
    np.testing.assert_allclose(np.diff(found.y[:, 1]), 0.06, atol=1e-9)


def test_a_folder_of_files_is_one_experiment(tmp_path: Path) -> None:
    log, of = run(60), {"state": ["t", "angle"], "control": ["t", "voltage"]}
    logs = {name: {k: log[k] for k in columns} for name, columns in of.items()}
    (write_tables(tmp_path / "first", logs) / "notes.txt").write_text("hello\n")
    signals = {"angle": "state.angle", "voltage": "voltage"}
    write(tmp_path, {}, files="fir*", signals=signals)
    expected = read_logs(write_folder(tmp_path / "tidy", {"first": log}), motor())
    assert_equal(read_logs(tmp_path, motor()), expected)


def test_groups_of_files_are_experiments(tmp_path: Path) -> None:
    for name in ("monday", "tuesday"):
        runs = {f"run{k}": {**run(60, rate=5.0 + k), "note": "no number"} for k in range(2)}
        savemat(tmp_path / f"{name}.mat", {**runs, "readme": {"by": np.ones(3)}})
    place = write(tmp_path, {}, files="*.mat", groups=["run?"])
    logs = read_logs(place, motor())
    assert logs.ids == ("monday-run0", "monday-run1", "tuesday-run0", "tuesday-run1")
    tidy = {name: run(60, rate=5.0 + k % 2) for k, name in enumerate(logs.ids)}
    assert_equal(logs, read_logs(write_folder(tmp_path / "tidy", tidy), motor()))
    none = write(tmp_path, {}, files="*.mat", groups="test*")
    assert "has no such group; it has 'run0', 'run1', 'readme'" in refused(none)
    signals = {"angle": "amps", "voltage": "voltage"}
    other = write(tmp_path, {}, files="*.mat", groups="run?", signals=signals)
    assert "monday.mat:/run0 has no column 'amps'" in refused(other)


SIGNALS = "signals: {angle: angle, voltage: voltage}"
HEAD = f"schema: mapping/1\nfiles: '*.csv'\ntime: t\nconstants: {{m: 1}}\n{SIGNALS}\n"
#: Other words for parts of the mapping, and what is said of them.
WRONG = {
    "mapping/1": {"mapping/2": "line 1: schema: must start with 'schema: mapping/1'"},
    HEAD: {
        "": "line 1: the file is empty: start with 'schema: mapping/1'",
        "- a": "a mapping file is a mapping",
    },
    "files: '*.csv'\n": {"": "the key 'files' is missing"},
    "files:": {"file:": "unknown key 'file'; did you mean 'files'?"},
    "'*.csv'": {
        "'*.mcap'": "files[0]: '*.mcap' matches no file beside the mapping",
        "[]": "files: is empty: write patterns",
    },
    SIGNALS: {"signals: {}": "signals: is empty"},
    "voltage: voltage": {
        "": "line 5: signals: the column 'voltage' of the system file is missing",
        "volts: voltage": "'voltage' of the system file is missing; did you mean 'volts'",
        "voltage: v": "signals.voltage: {}/a.csv has no column 'v'; it has 't', 'angle'",
        "voltage: volt": "has no column 'volt'; did you mean 'voltage'?",
        "voltage: word": "signals.voltage: {}/a.csv: column 'word' holds text such as",
        "voltage: {unit: V}": "signals.voltage: the key 'column' is missing",
        "voltage: {column: voltage, unit: A}": "'voltage' is in 'A', and the system file has 'V'",
        "voltage: {column: voltage, unit: zz}": "voltage.unit: unknown unit 'zz'",
        "voltage: {column: voltage, sign: 2}": "voltage.sign: must be 1 or -1, got 2",
        "voltage: {column: voltage, scale: 0}": "voltage.scale: must not be 0",
        "voltage: {column: voltage, scale: x}": "voltage.scale: must be a number",
    },
    "time: t\n": {"": "the key 'time' is missing: {}/a.csv has no clock of its own"},
    "time: t": {
        "time: {}": "time: must have either 'column' or 'rate'",
        "time: {column: t, unit: m}": "time.unit: must be a unit of time",
        "time: {rate: 100}": "time.rate: must be a positive number with a unit of frequency",
        "time: {rate: 0 Hz}": "time.rate: must be a positive number",
        "time: {rate: 1 kHz, unit: s}": "time.unit: belongs to 'column'",
        "time: clock": "time: {}/a.csv has no column 'clock'",
        "time: t\ncut: 2": "cut: must be a positive number with a unit of time, such as 2 s",
        "time: t\ncut: 1 ms": "cut: 0.001 s hold fewer than 50 samples",
        "time: t\nsplit_by: run": "split_by: {}/a.csv has no column 'run'",
    },
    "{m: 1}": {
        "{}": "constants: the constant 'm' of the system file is missing",
        "{m: x}": "column m: 'x' is not a finite number",
        "{m: {column: angle}}": "'angle' must keep one value in an experiment, it changes from 0 to",
        "{m: {col: angle}}": "constants.m.col: unknown key 'col'",
        "{m: {}}": "constants.m: must have either 'column' or 'files'",
        "{m: {files: {}}}": "constants.m.files: is empty: write a value for every pattern",
        "{m: {files: {b*: 1}}}": "constants.m.files: no pattern matches 'a.csv': add one, or '*'",
    },
}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [(old, new, message) for old, cases in WRONG.items() for new, message in cases.items()],
)
def test_mappings_that_are_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    pd.DataFrame({**run(200), "word": ["slow"] * 200}).to_csv(tmp_path / "a.csv", index=False)
    assert old in HEAD
    (tmp_path / "mapping.yaml").write_text(HEAD.replace(old, new))
    told = refused(tmp_path)
    assert message.replace("{}", str(tmp_path)) in told
    assert told.startswith(str(tmp_path))


def test_a_folder_with_two_descriptions_is_refused(tmp_path: Path) -> None:
    write_folder(tmp_path, {"a": run(60)})
    write(tmp_path, {}, files="a.csv")
    assert f"{tmp_path}: has experiments.csv and mapping.yaml: remove one" in refused(tmp_path)
    assert read_logs(tmp_path / "mapping.yaml", motor()).ids == ("a",)


def test_all_files_are_told_of(tmp_path: Path) -> None:
    write(tmp_path, {"a": run(60), "b": run(60), "c": run(60)})
    (tmp_path / "b.csv").write_bytes(b"\x1f\x8b" + bytes(60))
    (tmp_path / "c.csv").write_text("t,angle,voltage\n")
    told = refused(tmp_path)
    assert f"{tmp_path}/b.csv: is a gzip file" in told
    assert f"{tmp_path}/c.csv: row 1: no row of numbers" in told


def smooth(t: Array) -> Array:
    return np.sin(4.0 * t) + 0.3 * np.cos(9.0 * t)


def steps(t: Array) -> Array:
    return np.asarray(np.floor(t / 0.7) % 3.0)


@pytest.mark.parametrize(("command", "error"), [(smooth, 3e-3), (steps, 0.0)])
def test_commands_are_read_as_smooth_as_they_are(
    command: Callable[[Array], Array], error: float, tmp_path: Path
) -> None:
    """A smooth command of 12.5 Hz would be off by 2.5 % between its samples; steps do not overshoot."""
    t, slow = 0.01 * np.arange(1000), 0.08 * np.arange(130)
    sensor, drive = {"t": t, "x": np.sin(t)}, {"t": slow, "r": command(slow)}
    write_tables(tmp_path / "run", {"sensor": sensor, "drive": drive})
    signals = {"x": {"column": "sensor.x", "unit": "m"}, "r": {"column": "drive.r", "unit": "m"}}
    write(tmp_path, {}, files=["*/"], signals=signals, constants=None)
    u = read_logs(tmp_path, system_of(text_of("positioned_load.yaml"), tmp_path)).u[:, 0]
    straight = np.interp(t, slow, command(slow))
    if command is smooth:
        assert np.abs(u - smooth(t)).max() < error < 0.2 * np.abs(straight - smooth(t)).max()
    else:
        np.testing.assert_allclose(u, straight, atol=1e-12)
