"""EMPS: recordings become a log folder, its system files fit them, and a damaged recording is named."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from pipeline.recordings.emps import FILES, EmpsRecording
from pipeline.stages.acquire import acquire
from tests.machines.folders import Array, motion
from tests.recordings.published import fits
from unmodelled.base.errors import BadInput
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system

Recordings = dict[str, dict[str, Array]]

SYSTEMS = Path(__file__).parents[2] / "systems" / "emps"
TRUTH = {"M": 80.0, "F_v": 150.0, "F_c": 30.0, "F_0": 4.0}
SAMPLES = 2001


def voltage(pulses: bool) -> Array:
    t = np.arange(SAMPLES) * 0.001
    slow = 2.5 * np.sin(6.0 * t) + 1.5 * np.sin(17.0 * t)
    return slow + (5.0 * (np.mod(t, 0.5) < 0.02) if pulses else 0.0)


def position(vir: Array) -> Array:
    """Of a carriage with the numbers of `TRUTH`, by ten steps to a sample."""

    def rates(x: Array, u: Array) -> list[Array]:
        loss = TRUTH["F_v"] * x[1] + TRUTH["F_0"] + TRUTH["F_c"] * np.tanh(x[1] / 5e-4)
        return [x[1], (35.15065 * u - loss) / TRUTH["M"]]

    return motion(rates, [0.0, 0.0], vir, 0.001, substeps=10)[:, 0]


@pytest.fixture(scope="module")
def recorded() -> Recordings:
    t = np.arange(SAMPLES)[:, None] * 0.001
    voltages = {name: voltage(name == "pulses") for name in FILES}
    extra = {"gtau": np.array([[35.15]])}
    return {n: {"t": t, "vir": u[:, None], "qm": position(u)[:, None], **extra} for n, u in voltages.items()}


@pytest.fixture
def folder(recorded: Recordings, tmp_path: Path) -> Path:
    """Recordings as published."""
    (tmp_path / "emps").mkdir()
    for name, file in FILES.items():
        savemat(tmp_path / "emps" / file, recorded[name])
    return tmp_path / "emps"


def test_a_log_folder_of_parts(folder: Path, recorded: Recordings, tmp_path: Path) -> None:
    acquire(EmpsRecording(str(folder), parts=4), 0, tmp_path / "logs")
    table = pd.read_csv(tmp_path / "logs" / "experiments.csv")
    assert table["group"].tolist() == ["plain"] * 4 + ["pulses"] * 4
    joined = pd.concat([pd.read_parquet(tmp_path / "logs" / f) for f in table["file"][4:]])
    assert np.array_equal(joined["qm"], recorded["pulses"]["qm"][:2000, 0])
    logs = read_logs(tmp_path / "logs", read_system(SYSTEMS / "nothing_withheld.yaml"))
    assert np.diff(logs.offsets).tolist() == [500] * 8 and logs.period == pytest.approx(0.001)
    assert logs.provenance["data"] == "measured" and logs.provenance["experiments"] == 8


def test_the_system_files_fit_a_carriage(folder: Path, tmp_path: Path) -> None:
    acquire(EmpsRecording(str(folder), parts=2), 0, tmp_path / "logs")
    found = fits(SYSTEMS, tmp_path / "logs")
    assert all(fit.converged for fit in found.values())
    assert found["nothing"].values == pytest.approx(TRUTH, rel=0.02)
    left = {name: fit.gap.value for name, fit in found.items()}
    assert 10.0 * left["nothing"] < min(left["coulomb"], left["viscous"])


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"vir": None}, "DATA_EMPS.mat: variable vir is missing"),
        ({"qm": np.zeros((7, 1))}, "variable qm: must have 2001 rows like t, got 7"),
        ({"qm": np.zeros((3, 3))}, "variable qm: must be a column of numbers, got (3, 3) float64"),
        ({"t": "abc"}, "variable t: must be a column of numbers"),
        ({"qm": np.r_[0.0, np.nan, np.ones(SAMPLES - 2)]}, "variable qm: row 2: not a finite number"),
    ],
)
def test_a_damaged_recording_is_named(
    change: dict[str, Any], complaint: str, folder: Path, recorded: Recordings, tmp_path: Path
) -> None:
    content = {k: v for k, v in {**recorded["plain"], **change}.items() if v is not None}
    savemat(folder / FILES["plain"], content)
    check_refused(str(folder), tmp_path, complaint)


def test_wrong_files_are_named(folder: Path, tmp_path: Path) -> None:
    check_refused(None, tmp_path, "must be given: EMPS=")
    check_refused(str(tmp_path / "nowhere"), tmp_path, "DATA_EMPS.mat: no such file")
    whole = (folder / FILES["plain"]).read_bytes()
    for content in (b"t,vir,qm\n0,1,2\n" * 20, whole[: len(whole) // 2]):
        (folder / FILES["pulses"]).write_bytes(content)
        check_refused(str(folder), tmp_path, "DATA_EMPS_PULSES.mat: not a MATLAB file of version 4 to 7")


def check_refused(dataset: str | None, tmp_path: Path, complaint: str) -> None:
    with pytest.raises(BadInput) as error:
        acquire(EmpsRecording(dataset), 0, tmp_path / "logs")
    assert complaint in str(error.value) and "\n" not in str(error.value)
    assert not (tmp_path / "logs").exists()
