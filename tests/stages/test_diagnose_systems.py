"""Diagnoses of one machine with several system files: resumed after a kill, drawn by another stage."""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from pipeline.stages import diagnose_systems as diagnosing
from pipeline.stages.draw_diagnoses import draw_diagnoses
from tests.diagnosis.diagnoses import BENCH, friction
from unmodelled.base.errors import BadInput
from unmodelled.base.files import write_json
from unmodelled.diagnosis.answer.figure_tables import write_tables
from unmodelled.diagnosis.answer.summary import summary
from unmodelled.diagnosis.where.where import where


@dataclass
class Found:
    """What takes the place of a diagnosis."""

    name: str

    def write(self, folder: Path) -> dict[str, Any]:
        (folder / "tables").mkdir()
        (folder / "diagnosis.json").write_text(json.dumps(self.name))
        return {"name": self.name}


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    """Two system files and a log folder, of which nothing is read."""
    for name in ("systems/a.yaml", "systems/b.yaml", "logs/experiments.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("1\n")
    return tmp_path


def run(bench: Path, asked: list[Any], monkeypatch: pytest.MonkeyPatch, killed_at: str = "") -> None:
    def findings(system: str, logs: str, horizon: float, seed: int, threads: int) -> Found:
        if system == killed_at:
            raise KeyboardInterrupt
        asked.append((system, horizon, seed, threads))
        return Found(system)

    monkeypatch.setattr(diagnosing, "read_system", lambda file: file.stem)
    monkeypatch.setattr(diagnosing, "read_logs", lambda logs, system: logs.name)
    monkeypatch.setattr(diagnosing, "findings", findings)
    monkeypatch.setattr(diagnosing, "sentences", lambda content: [content["name"]])
    diagnosing.diagnose_systems(bench / "systems", bench / "logs", 0.1, 3, 1, bench / "out")


def test_every_system_file_is_diagnosed_and_a_killed_run_goes_on(
    bench: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []
    with pytest.raises(KeyboardInterrupt):
        run(bench, asked, monkeypatch, killed_at="b")
    assert not (bench / "out").exists()
    run(bench, asked, monkeypatch)
    assert asked == [("a", 0.1, 3, 1), ("b", 0.1, 3, 1)]
    written = {p.parent.name: json.loads(p.read_text()) for p in bench.glob("out/*/diagnosis.json")}
    assert written == {"a": "a", "b": "b"}


def test_other_logs_begin_anew(bench: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    with pytest.raises(KeyboardInterrupt):
        run(bench, asked, monkeypatch, killed_at="b")
    (bench / "logs" / "experiments.csv").write_text("2\n")
    run(bench, asked, monkeypatch)
    assert [system for system, *_ in asked] == ["a", "a", "b"]


def test_a_folder_without_a_system_file_is_refused(bench: Path) -> None:
    with pytest.raises(BadInput, match="logs: holds no system file"):
        diagnosing.diagnose_systems(bench / "logs", bench / "logs", 0.1, 0, 1, bench / "out")


@pytest.mark.long
def test_figures_are_drawn_from_the_tables_of_an_answer(tmp_path: Path) -> None:
    folder = tmp_path / "diagnoses" / "real" / "machine"
    diagnosis = friction(tmp_path / "case", replace(BENCH, runs=4, samples=300))
    found = where(diagnosis)
    write_tables(diagnosis, found, folder)
    write_json(folder / "diagnosis.json", summary(diagnosis, found))
    draw_diagnoses(tmp_path / "diagnoses", 1, tmp_path / "drawn")
    drawn = tmp_path / "drawn" / "real" / "machine"
    listed = json.loads((drawn / "figures" / "figures.json").read_text())
    assert {row["id"] for row in listed} == {p.stem for p in (drawn / "figures").glob("*.svg")} != set()
    assert (drawn / "diagnosis.json").read_bytes() == (folder / "diagnosis.json").read_bytes()
    (folder / "tables" / "steps.parquet").unlink()
    with pytest.raises(BadInput, match=r"machine: figures/gap\.svg could not be drawn"):
        draw_diagnoses(tmp_path / "diagnoses", 1, tmp_path / "again")
