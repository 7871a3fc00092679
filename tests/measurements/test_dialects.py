"""Text tables as recorders write them, and names beside lists: elements follow their names in any format."""

import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from rosbags import rosbag1
from rosbags.typesys import Stores, get_typestore
from scipy.io import savemat

from tests.machines.known import refusals
from tests.measurements import recorders
from tests.measurements.recorders import tables
from tests.measurements.systems import motor, write
from unmodelled.base.errors import BadInput, Faults
from unmodelled.logs.folder import read_logs
from unmodelled.logs.readers import known
from unmodelled.logs.readers.reader import Table

T = np.arange(60) * 0.25
X = np.round(np.sin(T), 6)
ROWS = [f"{t},{x}" for t, x in zip(T, X, strict=True)]
BODY = "\n".join(ROWS) + "\n"
HEAD = "Recorder;3.1\nUser;Anna\nRate;4;Hz\n\nt;x\ns;mm\n"


def table(path: Path, content: str | bytes) -> Table:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    (only,) = tables(path)
    return only


SAME_CLOCK = [f"{date} %H:%M:%S.%f" for date in ("%d/%m/%Y", "%Y/%m/%d", "%d-%b-%Y")]


def commas(text: str) -> str:
    return text.replace(",", ";").replace(".", ",")


@pytest.mark.parametrize(
    ("content", "names", "units", "first"),
    [
        ("t,x\n" + BODY, ["t", "x"], {}, 2),
        ("t;x\n" + BODY.replace(",", ";"), ["t", "x"], {}, 2),
        ("t\tx\n" + BODY.replace(",", "\t"), ["t", "x"], {}, 2),
        ("t|x\n" + BODY.replace(",", "|"), ["t", "x"], {}, 2),
        ("t   x\n" + BODY.replace(",", "   "), ["t", "x"], {}, 2),
        ("t;x\n" + commas(BODY), ["t", "x"], {}, 2),
        ("t\tx\n" + BODY.replace(",", "\t").replace(".", ","), ["t", "x"], {}, 2),
        (BODY, ["1", "2"], {}, 1),
        (commas(BODY), ["1", "2"], {}, 1),
        ("\ufefft,x\r\n" + BODY.replace("\n", "\r\n"), ["t", "x"], {}, 2),
        ("# bench 3\n# 25.11.2026, noon\n\nt, x\n" + BODY, ["t", "x"], {}, 5),
        ("# t x\n" + BODY.replace(",", " "), ["t", "x"], {}, 2),
        (HEAD + BODY.replace(",", ";"), ["t", "x"], {"t": "s", "x": "mm"}, 7),
        ("t,x\n[s],[rad]\n" + BODY, ["t", "x"], {"t": "s", "x": "rad"}, 3),
        ("t [s],x (deg)\n" + BODY, ["t [s]", "x (deg)"], {"t [s]": "s", "x (deg)": "deg"}, 2),
        ('"t","x"\n' + "\n".join(f'"{t}","{x}"' for t, x in zip(T, X, strict=True)), ["t", "x"], {}, 2),
        ("x,x\n" + BODY, ["x", "x#2"], {}, 2),
        ("t,\n" + BODY, ["t", "2"], {}, 2),
        ("t,x\n" + BODY.replace("e", "d"), ["t", "x"], {}, 2),
    ],
)
def test_dialects(tmp_path: Path, content: str, names: list[str], units: dict[str, str], first: int) -> None:
    found = table(tmp_path / "a.csv", content)
    assert list(found.columns) == names and found.units == units and found.first == first
    np.testing.assert_allclose(list(found.columns.values()), [T, X])


@pytest.mark.parametrize("encoding", ["utf-16", "latin-1", "utf-8-sig"])
def test_encodings(tmp_path: Path, encoding: str) -> None:
    found = table(tmp_path / "a.csv", ("t [s],x [°]\n" + BODY).encode(encoding))
    assert found.units == {"t [s]": "s", "x [°]": "°"} and found.aliases == {"t": "t [s]", "x": "x [°]"}
    np.testing.assert_allclose(found.columns["x [°]"], X)


@pytest.mark.parametrize(
    ("cells", "separator"),
    [
        ([f"2026-11-25T10:00:{t:09.6f}Z" for t in T], ","),
        ([f"2026-11-25 10:00:{t:06.3f}" for t in T], ","),
        ([f"2026-11-25 10:00:{t:06.3f}+01:00" for t in T], ","),
        ([f"10:00:{t:06.3f}" for t in T], ","),
        ([f"25.11.2026 10:00:{t:06.3f}" for t in T], ";"),
        ([f"25.11.2026 10:00:{t:06.3f}".replace(".", ",").replace("25,11,", "25.11.") for t in T], ";"),
    ],
)
def test_dates_and_times_of_day_are_seconds(tmp_path: Path, cells: list[str], separator: str) -> None:
    rows = [f"{cell}{separator}{x}" for cell, x in zip(cells, X, strict=True)]
    found = table(tmp_path / "a.csv", f"time{separator}x\n" + "\n".join(rows))
    np.testing.assert_allclose(found.columns["time"], T, atol=1e-9)
    assert found.units["time"] == "s"


@pytest.mark.parametrize("pattern", ["%m/%d/%Y %I:%M:%S.%f %p", *SAME_CLOCK, "days"])
def test_dates_of_other_orders_and_durations_are_seconds(tmp_path: Path, pattern: str) -> None:
    """Over midnight, where day and month must not change places."""
    if pattern == "days":
        cells = [str(pd.Timedelta(86_395.25 + t, "s")) for t in T]
    else:
        cells = [(pd.Timestamp("2026-03-04T23:59:53") + pd.Timedelta(t, "s")).strftime(pattern) for t in T]
    rows = [f"{cell},{x}" for cell, x in zip(cells, X, strict=True)]
    found = table(tmp_path / "a.csv", "stamp,x\n" + "\n".join(rows))
    np.testing.assert_allclose(found.columns["stamp"], T, atol=1e-9)


def test_times_of_day_go_on_over_midnight(tmp_path: Path) -> None:
    clock = [np.datetime64("2026-11-25T23:59:52.00") + np.timedelta64(round(1e3 * t), "ms") for t in T]
    rows = [f"{str(each)[11:]},{x}" for each, x in zip(clock, X, strict=True)]
    rows[9] = f",{X[9]}"
    found = table(tmp_path / "a.csv", "time,x\n" + "\n".join(rows)).columns["time"]
    steps = np.diff(np.delete(found, 9))
    np.testing.assert_allclose(steps, np.diff(np.delete(T, 9)), atol=1e-9)


def test_lists_in_cells_words_truths_and_empty_cells(tmp_path: Path) -> None:
    ends = ["true," if t < 1 else f"false,{x}" for t, x in zip(T, X, strict=True)]
    rows = [f'STATE,{t},"[{x}, {-x}]",{end}' for t, x, end in zip(T, X, ends, strict=True)]
    found = table(tmp_path / "a.csv", "type,stamp,q,on,load\n" + "\n".join(rows))
    assert list(found.columns) == ["stamp", "q[0]", "q[1]", "on", "load"] and not found.aliases
    np.testing.assert_allclose(found.columns["q[1]"], -X)
    assert found.columns["on"].tolist() == (T < 1).astype(float).tolist()
    assert np.isnan(found.columns["load"][:4]).all() and found.columns["load"][4] == X[4]
    assert list(found.texts["type"]) == ["STATE"] * 60


@pytest.mark.parametrize("cell", ["[{x}, {y}]", "[{x} {y}]", "[ {x};{y} ]", "[{x}, nan]"])
def test_lists_of_any_separator(tmp_path: Path, cell: str) -> None:
    cells = [cell.format(x=x, y=2.0 * x) for x in X]
    cells[5] = ""
    rows = [f'{t},"{each}"' for t, each in zip(T, cells, strict=True)]
    found = table(tmp_path / "a.csv", "t,q\n" + "\n".join(rows)).columns
    second = np.full(60, np.nan) if "nan" in cell else 2.0 * X
    for name, expected in (("q[0]", X), ("q[1]", second)):
        np.testing.assert_array_equal(np.delete(found[name], 5), np.delete(expected, 5))
        assert np.isnan(found[name][5])


def test_a_word_in_a_column_of_numbers_is_an_empty_cell(tmp_path: Path) -> None:
    found = table(tmp_path / "a.csv", "t,x\n" + BODY.replace(ROWS[30], "7.5,overflow"))
    assert np.isnan(found.columns["x"][30]) and np.isfinite(np.delete(found.columns["x"], 30)).all()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        *((text, "row 1: no row of numbers was found") for text in ("t,x\n", "\n\n", "hello world\n" * 20)),
        ("t,x\n" + BODY + "1,2,3\n", "row 62: must have 2 columns, got 3"),
        (b"\x00\x01\x02" * 100, "is not of a format that is read"),
        (b"\xd0\xcf\x11\xe0" + bytes(99), "is an Excel file"),
        (b"", "is not of a format that is read"),
    ],
)
def test_text_that_is_no_table(tmp_path: Path, content: str | bytes, message: str) -> None:
    told = refusals(lambda: table(tmp_path / "a.csv", content))[0]
    assert message in told and told.startswith(f"{tmp_path}/a.csv: ")


CLOCK = np.round(np.arange(80) * 0.01, 3)
#: What every axis does: the order of the axes changes in the middle of a log.
AXES = {"lift": np.sin(4.0 * CLOCK), "boom": 2.0 + CLOCK, "slew": -CLOCK}


def order(k: int) -> list[str]:
    return list(AXES) if k < 33 else ["slew", "lift", "boom"]


def places(k: int) -> list[float]:
    return [float(AXES[name][k]) for name in order(k)]


def json_lines(path: Path) -> str:
    rows = [{"t": t, "name": order(k), "position": places(k)} for k, t in enumerate(CLOCK.tolist())]
    path.write_text("\n".join(map(json.dumps, rows)))
    return "position[{}]"


def things(path: Path) -> str:
    axes = [[{"id": name, "q": q} for name, q in zip(order(k), places(k), strict=True)] for k in range(80)]
    rows = [{"t": t, "axes": each} for t, each in zip(CLOCK.tolist(), axes, strict=True)]
    path.write_text(json.dumps(rows))
    return "axes[{}].q"


def rostopic(path: Path) -> str:
    head = ["%time", *(f"field.name{k}" for k in range(3)), *(f"field.position{k}" for k in range(3))]
    rows = [[t, *order(k), *places(k)] for k, t in enumerate(CLOCK.tolist())]
    path.write_text("\n".join(",".join(map(str, cells)) for cells in [head, *rows]))
    return "field.position[{}]"


def columns(path: Path) -> str:
    """As pandas flattens lists, with a column for every name and number."""
    log = {f"name_{j}": [order(k)[j] for k in range(80)] for j in range(3)}
    position = {f"q_{j}": [places(k)[j] for k in range(80)] for j in range(3)}
    pd.DataFrame({"t": CLOCK, **log, **position}).to_parquet(path)
    return "q[{}]"


def cells(path: Path) -> str:
    names, position = ([str(of(k)) for k in range(80)] for of in (order, places))
    pd.DataFrame({"t": CLOCK, "joints": names, "q": position}).to_csv(path, index=False)
    return "q[{}]"


def parquet(path: Path) -> str:
    names, position = ([of(k) for k in range(80)] for of in (order, places))
    pq.write_table(pa.table({"t": CLOCK, "joint_names": names, "q": position}), path)
    return "q[{}]"


def bag(path: Path, publishers: Sequence[str] = ("/driver",), together: bool = False) -> str:
    """Axes from one publisher after the other, or, together, from all of them with an offset of one each."""
    store = get_typestore(Stores.ROS1_NOETIC)
    kinds, none = store.types, np.empty(0)
    with rosbag1.Writer(path) as written:
        state = "sensor_msgs/msg/JointState"
        add = partial(written.add_connection, "/axes", state, typestore=store)
        topics = [add(callerid=name) for name in publishers]
        for k, t in enumerate(CLOCK.tolist()):
            stamp = round(t * 1e9) + 10**18
            time = kinds["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
            header = kinds["std_msgs/msg/Header"](seq=k, stamp=time, frame_id="")
            for j, topic in enumerate(topics):
                if together or k * len(topics) // len(CLOCK) == j:
                    position = np.array(places(k)) + j * together
                    message = kinds[state](header, order(k), position, none, none)
                    written.write(topic, stamp + 1000 * j, store.serialize_ros1(message, topic.msgtype))
    return "position[{}]"


CHANGING = {"a.jsonl": json_lines, "a.json": things, "a.csv": rostopic, "b.csv": cells, "a.parquet": parquet}
CHANGING |= {"a.bag": bag, "b.parquet": columns}


@pytest.mark.parametrize("file", CHANGING)
def test_elements_follow_their_names_when_the_order_changes(tmp_path: Path, file: str) -> None:
    column = CHANGING[file](tmp_path / file)
    (table,) = tables(tmp_path / file)
    for name, expected in AXES.items():
        np.testing.assert_allclose(table.columns[column.format(name)], expected, atol=1e-12)
    # a place in a list is that of the first row: no column holds two axes
    first = {table.aliases.get(key) for key in table.aliases}
    assert first == {column.format(name) for name in AXES} and len(table) == 80


def whole_file(path: Path) -> None:
    """Names of all rows, written once."""
    names, q = list(AXES), np.column_stack(list(AXES.values()))
    if path.suffix == ".npz":
        np.savez(path, t=CLOCK, axis_names=np.array(names), q=q)
    elif path.suffix == ".mat":
        savemat(path, {"t": CLOCK, "names": np.array(names, object), "q": q})
    elif path.suffix == ".json":
        path.write_text(json.dumps({"names": names, "t": CLOCK.tolist(), "q": q.tolist()}))
    else:
        with h5py.File(path, "w") as file:
            file["t"], file["q"], file.attrs["joint_names"] = CLOCK, q, names


@pytest.mark.parametrize("file", ["a.npz", "a.mat", "a.h5", "a.json"])
def test_names_of_a_whole_file_are_further_names(tmp_path: Path, file: str) -> None:
    whole_file(tmp_path / file)
    (table,) = (table for table in tables(tmp_path / file) if len(table) == 80)
    assert {f"q[{name}]": f"q[{k}]" for k, name in enumerate(AXES)} == table.aliases
    np.testing.assert_allclose(table.columns["q[2]"], AXES["slew"])


def test_names_of_every_row_of_arrays(tmp_path: Path) -> None:
    names, position = (np.array([of(k) for k in range(80)]) for of in (order, places))
    np.savez(tmp_path / "a.npz", t=CLOCK, names=names, q=position)
    (table,) = tables(tmp_path / "a.npz")
    np.testing.assert_allclose(table.columns["q[slew]"], AXES["slew"])


def test_publishers_of_other_things_are_tables_of_their_own(tmp_path: Path) -> None:
    rows = []
    for k, t in enumerate(CLOCK.tolist()):
        rows.append({"t": t, "name": ["tool"], "position": [5.0 + t], "effort": [1.0]})
        rows.append({"t": t + 0.005, "name": order(k)[:2], "position": places(k)[:2], "effort": []})
    (tmp_path / "a.jsonl").write_text("\n".join(map(json.dumps, rows)))
    tool, arm = tables(tmp_path / "a.jsonl")
    assert set(tool.columns) == {"t", "position[tool]", "effort[tool]"}
    assert tool.numbered(np.array([1, 2])).tolist() == [3, 5]
    np.testing.assert_allclose(tool.columns["t"], CLOCK)
    np.testing.assert_allclose(arm.columns["position[lift]"], AXES["lift"])
    assert np.isnan(arm.columns["position[boom]"][33:]).all()  # an axis that a row does not name
    assert not tool.aliases and not arm.aliases
    signals = {"angle": "position[lift]", "voltage": "position[tool]"}
    logs = read_logs(write(tmp_path, {}, files="a.jsonl", signals=signals), motor())
    assert logs.notes[0] == "V of another clock was read at the instants of position[lift]"
    np.testing.assert_allclose(logs.u[:, 0], 5.005 + CLOCK[:-1], atol=1e-12)


def test_a_row_of_text_with_fewer_elements_does_not_slip_into_others(tmp_path: Path) -> None:
    rostopic(tmp_path / "a.csv")
    lines = (tmp_path / "a.csv").read_text().splitlines()
    (tmp_path / "a.csv").write_text("\n".join([*lines[:40], "0.385,tool,7.5,9.5,1.5,3.5", *lines[40:]]))
    found = tables(tmp_path / "a.csv")
    table = next(each for each in found if "field.position[boom]" in each.columns)
    np.testing.assert_allclose(table.columns["field.position[boom]"], AXES["boom"])


def test_texts_that_are_no_names_change_no_order(tmp_path: Path) -> None:
    modes = [["speed", "torque"], ["torque", "speed"]]
    rows = [{"t": t, "mode": modes[k % 2], "q": [t, -t]} for k, t in enumerate(CLOCK.tolist())]
    (tmp_path / "a.json").write_text(json.dumps(rows))
    (table,) = tables(tmp_path / "a.json")
    np.testing.assert_allclose(table.columns["q[1]"], -CLOCK)
    assert not table.aliases


def test_publishers_of_the_same_things_are_apart_unless_they_follow_each_other(tmp_path: Path) -> None:
    bag(tmp_path / "a.bag", ("/driver", "/simulator"), together=True)
    driver, simulator = tables(tmp_path / "a.bag")
    assert (driver.name, simulator.name) == ("/axes@/driver", "/axes@/simulator")
    np.testing.assert_allclose(driver.columns["position[boom]"], AXES["boom"])
    np.testing.assert_allclose(simulator.columns["position[boom]"], AXES["boom"] + 1.0)
    found = known.read_files([tmp_path / "a.bag"], ["/axes@/simulator.position[boom]"], Faults())
    assert len(found[tmp_path / "a.bag"]) == 2
    signals = {"angle": "/axes.position[lift]", "voltage": "/axes.position[boom]"}
    write(tmp_path, {}, files="a.bag", time=None, signals=signals)
    words = r"in several tables .* write '/axes@/driver\.position\[lift\]', '/axes@/sim"
    with pytest.raises(BadInput, match=words):
        read_logs(tmp_path, motor())
    bag(tmp_path / "b.bag", ("/driver_1", "/driver_2"))
    (restarted,) = tables(tmp_path / "b.bag")
    np.testing.assert_allclose(restarted.columns["position[boom]"], AXES["boom"])


@pytest.mark.parametrize("count", [150, 450, 9000])
@pytest.mark.parametrize("setting", ['"gain_{0}",{0}', "gain {0} = {0}, fixed", "{0},{0}"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_settings_above_a_table_are_skipped(tmp_path: Path, count: int, setting: str, encoding: str) -> None:
    """However many they are: the table is what the file ends with."""
    rows = [f"{k},{t},{x}" for k, (t, x) in enumerate(zip(T, X, strict=True))]
    settings = [setting.format(k) for k in range(count)]
    found = table(tmp_path / "a.csv", "\n".join([*settings, "loop,t,x", *rows, ""]).encode(encoding))
    assert list(found.columns) == ["loop", "t", "x"] and found.first == count + 2
    np.testing.assert_allclose(found.columns["x"], X)


def test_messages_without_definitions_have_the_names_of_their_first_lines(tmp_path: Path) -> None:
    """Two kinds of lines of one width; and kinds of other widths, whose columns are numbered."""
    pairs = list(zip(T.tolist(), X.tolist(), strict=True))
    named = ["# rig 2", "GYR,time_ms,x,y", "MOT,time_ms,u,v"]
    named += [line for t, x in pairs for line in (f"GYR,{1e3 * t},{x},0", f"MOT,{1e3 * t},1,{x}")]
    bare = [line for t, x in pairs for line in (f"$GYR,{t},{x},0", f"$MOT,{t},{x}")]
    (tmp_path / "named.log").write_text("\n".join(named))
    (tmp_path / "bare.txt").write_text("\n".join(bare))
    gyro, motor_ = tables(tmp_path / "named.log")
    assert (gyro.name, motor_.name) == ("GYR", "MOT") and list(motor_.columns) == ["time_ms", "u", "v"]
    assert gyro.clock is not None and gyro.numbered(np.array([0, 1])).tolist() == [4, 6]
    np.testing.assert_allclose(gyro.clock, T)
    np.testing.assert_allclose(motor_.columns["v"], X)
    gyro, motor_ = tables(tmp_path / "bare.txt")
    assert (
        gyro.name == "$GYR" and list(gyro.columns) == ["1", "2", "3"] and list(motor_.columns) == ["1", "2"]
    )


@pytest.mark.parametrize("clock", ["", "t="])
@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
def test_messages_with_other_separators_begin_with_a_name_and_a_time(
    tmp_path: Path, separator: str, clock: str
) -> None:
    """Numbers may have their names before them; settings in the same dialect are no messages."""
    pairs = list(zip(T.tolist(), X.tolist(), strict=True))
    rows_of = [(("GYR", f"{clock}{t}", f"rate={x}"), ("MOT", f"{clock}{t + 0.001}", 7, x)) for t, x in pairs]
    cells = [cell for row in rows_of for cell in row]
    path = tmp_path / "rig.txt"
    path.write_text("\n".join(separator.join(map(str, row)) for row in cells))
    gyro, motor_ = tables(path)
    assert (gyro.name, motor_.name) == ("GYR", "MOT")
    assert list(motor_.columns) == [clock.removesuffix("=") or "1", "2", "3"]
    assert clock == "" or np.allclose(gyro.clock, T)  # type: ignore[arg-type]
    np.testing.assert_allclose(gyro.columns["rate"], X)
    np.testing.assert_allclose(motor_.columns["3"], X)
    settings = [
        separator.join((*each, "")) for k in range(9) for each in (("gain", f"{-k}"), ("limit", "2", "a"))
    ]
    rows = [f"{t},{x},0" for t, x in pairs]
    path.write_text("\n".join([*settings, "t,x,y", *rows]))
    assert list(table(path, path.read_text()).columns) == ["t", "x", "y"]


def test_the_checksum_of_a_sentence_is_no_cell(tmp_path: Path) -> None:
    lines = [line for t, x in zip(T, X, strict=True) for line in (f"$WTR,{t},{x}*7A", f"$RUD,{t},1,{x}*0F")]
    (tmp_path / "boat.nmea").write_text("\r\n".join(lines))
    water, rudder = tables(tmp_path / "boat.nmea")
    np.testing.assert_allclose(water.columns["2"], X)
    np.testing.assert_allclose(rudder.columns["3"], X)


def test_lines_of_a_journal_have_names_before_their_numbers(tmp_path: Path) -> None:
    rows = [
        f"2031-04-01T08:00:{t:09.6f}Z pump2 level={x:.6f} m flow={2.0 * x:.6f} state=run"
        for t, x in zip(T, X, strict=True)
    ]
    found = table(tmp_path / "journal.log", "\n".join(rows))
    np.testing.assert_allclose(found.columns["level"], X, atol=1e-6)
    np.testing.assert_allclose(found.columns["flow"], 2.0 * X, atol=1e-6)


@pytest.mark.parametrize("line", ["(16{0}.25) can1 0C4#00FF{0}", "  can0  18F00400   [8]  00 {0}"])
def test_frames_of_a_bus_are_named(tmp_path: Path, line: str) -> None:
    told = refusals(lambda: table(tmp_path / "a.log", "\n".join(line.format(k) for k in range(10, 80))))[0]
    assert "is a log of CAN frames, not a table: decode it by its DBC file" in told


def test_messages_of_several_sensors_have_units_and_tables_of_their_own(tmp_path: Path) -> None:
    path = recorders.messages(tmp_path / "a.log")
    path.write_text(f'{path.read_text()}MSG, 9, "quad, of the shed\nARM, 12')  # a quote, and a line cut off
    found = {each.name: each for each in tables(path)}
    assert set(found) == {"ARM", "ARM_1", "MOT", "MSG"}
    assert found["MOT"].units["Volt"] == "V" and found["ARM"].units["TimeUS"] == "us"
    assert found["ARM_1"].columns["Rest"].tolist() == [0.5] * len(recorders.T)
