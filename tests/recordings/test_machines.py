"""Published machines: their archives become log folders, which their system files read and simulate."""

import os
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.stages.acquire import acquire
from tests.recordings.published import MACHINES
from unmodelled.base.errors import BadInput
from unmodelled.diagnosis.fitting.checks import check
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.systems.numeric import numpy_system_function
from unmodelled.systems.reader import read_system

SYSTEMS = Path(__file__).parents[2] / "systems"
FILES = [(name, path.stem) for name in MACHINES for path in sorted((SYSTEMS / name).glob("*_withheld.yaml"))]


@pytest.fixture(scope="module")
def archives(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A zip file per machine, with a folder around the files as in a download."""
    folder = tmp_path_factory.mktemp("archives")
    for name, machine in MACHINES.items():
        (folder / name).mkdir()
        machine.write(folder / name)
        with zipfile.ZipFile(folder / f"{name}.zip", "w") as packed:
            for path in sorted(p for p in (folder / name).rglob("*") if p.is_file()):
                packed.write(path, path.relative_to(folder))
    return {name: folder / f"{name}.zip" for name in MACHINES}


def logs_of(name: str, archive: Path, folder: Path) -> Logs:
    acquire(MACHINES[name].recording(str(archive)), 0, folder)
    return read_logs(folder, read_system(next((SYSTEMS / name).glob("*_withheld.yaml"))))


@pytest.mark.parametrize(("name", "file"), FILES)
def test_every_system_file_reads_the_logs(
    name: str, file: str, archives: dict[str, Path], tmp_path: Path
) -> None:
    acquire(MACHINES[name].recording(str(archives[name])), 0, tmp_path / "logs")
    system = read_system(SYSTEMS / name / f"{file}.yaml")
    logs = read_logs(tmp_path / "logs", system)
    assert system.ports and system.uncertain and system.name == name
    assert logs.provenance["data"] == "measured" and logs.provenance["experiments"] == len(logs)


@pytest.mark.parametrize("name", MACHINES)
def test_a_folder_is_read_like_a_zip_file(name: str, archives: dict[str, Path], tmp_path: Path) -> None:
    packed = logs_of(name, archives[name], tmp_path / "packed")
    unpacked = logs_of(name, archives[name].with_suffix(""), tmp_path / "unpacked")
    assert packed.ids == unpacked.ids and np.array_equal(packed.y, unpacked.y)


def test_xl330_runs_come_on_one_clock(archives: dict[str, Path], tmp_path: Path) -> None:
    logs = logs_of("xl330", archives["xl330"], tmp_path / "logs")
    assert logs.ids == ("sin_sin_kp100", "lift_and_drop_kp400") and logs.c[:, 0].tolist() == [100.0, 400.0]
    assert logs.period == pytest.approx(0.005)
    for i in range(2):
        t = 0.003 + logs.t[logs.rows(i)]
        assert np.abs(logs.y[logs.rows(i), 0] - 0.3 * np.sin(8.0 * t)).max() < 1e-5
        raw = pd.read_parquet(tmp_path / "logs" / f"{logs.ids[i]}.parquet")
        assert np.abs(raw["goal"] - 0.5 * np.sin(8.0 * t)).max() < 2e-4
        assert (raw["on"] == 1.0).all() == (i == 0)


def test_so101_reads_its_joint_and_the_first_40_s(archives: dict[str, Path], tmp_path: Path) -> None:
    logs = logs_of("so101", archives["so101"], tmp_path / "logs")
    assert logs.ids == ("chirp_sweep", "step_response") and logs.period == pytest.approx(0.02006)
    t = logs.t[logs.rows(1)]
    assert 39.9 < t[-1] <= 40.0
    expected = 0.2 * np.sin(3.0 * (t + 5e-6))
    assert np.abs(logs.y[logs.rows(1), 0] - expected).max() < 1e-6
    raw = pd.read_parquet(tmp_path / "logs" / "step_response.parquet")
    assert np.abs(raw["goal"] - 2.0 * expected).max() < 2e-6


def test_ur10e_finds_its_columns(archives: dict[str, Path], tmp_path: Path) -> None:
    logs = logs_of("ur10e_joint", archives["ur10e_joint"], tmp_path / "logs")
    raw = pd.read_parquet(tmp_path / "logs" / "part_2.parquet")
    t = 1297.5 + np.cumsum(np.tile([0.01, 0.01, 0.012], 200))[75:150]
    assert len(logs) == 8 and raw["t"].iloc[0] == 0.0
    for column, expected in (("q", np.sin(t)), ("v", np.cos(t)), ("i", 4.0 * np.cos(t))):
        assert np.abs(raw[column] - expected).max() < 1e-3


def test_double_pendulum_leaves_the_compensated_recording_out(
    archives: dict[str, Path], tmp_path: Path
) -> None:
    logs = logs_of("double_pendulum", archives["double_pendulum"], tmp_path / "logs")
    assert logs.ids == ("trajectory_00", "trajectory_11") and logs.period == pytest.approx(0.002)
    t, y = logs.t[logs.rows(1)], logs.y[logs.rows(1)]
    expected = np.stack([np.sin(t), np.sin(2.0 * t), np.cos(t), 2.0 * np.cos(2.0 * t)], axis=1)
    assert np.abs(y - expected).max() < 1e-6
    assert set(np.abs(logs.u[logs.rows(0)][1:]).max(axis=0)) == {1.0, 2.0}


def test_double_pendulum_keeps_its_energy() -> None:
    """The system file against the energies of two rods and two rotors, without torques and friction."""
    system = read_system(SYSTEMS / "double_pendulum" / "friction_withheld.yaml")
    system = system.with_values({"b1": 0.0, "b2": 0.0})
    p = dict(zip((q.name for q in system.parameters), system.values, strict=True))

    def energy(x: np.ndarray) -> np.ndarray:
        q1, q2, v1, v2 = x.T
        end, centre = p["l1"], p["r2"]
        velocity = end * v1 * np.exp(1j * q1) + centre * (v1 + v2) * np.exp(1j * (q1 + q2))
        own = p["I2"] - p["m2"] * centre**2  # inertia about the centre; that of the file is about the joint
        rotors = 0.5 * p["I_r"] * ((p["n"] * v1) ** 2 + (v1 - p["n"] * v2) ** 2)
        height = -p["m1"] * p["r1"] * np.cos(q1) - p["m2"] * (end * np.cos(q1) + centre * np.cos(q1 + q2))
        links = 0.5 * p["I1"] * v1**2 + 0.5 * p["m2"] * np.abs(velocity) ** 2 + 0.5 * own * (v1 + v2) ** 2
        return np.asarray(links + rotors + 9.81 * height)

    x = np.random.default_rng(0).uniform(-3.0, 3.0, (50, 4))
    rate = numpy_system_function(system, list(system.dynamics), efforts_zero=True)
    slope = rate(0.0, x, np.zeros((50, 2)), np.empty(0), np.array(system.values), np.zeros((50, 0)))
    change = (energy(x + 1e-5 * slope) - energy(x - 1e-5 * slope)) / 2e-5
    assert np.abs(change).max() < 1e-6


def test_silverbox_is_cut_where_its_input_changes(archives: dict[str, Path], tmp_path: Path) -> None:
    logs = logs_of("silverbox", archives["silverbox"], tmp_path / "logs")
    table = pd.read_csv(tmp_path / "logs" / "experiments.csv")
    assert table["group"].tolist() == ["arrow"] * 5 + [f"multisine_{k:02d}" for k in range(1, 11)]
    assert np.diff(logs.offsets).tolist() == [8080] * 5 + [8600] * 10
    assert logs.period == pytest.approx(2**14 / 1e7)
    start = 40_590 + 8_692
    assert logs.y[logs.rows(6), 0] == pytest.approx(
        0.2 * np.sin(0.01 * np.arange(start, start + 8600) - 0.3), abs=1e-6
    )


def test_cascaded_tanks_are_cut_in_parts(archives: dict[str, Path], tmp_path: Path) -> None:
    logs = logs_of("cascaded_tanks", archives["cascaded_tanks"], tmp_path / "logs")
    assert logs.ids == ("est_1", "est_2", "est_3", "val_1", "val_2", "val_3") and logs.period == 4.0
    t = 4.0 * np.arange(100, 200)
    raw = pd.read_parquet(tmp_path / "logs" / "val_2.parquet")
    assert raw["u"].to_numpy() == pytest.approx(3.0 + np.sin(0.02 * t), abs=1e-4)
    assert raw["y"].to_numpy() == pytest.approx(3.0 + np.sin(0.04 * t), abs=1e-4)


@pytest.mark.parametrize(("name", "file"), FILES)
def test_the_published_archive_can_be_diagnosed(name: str, file: str, tmp_path: Path) -> None:
    machine = MACHINES[name]
    archive = os.environ.get(machine.variable, "")
    if not Path(archive).exists() or not archive:
        pytest.skip(f"the published archive is not here: set {machine.variable} to its folder or zip")
    acquire(machine.recording(archive), 0, tmp_path / "logs")
    system = read_system(SYSTEMS / name / f"{file}.yaml")
    logs = read_logs(tmp_path / "logs", system)
    assert len(logs) == machine.experiments
    check(system, logs, machine.horizon)


@pytest.mark.parametrize("name", MACHINES)
def test_an_archive_that_is_not_there_is_named(name: str, tmp_path: Path) -> None:
    machine = MACHINES[name]
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.zip").write_text("no archive")
    for path, complaint in (
        (None, f"source.archive: must be given: .* {machine.variable}="),
        (tmp_path / "nowhere", "nowhere: no such file or folder"),
        (tmp_path / "empty", "empty: holds no "),
        (tmp_path / "text.zip", "text.zip: is not a zip file, nor a folder"),
    ):
        with pytest.raises(BadInput, match=complaint) as error:
            acquire(machine.recording(None if path is None else str(path)), 0, tmp_path / "logs")
        assert "\n" not in str(error.value) and not (tmp_path / "logs").exists()


#: Machine and file -> texts, what takes their places, and what is said of it.
DAMAGED = {
    ("xl330", "2026-01-15_10h28m100.json"): [
        ('"entries": [', '"entries": [7, ', "entry 1: timestamp: must be"),
    ],
    ("xl330", "2026-01-15_10h28m400.json"): [
        ('"mass": 0.49', '"mass": 0.5', "mass: must be 0.49 as in"),
        ('"kp": 400', '"kp": null', "kp: must be a number, got None"),
        ("lift_and_drop", "../up", "trajectory: must be a name"),
        ('"timestamp": 0.003,', '"timestamp": 9,', "time must increase"),
        ("{", "[", "not a JSON file"),
        ('"timestamp": 0.003,', '"timestamp": -9,', "sample 2: gap of 9"),
    ],
    ("so101", "chirp_sweep/state_motor.csv"): [
        ('"[9.0, 1e-06', '"[[9.0, 1e-06', "row 2: column positions: "),
        ("[9.0, 1e-06", "[9.0, NaN", "row 2: column positions: "),
        ("5.0,", "soon,", "row 2: column timestamp: 'soon' is not"),
        ("5.0,", "5.0,5.0,", "state_motor.csv: not a table (Length of"),
    ],
    ("so101", "chirp_sweep/joint_list.txt"): [("Rotation", "Roll", "names no joint Rotation, only Pitch")],
    ("so101", "chirp_sweep/control.csv"): [("5.0,", "6.0,", "must be the same as in state_motor.csv")],
    ("ur10e_joint", "jointwise_motion/ur-20_01_22-joint_1.csv"): [
        ("1297.5100", "inf", "row 1: column t: 'inf'"),
    ],
    ("double_pendulum", "sys_id/trajectory_00.csv"): [("pos_meas2", "pos", "column pos_meas2 is missing")],
    ("double_pendulum", "sys_id/trajectory_11.csv"): [("\n0.0015,", "\n,", "row 3: column time: '' is not")],
    ("silverbox", "SNLS80mV.csv"): [
        ('"V2"', '"V3"', "row 1: column V2 is missing"),
        ("\n", "\n0,0\n", "must have 131072 samples, got 262145"),
    ],
    ("cascaded_tanks", "dataBenchmark.csv"): [("3,3,3,3,4,", "3,3,x,3,4,", "row 2: column yEst: 'x' is not")],
}


@pytest.mark.parametrize(
    ("name", "file", "old", "new", "complaint"),
    [(*place, *change) for place, changes in DAMAGED.items() for change in changes],
)
def test_a_damaged_file_is_named(
    name: str, file: str, old: str, new: str, complaint: str, tmp_path: Path
) -> None:
    MACHINES[name].write(tmp_path)
    path = tmp_path / file
    content = path.read_text()
    assert old in content
    path.write_text(content.replace(old, new))
    with pytest.raises(BadInput) as error:
        acquire(MACHINES[name].recording(str(tmp_path)), 0, tmp_path / "logs")
    assert complaint in str(error.value) and file in str(error.value) and "\n" not in str(error.value)
    assert not (tmp_path / "logs").exists()


@pytest.mark.parametrize(
    ("name", "changes", "complaint"),
    [
        ("xl330", {"period": 0.0}, r"source\.period: must be a number of s"),
        ("xl330", {"period": 1e-9}, r"source\.period: must be a number of s, no less than a tenth"),
        ("so101", {"seconds": -1.0}, r"source\.seconds: must be a positive number, got -1\.0"),
        ("ur10e_joint", {"joint": 7}, r"source\.joint: must be 1 to 6, got 7"),
        ("ur10e_joint", {"joint": 2}, r"holds no \*joint_2\.csv"),
        ("ur10e_joint", {"parts": 0}, r"source\.parts: must be .* 1 to 600, the samples of .*csv, got 0"),
        ("cascaded_tanks", {"parts": 2.5}, r"source\.parts: must be .* from 1 to 300, .*, got 2\.5"),
    ],
)
def test_settings_that_no_recording_has_are_named(
    name: str, changes: dict[str, Any], complaint: str, archives: dict[str, Path], tmp_path: Path
) -> None:
    recording = replace(MACHINES[name].recording(str(archives[name])), **changes)
    with pytest.raises(BadInput, match=complaint):
        acquire(recording, 0, tmp_path / "logs")
    assert not (tmp_path / "logs").exists()


def test_two_recordings_of_one_name_are_refused(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        MACHINES["so101"].write(tmp_path / name)
    with pytest.raises(BadInput, match="two recordings are called chirp_sweep; keep one of them"):
        acquire(MACHINES["so101"].recording(str(tmp_path)), 0, tmp_path / "logs")
