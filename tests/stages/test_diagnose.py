"""The verb diagnose around a diagnosis that is given: what it writes, prints and keeps."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.errors import BadInput
from pipeline.files import read_json
from pipeline.stages import diagnose as stage
from pipeline.stages.diagnose import diagnose
from pipeline.stages.simulate import simulate
from tests.diagnosis.diagnoses import HORIZON, JOINT, Said, diagnosis

FRICTION = Said("coulomb_friction", JOINT, {"F_c": 0.06, "v_c": 0.05})


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with system.yaml and logs/, which are diagnosed in no time."""
    found = diagnosis(tmp_path / "case", FRICTION)
    monkeypatch.setattr(stage, "diagnosed", lambda *_, **__: found)
    return tmp_path / "case"


def call(case: Path, out: str = "out") -> None:
    diagnose(case / "system.yaml", case / "logs", case / out, HORIZON, 3)


def files(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_what_is_written_and_printed(case: Path, capsys: pytest.CaptureFixture[str]) -> None:
    call(case)
    content = read_json(case / "out" / "diagnosis.json")
    assert (content["schema"], content["verdict"]) == ("diagnosis/1", "effect")
    assert {e["id"] for e in content["where"]["experiments"]} == {"run0", "run1", "run2", "run3"}
    said = capsys.readouterr().out
    assert said.startswith("verdict: ") and "coulomb_friction at joint" in said
    simulate(case / "out" / "augmented_system.yaml", case / "logs", HORIZON, case / "simulation")
    simulated = read_json(case / "simulation" / "simulation.json")["experiments"]
    reported = {e["id"]: e["augmented"] for e in content["where"]["experiments"]}
    assert {e["id"]: e["known"] for e in simulated} == pytest.approx(reported, rel=1e-5)


def test_the_gap_of_the_held_out_experiments_can_be_simulated(case: Path) -> None:
    call(case)
    gap = read_json(case / "out" / "diagnosis.json")["gap"]
    augmented = case / "out" / "augmented_system.yaml"
    simulate(augmented, case / "logs", HORIZON, case / "simulation", gap["held_out"])
    simulated = read_json(case / "simulation" / "simulation.json")["gap"]["known"]
    assert simulated == pytest.approx(gap["augmented"], rel=1e-6)


def test_the_same_seed_gives_the_same_files_and_a_result_is_replaced(case: Path) -> None:
    call(case)
    call(case, "again")
    assert files(case / "out") == files(case / "again")
    call(case, "again")
    assert files(case / "out") == files(case / "again")


def test_names_of_files_may_be_texts_as_in_a_notebook(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from pipeline import diagnose as verb

    assert verb is diagnose
    monkeypatch.chdir(case)
    verb(system="system.yaml", logs="logs", out="out")
    assert (case / "out" / "diagnosis.json").exists()


def test_what_goes_wrong_keeps_the_old_result(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    call(case)
    before = files(case)

    def fail(*_: object) -> None:
        raise BadInput("the disk is full")

    monkeypatch.setattr(stage, "write_augmented", fail)
    with pytest.raises(BadInput, match="the disk is full"):
        call(case)
    assert files(case) == before
