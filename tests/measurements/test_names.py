"""Names beside lists: every element follows its name, in every format, whatever its place in a row."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml
from rosbags import rosbag1
from rosbags.typesys import Stores, get_typestore
from scipy.io import savemat

from tests.measurements.systems import motor
from unmodelled.base.errors import BadInput, Faults
from unmodelled.logs.folder import read_logs
from unmodelled.logs.readers import known
from unmodelled.logs.readers.reader import Table

T = np.round(np.arange(80) * 0.01, 3)
#: What every axis does: the order of the axes changes in the middle of a log.
AXES = {"lift": np.sin(4.0 * T), "boom": 2.0 + T, "slew": -T}


def order(k: int) -> list[str]:
    return list(AXES) if k < 33 else ["slew", "lift", "boom"]


def row(k: int) -> dict[str, float]:
    return {name: float(AXES[name][k]) for name in order(k)}


def tables(path: Path) -> list[Table]:
    faults = Faults()
    found = known.read_files([path], None, faults)
    faults.check()
    return found[path]


def json_lines(path: Path) -> str:
    rows = [
        {"t": t, "name": list(row(k)), "position": list(row(k).values())} for k, t in enumerate(T.tolist())
    ]
    path.write_text("\n".join(map(json.dumps, rows)))
    return "position[{}]"


def things(path: Path) -> str:
    rows = [
        {"t": t, "axes": [{"id": name, "q": q} for name, q in row(k).items()]}
        for k, t in enumerate(T.tolist())
    ]
    path.write_text(json.dumps(rows))
    return "axes[{}].q"


def rostopic(path: Path) -> str:
    head = ["%time", *(f"field.name{k}" for k in range(3)), *(f"field.position{k}" for k in range(3))]
    rows = [[t, *row(k), *row(k).values()] for k, t in enumerate(T.tolist())]
    path.write_text("\n".join(",".join(map(str, cells)) for cells in [head, *rows]))
    return "field.position[{}]"


def columns(path: Path) -> str:
    """As pandas flattens lists, with a column for every name and number."""
    log = {f"name_{j}": [order(k)[j] for k in range(80)] for j in range(3)}
    position = {f"q_{j}": [list(row(k).values())[j] for k in range(80)] for j in range(3)}
    pd.DataFrame({"t": T, **log, **position}).to_parquet(path)
    return "q[{}]"


def cells(path: Path) -> str:
    log = {
        "t": T,
        "joints": [str(order(k)) for k in range(80)],
        "q": [str(list(row(k).values())) for k in range(80)],
    }
    pd.DataFrame(log).to_csv(path, index=False)
    return "q[{}]"


def parquet(path: Path) -> str:
    names, position = [order(k) for k in range(80)], [list(row(k).values()) for k in range(80)]
    pq.write_table(pa.table({"t": T, "joint_names": names, "q": position}), path)
    return "q[{}]"


def bag(path: Path, publishers: Sequence[str] = ("/driver",), together: bool = False) -> str:
    """Axes from one publisher after the other, or, together, from all of them with an offset of one each."""
    store = get_typestore(Stores.ROS1_NOETIC)
    kinds, none = store.types, np.empty(0)
    with rosbag1.Writer(path) as written:
        topics = [
            written.add_connection("/axes", "sensor_msgs/msg/JointState", typestore=store, callerid=name)
            for name in publishers
        ]
        for k, t in enumerate(T.tolist()):
            stamp = round(t * 1e9) + 10**18
            time = kinds["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
            header = kinds["std_msgs/msg/Header"](seq=k, stamp=time, frame_id="")
            for j, topic in enumerate(topics):
                if together or k * len(topics) // len(T) == j:
                    position = np.array(list(row(k).values())) + j * together
                    message = kinds["sensor_msgs/msg/JointState"](header, order(k), position, none, none)
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


def matrix(rows: int = 80) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    return np.column_stack(list(AXES.values()))[:rows]


def npz(path: Path) -> None:
    np.savez(path, t=T, axis_names=np.array(list(AXES)), q=matrix())


def mat(path: Path) -> None:
    savemat(path, {"t": T, "names": np.array(list(AXES), object), "q": matrix()})


def hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["t"], file["q"], file.attrs["joint_names"] = T, matrix(), list(AXES)


def json_columns(path: Path) -> None:
    path.write_text(json.dumps({"names": list(AXES), "t": T.tolist(), "q": matrix().tolist()}))


@pytest.mark.parametrize(
    ("file", "write"), [("a.npz", npz), ("a.mat", mat), ("a.h5", hdf5), ("a.json", json_columns)]
)
def test_names_of_a_whole_file_are_further_names(
    tmp_path: Path, file: str, write: Callable[[Path], None]
) -> None:
    write(tmp_path / file)
    (table,) = (table for table in tables(tmp_path / file) if len(table) == 80)
    assert {f"q[{name}]": f"q[{k}]" for k, name in enumerate(AXES)} == table.aliases
    np.testing.assert_allclose(table.columns["q[2]"], AXES["slew"])


def test_names_of_every_row_of_arrays(tmp_path: Path) -> None:
    names = np.array([order(k) for k in range(80)])
    np.savez(tmp_path / "a.npz", t=T, names=names, q=np.array([list(row(k).values()) for k in range(80)]))
    (table,) = tables(tmp_path / "a.npz")
    np.testing.assert_allclose(table.columns["q[slew]"], AXES["slew"])


def test_publishers_of_other_things_are_tables_of_their_own(tmp_path: Path) -> None:
    rows = []
    for k, t in enumerate(T.tolist()):
        rows.append({"t": t, "name": ["tool"], "position": [5.0 + t], "effort": [1.0]})
        rows.append(
            {"t": t + 0.005, "name": order(k)[:2], "position": list(row(k).values())[:2], "effort": []}
        )
    (tmp_path / "a.jsonl").write_text("\n".join(map(json.dumps, rows)))
    tool, arm = tables(tmp_path / "a.jsonl")
    assert set(tool.columns) == {"t", "position[tool]", "effort[tool]"}
    assert tool.numbered(np.array([1, 2])).tolist() == [3, 5]
    np.testing.assert_allclose(tool.columns["t"], T)
    np.testing.assert_allclose(arm.columns["position[lift]"], AXES["lift"])
    assert np.isnan(arm.columns["position[boom]"][33:]).all()  # an axis that a row does not name
    assert not tool.aliases and not arm.aliases
    mapping = {
        "schema": "mapping/1",
        "files": "a.jsonl",
        "time": "t",
        "signals": {"angle": "position[lift]", "voltage": "position[tool]"},
        "constants": {"m": 0.5},
    }
    (tmp_path / "mapping.yaml").write_text(yaml.safe_dump(mapping))
    logs = read_logs(tmp_path, motor())
    assert logs.notes[0] == "V of another clock was read at the instants of position[lift]"
    np.testing.assert_allclose(logs.u[:, 0], 5.005 + T[:-1], atol=1e-12)


def test_a_row_of_text_with_fewer_elements_does_not_slip_into_others(tmp_path: Path) -> None:
    rostopic(tmp_path / "a.csv")
    lines = (tmp_path / "a.csv").read_text().splitlines()
    (tmp_path / "a.csv").write_text("\n".join([*lines[:40], "0.385,tool,7.5,9.5,1.5,3.5", *lines[40:]]))
    found = tables(tmp_path / "a.csv")
    table = next(each for each in found if "field.position[boom]" in each.columns)
    np.testing.assert_allclose(table.columns["field.position[boom]"], AXES["boom"])


def test_texts_that_are_no_names_change_no_order(tmp_path: Path) -> None:
    modes = [["speed", "torque"], ["torque", "speed"]]
    rows = [{"t": t, "mode": modes[k % 2], "q": [t, -t]} for k, t in enumerate(T.tolist())]
    (tmp_path / "a.json").write_text(json.dumps(rows))
    (table,) = tables(tmp_path / "a.json")
    np.testing.assert_allclose(table.columns["q[1]"], -T)
    assert not table.aliases


def test_publishers_of_the_same_things_are_apart_unless_they_follow_each_other(tmp_path: Path) -> None:
    bag(tmp_path / "a.bag", ("/driver", "/simulator"), together=True)
    driver, simulator = tables(tmp_path / "a.bag")
    assert (driver.name, simulator.name) == ("/axes@/driver", "/axes@/simulator")
    np.testing.assert_allclose(driver.columns["position[boom]"], AXES["boom"])
    np.testing.assert_allclose(simulator.columns["position[boom]"], AXES["boom"] + 1.0)
    found = known.read_files([tmp_path / "a.bag"], ["/axes@/simulator.position[boom]"], Faults())
    assert len(found[tmp_path / "a.bag"]) == 2
    mapping = {
        "schema": "mapping/1",
        "files": "a.bag",
        "signals": {"angle": "/axes.position[lift]", "voltage": "/axes.position[boom]"},
        "constants": {"m": 0.5},
    }
    (tmp_path / "mapping.yaml").write_text(yaml.safe_dump(mapping))
    with pytest.raises(
        BadInput, match=r"in several tables .* write '/axes@/driver\.position\[lift\]', '/axes@/sim"
    ):
        read_logs(tmp_path, motor())
    bag(tmp_path / "b.bag", ("/driver_1", "/driver_2"))
    (restarted,) = tables(tmp_path / "b.bag")
    np.testing.assert_allclose(restarted.columns["position[boom]"], AXES["boom"])
