"""The verb init: what it recognises in logs of known machines, and that simulate accepts what it writes."""

import json
import time
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest
import yaml
from scipy.io import savemat

from tests.machines.folders import Array, text_of
from tests.measurements.recorders import ANGLE, RECORDERS
from unmodelled.api.simulation import simulate
from unmodelled.base.errors import BadInput
from unmodelled.cli.verbs.init import init
from unmodelled.logs.folder import read_logs
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

INERTIA, FRICTION, GRAVITY = 0.02, 0.05, 0.3


def pendulum(seed: int, n: int = 1500, period: float = 0.004) -> dict[str, Array]:
    """Angle (rad), speed and torque of a pendulum with viscous friction, by Euler steps of a tenth."""
    generator = np.random.default_rng(seed)
    t = np.arange(n) * period
    phase, rate = generator.uniform(0.0, 6.0, 3), generator.uniform(2.0, 9.0, 3)
    torque = 0.12 * np.sin(np.outer(t, rate) + phase).sum(axis=1)
    angle, speed = np.zeros(n), np.zeros(n)
    for i in range(1, n):
        q, w = angle[i - 1], speed[i - 1]
        for _ in range(10):
            w += 0.1 * period * (torque[i - 1] - FRICTION * w - GRAVITY * np.sin(q)) / INERTIA
            q += 0.1 * period * w
        angle[i], speed[i] = q, w
    return {"t": t, "angle": angle, "speed": speed, "torque": torque}


LOGS = [pendulum(seed) for seed in range(3)]


def put(folder: Path, tables: Iterable[Mapping[str, Array] | pd.DataFrame], name: str = "{}.csv") -> Path:
    """A folder with a CSV file per table, with its number in the name."""
    folder.mkdir(exist_ok=True)
    for k, table in enumerate(tables):
        pd.DataFrame(table).to_csv(folder / name.format(k), index=False)
    return folder


def write(folder: Path, columns: Mapping[str, str], **factors: float) -> Path:
    """A folder with a CSV file per log: columns by the names of `pendulum`, times a factor."""
    tables = ({name: log[own] * factors.get(own, 1.0) for name, own in columns.items()} for log in LOGS)
    return put(folder, tables, "run {}.csv")


def columns_of(mapping: Mapping[str, Any]) -> dict[str, str]:
    return {name: signal["column"] for name, signal in mapping["signals"].items()}


def drafted(logs: Path) -> tuple[dict[str, Any], System]:
    init(logs, None, None, None)
    folder = logs if logs.is_dir() else logs.parent
    content = yaml.safe_load((folder / "mapping.yaml").read_text())
    return content, read_system(folder / "system.yaml")


def values(system: System) -> dict[str, float]:
    return {parameter.name: parameter.value for parameter in system.parameters}


def test_names_tell_clock_position_speed_and_drive(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    columns = {"Time [ms]": "t", "motor_pos_deg": "angle", "speed (rpm)": "speed", "torque": "torque"}
    logs = write(tmp_path / "raw", columns, t=1e3, angle=180.0 / np.pi, speed=30.0 / np.pi)
    mapping, system = drafted(logs)
    assert mapping["files"] == "*.csv" and mapping["time"] == {"column": "Time [ms]", "unit": "ms"}
    assert mapping["signals"] == {
        "q": {"column": "motor_pos_deg", "unit": "deg"},
        "w": {"column": "speed (rpm)", "unit": "rpm"},
        "u": {"column": "torque", "unit": "N m"},
    }
    read = read_logs(logs, system)
    np.testing.assert_allclose(
        read.y[: len(LOGS[0]["t"])], np.c_[LOGS[0]["angle"], LOGS[0]["speed"]], atol=1e-12
    )
    assert values(system)["J"] == pytest.approx(INERTIA, rel=0.05)
    assert values(system)["b"] == pytest.approx(FRICTION, rel=0.1)
    assert simulate(system, read).gap.value < 10.0
    told = capsys.readouterr().out
    assert "motor_pos_deg  250 Hz" in told and "q, position" in told and "u, drive" in told
    assert f"next: unmodelled simulate system={logs}/system.yaml logs={logs} out=simulation" in told
    text = (logs / "mapping.yaml").read_text()
    assert [line for line in text.splitlines() if "Question" in line] == [
        "  u: {column: torque, unit: N m}  # Question: is it in N m?"
    ]


def test_values_tell_what_columns_without_names_are(tmp_path: Path) -> None:
    folder = tmp_path / "raw"
    folder.mkdir()
    for k, log in enumerate(LOGS):
        noise = np.random.default_rng(k).normal(size=len(log["t"]))
        table = [log["t"] + 1000.0, noise, log["speed"], log["torque"], log["angle"]]
        np.savetxt(folder / f"{k}.csv", np.column_stack(table), delimiter=",")
    mapping, system = drafted(folder)
    assert mapping["time"]["column"] == "1" and columns_of(mapping) == {"q": "5", "w": "3", "u": "4"}
    assert values(system)["J"] == pytest.approx(INERTIA, rel=0.05)


def test_a_drive_with_the_other_sign_is_turned_with_a_question(tmp_path: Path) -> None:
    logs = write(tmp_path / "raw", {"t": "t", "theta": "angle", "torque": "torque"}, torque=-1.0)
    mapping, system = drafted(logs)
    assert mapping["signals"]["u"] == {"column": "torque", "unit": "N m", "sign": -1}
    assert "is it logged with the other sign?" in (logs / "mapping.yaml").read_text()
    assert values(system)["J"] == pytest.approx(INERTIA, rel=0.05)
    np.testing.assert_allclose(read_logs(logs, system).u[: len(LOGS[0]["t"]), 0], LOGS[0]["torque"])


def test_a_position_that_is_nearly_another_one_is_a_question(tmp_path: Path) -> None:
    named = {"t": "t", "motor_angle": "angle", "load_angle": "angle", "torque": "torque"}
    mapping, system = drafted(write(tmp_path / "raw", named))
    assert mapping["signals"].keys() == {"q", "u"} and len(system.outputs) == 1
    text = (tmp_path / "raw" / "mapping.yaml").read_text()
    assert text.count("# Question: load_angle is nearly motor_angle.") == 1


def test_a_current_gets_a_torque_constant(tmp_path: Path) -> None:
    logs = write(tmp_path / "raw", {"t": "t", "theta": "angle", "current_mA": "torque"}, torque=2e3)
    mapping, system = drafted(logs)
    assert mapping["signals"]["u"] == {"column": "current_mA", "unit": "mA"}
    assert values(system)["k"] == 1.0 and values(system)["J"] == pytest.approx(2.0 * INERTIA, rel=0.05)
    assert "which N m does one A of u make?" in (logs / "system.yaml").read_text()
    assert [parameter.name for parameter in system.parameters if parameter.guess] == ["k"]
    assert simulate(system, read_logs(logs, system)).gap.value < 10.0


def test_several_joints_are_told_apart_by_their_numbers(tmp_path: Path) -> None:
    tables = []
    for logs in pairwise(LOGS):
        table = {"t": logs[0]["t"]}
        for number, log in enumerate(logs, 1):
            table |= {f"tau_{number}": log["torque"], f"vel_{number}": log["speed"]}
            table |= {f"pos_filt_{number}": log["angle"] * 1.001, f"pos_meas_{number}": log["angle"]}
        tables.append(table)
    folder = put(tmp_path / "raw", tables)
    mapping, system = drafted(folder)
    assert columns_of(mapping) == {
        f"{own}{n}": f"{name}_{n}"
        for n in (1, 2)
        for own, name in (("q", "pos_meas"), ("w", "vel"), ("u", "tau"))
    }
    assert system.port_names == ("joint1", "joint2")
    assert simulate(system, read_logs(folder, system)).gap.value < 10.0


def servo(seed: int) -> dict[str, Array]:
    """A servo of 8 rad/s that follows steps."""
    generator = np.random.default_rng(seed)
    t = np.arange(1500) * 0.01
    goal = np.repeat(generator.uniform(-1.0, 1.0, 15), 100)
    q, w = np.zeros(1500), np.zeros(1500)
    for i in range(1, 1500):
        q[i], w[i] = q[i - 1], w[i - 1]
        for _ in range(10):
            w[i] += 1e-3 * (64.0 * (goal[i - 1] - q[i]) - 12.0 * w[i])
            q[i] += 1e-3 * w[i]
    return {"t": t, "goal": goal, "q": q}


@pytest.mark.parametrize("order", [("torque shoulder", "torque elbow"), ("torque elbow", "torque shoulder")])
def test_several_joints_are_told_apart_by_their_words(tmp_path: Path, order: tuple[str, str]) -> None:
    tables = []
    for k, one in enumerate(LOGS):
        # the drives are not theirs, so that the values tell nothing
        columns = {"t": one["t"], "shoulder pos": one["angle"], "elbow pos": LOGS[(k + 1) % 3]["angle"]}
        tables.append(columns | dict(zip(order, (LOGS[(k + 2) % 3]["torque"], one["torque"]), strict=True)))
    found = columns_of(drafted(put(tmp_path / "raw", tables))[0])
    assert [found[name] for name in ("q1", "u1")] == ["shoulder pos", "torque shoulder"]
    assert [found[name] for name in ("q2", "u2")] == ["elbow pos", "torque elbow"]


def test_messages_of_a_servo_follow_a_commanded_position(tmp_path: Path) -> None:
    for k in range(2):
        log = servo(k)
        rows = zip(log["t"].tolist(), log["goal"].tolist(), log["q"].tolist(), strict=True)
        entries = [{"timestamp": t, "goal_position": goal, "position": q} for t, goal, q in rows]
        (tmp_path / f"{k}.json").write_text(json.dumps({"mass": 0.5, "entries": entries}))
    mapping, system = drafted(tmp_path)
    assert mapping["signals"]["u"] == {"column": "entries.goal_position", "unit": "rad"}
    assert values(system)["K"] == pytest.approx(64.0, rel=0.1)
    assert values(system)["D"] == pytest.approx(12.0, rel=0.1)
    assert "# constants: {mass: {column: mass}}" in (tmp_path / "mapping.yaml").read_text()
    assert simulate(system, read_logs(tmp_path, system)).gap.value < 0.2


def test_a_joint_that_lags_far_behind_has_the_set_point_of_the_others(tmp_path: Path) -> None:
    tables = []
    for log in map(servo, range(2)):
        late, near = (np.interp(log["t"] - lag, log["t"], log["q"]) for lag in (0.5, 0.05))
        joints = {"goal 1": log["q"], "pos 1": late, "goal 2": log["q"][::-1], "pos 2": near[::-1]}
        tables.append({"t": log["t"], **joints})
    mapping, _ = drafted(put(tmp_path / "raw", tables))
    units = {signal["column"]: signal["unit"] for signal in mapping["signals"].values()}
    assert units == {"goal 1": "rad", "pos 1": "rad", "goal 2": "rad", "pos 2": "rad"}


def test_a_set_point_of_nothing_is_a_position_where_the_position_follows_it(tmp_path: Path) -> None:
    """Beside it, a command that the position does not follow drives it."""
    logs = write(tmp_path / "raw", {"t": "t", "goal": "angle", "pos": "angle", "set": "torque"})
    for path in logs.iterdir():
        table = pd.read_csv(path)
        sagging = 0.9 * table["pos"].shift(5, fill_value=table["pos"][0]) + 0.4
        table.assign(pos=sagging).to_csv(path, index=False)
    mapping, system = drafted(logs)
    assert mapping["signals"] == {
        "q": {"column": "pos", "unit": "rad"},
        "u": {"column": "goal", "unit": "rad"},
    }
    assert system.inputs[0].unit == "rad"


@pytest.mark.parametrize("name", [name for name in RECORDERS if name != "bag_2"])
def test_files_of_every_format(tmp_path: Path, name: str) -> None:
    """The bag of ROS 2 has two topics with the column `data`: nothing says that one is a position."""
    RECORDERS[name].write(tmp_path / RECORDERS[name].file)
    mapping, system = drafted(tmp_path)
    assert mapping["files"] == f"*{Path(RECORDERS[name].file).suffix}"
    assert mapping["signals"]["q"]["column"] in (RECORDERS[name].angle, "/joint_states.position[1]")
    np.testing.assert_allclose(read_logs(tmp_path, system).y[:, 0], ANGLE, atol=1e-7)


def test_a_clock_in_another_table_is_found(tmp_path: Path) -> None:
    log = LOGS[0]
    arm = {"t": log["t"], "joint": {"position": log["angle"], "torque": log["torque"]}}
    savemat(tmp_path / "a.mat", {"arm": arm})
    mapping, system = drafted(tmp_path)
    assert mapping["time"] == {"column": "t", "unit": "s"}
    assert mapping["signals"]["u"]["column"] == "arm.joint.torque"
    np.testing.assert_allclose(read_logs(tmp_path, system).u[:100, 0], log["torque"][:100])


def test_one_record_is_cut_into_experiments(tmp_path: Path) -> None:
    pd.DataFrame(LOGS[0]).to_csv(tmp_path / "record.csv", index=False)
    mapping, system = drafted(tmp_path / "record.csv")
    assert mapping["cut"] == "0.75 s" and len(read_logs(tmp_path, system)) == 8


@pytest.mark.long
def test_folders_with_equal_files_are_experiments(tmp_path: Path) -> None:
    for k, log in enumerate(LOGS):
        (tmp_path / f"run{k}").mkdir()
        for name, own in (("state", ["angle", "speed"]), ("control", ["torque"])):
            table = {"timestamp": log["t"] * 1e6, **{each: log[each] for each in own}}
            pd.DataFrame(table).to_csv(tmp_path / f"run{k}" / f"{name}.csv", index=False)
    mapping, system = drafted(tmp_path)
    assert mapping["files"] == "*/"
    assert mapping["signals"]["u"]["column"] == "control.torque"
    assert read_logs(tmp_path, system).ids == ("run0", "run1", "run2")


def test_other_files_and_dead_records_are_left_out_with_the_reason(tmp_path: Path) -> None:
    logs = write(tmp_path / "raw", {"t": "t", "theta": "angle", "torque": "torque"})
    table = pd.read_csv(logs / "run 0.csv")
    table.assign(theta=0.0).to_csv(logs / "dead.csv", index=False)
    table.assign(t=2.0 * table["t"]).to_csv(logs / "slow.csv", index=False)
    (logs / "notes.txt").write_text("a note\n")
    (logs / "other.csv").write_text("a,b\n1,2\n3,4\n")
    mapping, system = drafted(logs)
    assert mapping["files"] == ["run 0.csv", "run 1.csv", "run 2.csv", "slow.csv"]
    text = (logs / "mapping.yaml").read_text()
    assert "# left out: dead.csv (theta does not change while time increases)" in text
    assert "# left out: other.csv (other columns)" in text and "# left out: notes.txt (row 1: no row" in text
    assert len(read_logs(logs, system)) == 4


def write_groups(file: Path, place: str) -> Path:
    """An HDF5 file with a group per log, in which drive and motion are groups of their own."""
    with h5py.File(file, "w") as content:
        for k, log in enumerate(LOGS):
            run = content.create_group(f"{place}/run_{k}")
            for name, columns in {
                "motion": {"theta": "angle", "w": "speed"},
                "drive": {"torque": "torque"},
            }.items():
                inner = run.create_group(name)
                inner["t"] = log["t"]
                for column, own in columns.items():
                    inner[column] = log[own]
    return file


@pytest.mark.parametrize(("place", "pattern"), [("/", "*"), ("/data", "data/*")])
def test_groups_of_a_file_are_experiments(tmp_path: Path, place: str, pattern: str) -> None:
    mapping, system = drafted(write_groups(tmp_path / "campaign.h5", place))
    assert mapping["files"] == "campaign.h5" and mapping["groups"] == pattern
    assert mapping["signals"]["u"]["column"] == "drive.torque"
    logs = read_logs(tmp_path, system)
    assert logs.ids == ("run_0", "run_1", "run_2")
    np.testing.assert_allclose(logs.y[:, 0], np.concatenate([log["angle"] for log in LOGS]), atol=1e-12)


def test_groups_in_which_nothing_moves_are_left_out(tmp_path: Path) -> None:
    file = write_groups(tmp_path / "campaign.h5", "/")
    with h5py.File(file, "a") as content:
        content["run_1/motion/theta"][:] = 0.0
    mapping, system = drafted(tmp_path)  # with nothing else in the folder
    assert mapping["files"] == "*.h5" and mapping["groups"] == ["run_0", "run_2"]
    assert read_logs(tmp_path, system).ids == ("run_0", "run_2")


def arm_of_servos(rests: Mapping[str, bool], seed: int) -> pd.DataFrame:
    """Columns of joints, of which some rest."""
    table = dict[str, Array]()
    for k, (joint, still) in enumerate(rests.items()):
        moved = servo(seed + 10 * k)
        for column, own in {f"pos_{joint}": "q", f"goal_{joint}": "goal"}.items():
            table[column] = np.full_like(moved["t"], 0.2) if still else moved[own]
    return pd.DataFrame({"t": moved["t"]} | table)


def test_recordings_in_which_joints_rest_stay_and_so_do_the_joints(tmp_path: Path) -> None:
    """Knee and toe move in one of four recordings, and in the last one, none does."""
    moving = [{"hip", "knee"}, {"hip", "toe"}, {"hip"}, set[str]()]
    rests = [{joint: joint not in here for joint in ("hip", "knee", "toe")} for here in moving]
    logs = put(tmp_path / "raw", map(arm_of_servos, rests, range(4)), "run {}.csv")
    mapping, system = drafted(logs)
    assert mapping["files"] == ["run 0.csv", "run 1.csv", "run 2.csv"]
    text = (logs / "mapping.yaml").read_text()
    assert "# left out: run 3.csv (pos_hip, pos_knee, pos_toe do not change while time increases)" in text
    assert [mapping["signals"][f"q{k}"]["column"] for k in (1, 2, 3)] == ["pos_hip", "pos_knee", "pos_toe"]
    assert np.isfinite(simulate(system, read_logs(logs, system)).gap.value)


def test_a_record_in_which_joints_move_one_after_the_other_is_cut(tmp_path: Path) -> None:
    first, then = (arm_of_servos({"hip": not hip, "knee": hip}, 0) for hip in (True, False))
    then["t"] += 2.0 * first["t"].iloc[-1] - first["t"].iloc[-2]
    logs = put(tmp_path / "raw", [pd.concat([first, then])])
    mapping, system = drafted(logs)
    assert float(mapping["cut"].removesuffix(" s")) < first["t"].iloc[-1]
    assert np.isfinite(simulate(system, read_logs(logs, system)).gap.value)


def test_elements_of_a_list_have_one_unit(tmp_path: Path) -> None:
    tables = []
    for k in range(3):
        table = {"t": servo(k)["t"]}
        for joint, log, size in ((1, servo(k), 1.0), (2, servo(k + 10), 0.1)):
            goal, q = size * np.degrees([log["goal"], log["q"]])
            table |= {f"q{joint}": q, f"goal_pos{joint}": goal}
        assert np.ptp(table["q2"]) < 40.0 < np.ptp(table["q1"])
        tables.append(table)
    mapping, _ = drafted(put(tmp_path / "raw", tables))
    assert [mapping["signals"][name]["unit"] for name in ("q1", "q2", "u1", "u2")] == ["deg"] * 4


def test_a_file_as_the_folder_of_a_mapping_is_refused(tmp_path: Path) -> None:
    logs = write(tmp_path / "raw", {"t": "t", "theta": "angle", "torque": "torque"})
    with pytest.raises(BadInput, match="must be a folder, in which mapping"):
        init(logs, None, None, tmp_path / "mine.yaml")
    assert not (tmp_path / "mine.yaml").exists()


def test_files_may_be_written_elsewhere(tmp_path: Path) -> None:
    logs = write(tmp_path / "raw", {"t": "t", "theta": "angle", "torque": "torque"})
    init(logs, None, tmp_path / "models" / "pendulum.yaml", tmp_path / "mine")
    assert yaml.safe_load((tmp_path / "mine" / "mapping.yaml").read_text())["files"] == "../raw/*.csv"
    assert len(read_logs(tmp_path / "mine", read_system(tmp_path / "models" / "pendulum.yaml"))) == 3
    assert sorted(path.name for path in logs.iterdir()) == ["run 0.csv", "run 1.csv", "run 2.csv"]


@pytest.mark.parametrize("name", ["mapping.yaml", "system.yaml"])
def test_no_file_is_overwritten(tmp_path: Path, name: str) -> None:
    logs = write(tmp_path / "raw", {"t": "t", "theta": "angle", "torque": "torque"})
    (logs / name).write_text("mine")
    with pytest.raises(BadInput, match="exists, and is not overwritten"):
        init(logs, None, None, None)
    assert (logs / name).read_text() == "mine" and len(list(logs.iterdir())) == 4


def test_logs_that_cannot_be_used_are_refused(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "tidy").mkdir()
    (tmp_path / "tidy" / "experiments.csv").write_text("id,file\n")
    put(tmp_path / "still", [{"t": LOGS[0]["t"], "humidity": LOGS[0]["torque"]}])
    (tmp_path / "zip").mkdir()
    (tmp_path / "zip" / "a.csv").write_bytes(b"PK\x03\x04" + bytes(60))
    for name, message in (
        ("nowhere", "no such file or folder"),
        ("empty", "holds no files"),
        ("tidy", "is a log folder already"),
        ("still", "no moving position and no level was found among the columns 'humidity'"),
        ("zip", "no file in it can be read; the first one: is a zip archive"),
    ):
        with pytest.raises(BadInput, match=message) as caught:
            init(tmp_path / name, None, None, None)
        assert str(caught.value).startswith(str(tmp_path / name))
        assert not (tmp_path / name / "mapping.yaml").exists()


def test_a_lerobot_data_set(tmp_path: Path) -> None:
    place = tmp_path / "data" / "chunk-000"
    place.mkdir(parents=True)
    (tmp_path / "meta").mkdir()
    names = {"names": ["pan.pos", "lift.pos"]}
    action = {"names": {"motors": names["names"]}}
    info = {"fps": 100, "features": {"observation.state": names, "action": action}}
    (tmp_path / "meta" / "info.json").write_text(json.dumps(info))
    (tmp_path / "meta" / "tasks.jsonl").write_text('{"task_index": 0, "task": "pick"}\n')
    for episode in range(3):
        pan, lift = servo(episode), servo(episode + 10)
        table = {
            "observation.state": np.column_stack([pan["q"], lift["q"]]).tolist(),
            "action": np.column_stack([pan["goal"], lift["goal"]]).tolist(),
            "timestamp": pan["t"].astype(np.float32),
            "episode_index": np.full(len(pan["t"]), episode),
        }
        pd.DataFrame(table).to_parquet(place / f"episode_{episode:06d}.parquet")
    mapping, system = drafted(tmp_path)
    assert mapping["files"] == "data/chunk-000/*.parquet"
    assert mapping["signals"]["u2"] == {"column": "action[lift.pos]", "unit": "rad"}
    assert values(system)["K2"] == pytest.approx(64.0, rel=0.1)
    assert simulate(system, read_logs(tmp_path, system)).gap.value < 0.2


def test_names_of_elements_tell_positions_from_speeds(tmp_path: Path) -> None:
    (tmp_path / "meta").mkdir()
    state = {"names": ["hip.pos", "knee.pos", "hip.vel", "knee.vel"]}
    torques = {"names": ["hip.torque", "knee.torque"]}
    info = {"features": {"observation.state": state, "action": torques}}
    (tmp_path / "meta" / "info.json").write_text(json.dumps(info))
    for k in range(3):
        hip, knee = LOGS[k], LOGS[(k + 1) % 3]
        signals = [log[name] for name in ("angle", "speed") for log in (hip, knee)]
        table = {
            "observation.state": np.column_stack(signals).tolist(),
            "action": np.column_stack([hip["torque"], knee["torque"]]).tolist(),
            "timestamp": hip["t"],
        }
        pd.DataFrame(table).to_parquet(tmp_path / f"episode_{k}.parquet")
    mapping, _ = drafted(tmp_path)
    columns = columns_of(mapping)
    for k, joint in ((1, "hip"), (2, "knee")):
        assert columns[f"q{k}"] == f"observation.state[{joint}.pos]"
        assert columns[f"w{k}"] == f"observation.state[{joint}.vel]"
        assert columns[f"u{k}"] == f"action[{joint}.torque]"


def leg(folder: Path, more: str = "") -> Path:
    pytest.importorskip("mujoco")
    (folder / "leg.xml").write_text(text_of("leg.xml", ("</mujoco>", f"{more}</mujoco>")))
    return folder / "leg.xml"


def arm_logs(folder: Path, names: Sequence[str], header: bool = True) -> Path:
    """Two joints, of which the second has a drive that its acceleration does not show."""
    a, b = LOGS[0], LOGS[1]
    noise = np.random.default_rng(0).standard_normal(len(a["t"]))
    columns = [a["angle"], b["angle"], a["speed"], b["speed"], a["torque"], noise]
    labels = [f"{kind}_{name}" for kind in ("pos", "vel", "tau") for name in names]
    table = pd.DataFrame(dict(zip(["t", *labels], [a["t"], *columns], strict=True)))
    folder.mkdir()
    table.to_csv(folder / "run.csv", index=False, header=header)
    return folder


def test_a_robot_file_is_the_known_physics(tmp_path: Path) -> None:
    robot, out = leg(tmp_path), tmp_path / "draft"
    init(arm_logs(tmp_path / "raw", ("hip", "knee")), robot, None, out)
    text = (out / "system.yaml").read_text()
    assert (
        "  toe: 0  # Question: no column shows" in text and (out / "leg.xml").read_text() == robot.read_text()
    )
    system = read_system(out / "system.yaml")
    assert [item.name for item in system.inputs] == ["tau_hip", "tau_knee"]
    assert [item.name for item in system.outputs] == ["q_hip", "qd_hip", "q_knee", "qd_knee"]
    assert np.isfinite(simulate(system, read_logs(out, system)).gap.value)


def test_gains_of_servos_in_a_robot_file_are_uncertain(tmp_path: Path) -> None:
    drives = '<actuator><position name="hip" joint="hip" kp="500" kv="5"/><motor joint="knee"/></actuator>'
    robot, out = leg(tmp_path, drives), tmp_path / "draft"
    hip, knee = servo(0), servo(1)
    columns = {"t": hip["t"], "pos_hip": hip["q"], "pos_knee": knee["q"], "goal_hip": hip["goal"]}
    init(put(tmp_path / "raw", [columns]), robot, None, out)
    assert "is it the gain of the firmware?" in (out / "system.yaml").read_text()
    system = read_system(out / "system.yaml")
    assert system.uncertain == ("hip_kp", "hip_kv")
    assert [p.bounds for p in system.parameters] == [(0.5, 5e5), (0.0, 5e3)]


TAIL = """<body><joint name="tail" axis="0 1 0"/><inertial pos="0 0 0.1" mass="0.2"
  diaginertia="0.001 0.001 0.001"/></body></worldbody>"""


def test_a_robot_with_other_joints_is_refused(tmp_path: Path) -> None:
    """Three joints in a row and one beside them: which two of them are logged, no name says."""
    robot, out = leg(tmp_path), tmp_path / "draft"
    robot.write_text(robot.read_text().replace("</worldbody>", TAIL))
    with pytest.raises(BadInput, match=r"leg.xml: has 4 joints \(hip, knee, toe, tail\), and 2 positions"):
        init(arm_logs(tmp_path / "raw", ("a1", "a2")), robot, None, out)
    assert not out.exists()


def test_a_tool_that_is_not_logged_stands_still(tmp_path: Path) -> None:
    """The first joints are those of the logs, and what the last of them carries rests at zero."""
    robot, out = leg(tmp_path), tmp_path / "draft"
    init(arm_logs(tmp_path / "raw", ("a1", "a2")), robot, None, out)
    text = (out / "system.yaml").read_text()
    assert "  q_knee: {column: q2}  # pos_a2\n" in text and "  toe: 0  # Question: no column shows" in text
    system = read_system(out / "system.yaml")
    assert system.robot is not None and system.robot.locked == {"toe": 0.0}


@pytest.mark.parametrize("names", [("hip", "knee", "toe"), ("a1", "a2", "a3")])
def test_a_joint_that_rests_is_locked_where_it_was_logged(tmp_path: Path, names: tuple[str, ...]) -> None:
    robot, out = leg(tmp_path), tmp_path / "draft"
    raw = arm_logs(tmp_path / "raw", names[:2])
    table = pd.read_csv(raw / "run.csv")
    table.insert(3, f"pos_{names[2]}", 0.25)
    table.to_csv(raw / "run.csv", index=False)
    init(raw, robot, None, out)
    assert f"  toe: 0.25  # pos_{names[2]}, which does not move." in (out / "system.yaml").read_text()
    system = read_system(out / "system.yaml")
    assert system.robot is not None and system.robot.locked == {"toe": 0.25}


#: The last link of the arm has no mass.
ARM = """<robot name="arm"><link name="base"/><link name="thigh"><inertial><origin xyz="0 0 -0.1"/>
<mass value="0.5"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial></link><link name="tool"/>
<joint name="hip" type="continuous"><parent link="base"/><child link="thigh"/><axis xyz="0 1 0"/></joint>
<joint name="flange" type="continuous"><parent link="thigh"/><child link="tool"/><axis xyz="0 0 1"/></joint>
</robot>"""


def test_a_joint_that_moves_no_mass_needs_no_column(tmp_path: Path) -> None:
    """A last link without mass, whose motion is logged: its columns are told and left out."""
    pytest.importorskip("mujoco")
    robot, out = tmp_path / "arm.urdf", tmp_path / "draft"
    robot.write_text(ARM)
    init(arm_logs(tmp_path / "raw", ("hip", "flange")), robot, None, out)
    text = (out / "system.yaml").read_text()
    assert "# flange moves no mass in the robot file: its columns are not used.\n" in text
    assert [item.name for item in read_system(out / "system.yaml").outputs] == ["q_hip", "qd_hip"]


def test_a_robot_may_have_more_joints_than_a_first_model(tmp_path: Path) -> None:
    robot, out, names = leg(tmp_path), tmp_path / "draft", [f"part{k}" for k in range(8)]
    pose = '<joint name="{}" axis="0 1 0"/><inertial pos="0 0 .1" mass="1" diaginertia=".1 .1 .1"/>'
    links = "".join(f'<body pos="0 0 .1">{pose.format(name)}' for name in names) + "</body>" * len(names)
    robot.write_text(f"<mujoco><worldbody>{links}</worldbody></mujoco>")
    logs = [pendulum(seed) for seed in range(8)]
    columns = {
        f"{kind}_{name}": log[own]
        for kind, own in (("pos", "angle"), ("tau", "torque"))
        for name, log in zip(names, logs, strict=True)
    }
    init(put(tmp_path / "raw", [{"t": logs[0]["t"], **columns}]), robot, None, out)
    assert len(read_system(out / "system.yaml").outputs) == 8


def test_a_joint_whose_name_is_part_of_another_keeps_its_column(tmp_path: Path) -> None:
    robot, out = leg(tmp_path), tmp_path / "draft"
    robot.write_text(robot.read_text().replace("hip", "arm").replace("knee", "forearm"))
    init(arm_logs(tmp_path / "raw", ("arm", "forearm")), robot, None, out)
    text = (out / "system.yaml").read_text()
    assert "q_arm: {column: q1}  # pos_arm\n" in text and "q_forearm: {column: q2}  # pos_forearm\n" in text


def test_a_long_chain_of_joints_is_drafted_without_its_equations(tmp_path: Path) -> None:
    """Forty-eight joints in a row, whose equations take half a minute."""
    robot, out, names = leg(tmp_path), tmp_path / "draft", [f"part{k}" for k in range(48)]
    pose = '<joint name="{}" axis="0 1 0"/><inertial pos="0 0 .1" mass="1" diaginertia=".1 .1 .1"/>'
    links = "".join(f'<body pos="0 0 .1">{pose.format(name)}' for name in names) + "</body>" * len(names)
    robot.write_text(f"<mujoco><worldbody>{links}</worldbody></mujoco>")
    raw, since = arm_logs(tmp_path / "raw", ("part0", "part47")), time.process_time()
    init(raw, robot, None, out)
    assert time.process_time() - since < 5.0
    text = (out / "system.yaml").read_text()
    assert "  q_part47: {column: q2}  # pos_part47\n" in text and "  part46: 0  # Question" in text


def test_columns_of_other_joints_tell_a_drive(tmp_path: Path) -> None:
    mapping, _ = drafted(arm_logs(tmp_path / "raw", ("1", "2"), header=False))
    assert columns_of(mapping) == {"q1": "2", "q2": "3", "w1": "4", "w2": "5", "u1": "6", "u2": "7"}


def test_a_logged_joint_that_follows_another_one_is_an_output(tmp_path: Path) -> None:
    gear = '<equality><joint joint1="knee" joint2="hip" polycoef="0.1 0.5 0 0 0"/></equality>'
    robot, out = leg(tmp_path, gear), tmp_path / "draft"
    init(arm_logs(tmp_path / "raw", ("hip", "knee")), robot, None, out)
    system = read_system(out / "system.yaml")
    assert [item.name for item in system.inputs] == ["tau_hip"]
    assert [item.name for item in system.outputs] == ["q_hip", "qd_hip", "q_knee", "qd_knee"]
    assert system.port_names == ("hip",)


@pytest.mark.parametrize("rate", [100, 250])
def test_a_slow_topic_hides_no_speed(tmp_path: Path, rate: int) -> None:
    """A position of 6 or 15 samples, and of 60, beside a speed of 1500: the speed is drafted."""
    run = tmp_path / "run"
    run.mkdir()
    log, every = LOGS[0], slice(None, None, rate)
    put(run, [{"t": log["t"][every], "pitch": log["angle"][every]}], "attitude.csv")
    put(run, [{"t": log["t"], "gyro_rad_s": log["speed"]}], "gyro.csv")
    put(run, [{"t": log["t"], "torque": log["torque"]}], "drive.csv")
    mapping, system = drafted(run)
    assert columns_of(mapping) == {"w": "gyro.gyro_rad_s", "u": "drive.torque"}
    assert len(read_logs(run, system).t) > 1000
