"""The verb diagnose around a diagnosis that is given: what it writes, prints and keeps."""

from collections.abc import Callable
from datetime import datetime, tzinfo
from html import unescape
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.conftest import files_of
from tests.diagnosis.diagnoses import Said, diagnosis, known
from tests.diagnosis.studies import HORIZON, JOINT
from unmodelled.api import answer as api
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json
from unmodelled.cli.verbs.diagnose import diagnose
from unmodelled.diagnosis.answer import diagnose as story
from unmodelled.diagnosis.answer import findings
from unmodelled.report.figures import files as figures

FRICTION = Said("coulomb_friction", JOINT, {"F_c": 0.06, "v_c": 0.05})


class Noon(datetime):
    """A clock that stands, as an answer says when it was made."""

    @classmethod
    def now(cls, tz: tzinfo | None = None) -> "Noon":
        return cls(2026, 1, 1, 12, tzinfo=tz)


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with system.yaml and logs/, which are diagnosed in no time."""
    found = diagnosis(tmp_path / "case", FRICTION)
    monkeypatch.setattr(story, "diagnose_gap", lambda *_, **__: found)
    monkeypatch.setattr(api, "datetime", Noon)
    return tmp_path / "case"


def call(case: Path, out: str = "out") -> None:
    diagnose(case / "system.yaml", case / "logs", case / out, HORIZON, 3)


def test_a_law_that_runs_away_over_a_whole_experiment_is_not_offered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A negative stiffness that lifts the pendulum: fine for a window, lost in a run."""
    found = diagnosis(tmp_path / "case", Said("linear_spring", JOINT, {"k": -60.0}))
    monkeypatch.setattr(story, "diagnose_gap", lambda *_, **__: found)
    call(tmp_path / "case")
    (refused,) = read_json(tmp_path / "case/out/diagnosis.json")["refused"]
    assert (refused["file"], refused["keep"]) == ("augmented_system.yaml", "system.yaml")
    for words in ("over whole experiments (run1, run3) theta diverges", "0.14 rad off with the"):
        assert words in refused["reason"]
    said, page = capsys.readouterr().out, (tmp_path / "case/out/index.html").read_text()
    assert refused["reason"] in said and refused["reason"] in page
    assert "next: keep the system as given" in said
    assert not (tmp_path / "case/out/augmented_system.yaml").exists()


def raising(error: BaseException) -> Callable[..., None]:
    """A function that fails."""

    def fail(*_: object) -> None:
        raise error

    return fail


def test_what_is_written_and_printed(case: Path, capsys: pytest.CaptureFixture[str]) -> None:
    call(case)
    content = read_json(case / "out" / "diagnosis.json")
    assert (content["schema"], content["verdict"]) == ("diagnosis/2", "effect")
    assert {e["id"] for e in content["where"]["experiments"]} == {"run0", "run1", "run2", "run3"}
    said = capsys.readouterr().out
    assert said.startswith("verdict: ") and "Coulomb friction at joint" in said


@pytest.mark.long
def test_the_same_seed_gives_the_same_files_and_a_result_is_replaced(case: Path) -> None:
    call(case)
    first = files_of(case / "out")
    call(case)
    assert files_of(case / "out") == first
    call(case, "again")
    again = files_of(case / "again")
    assert {**again, "index.html": b""} == {**first, "index.html": b""}  # whose command has another out=


@pytest.mark.long
def test_names_of_files_may_be_texts_as_in_a_notebook(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from unmodelled.cli.verbs.diagnose import diagnose as verb

    assert verb is diagnose
    monkeypatch.chdir(case)
    verb(system="system.yaml", logs="logs", out="out")
    assert (case / "out" / "diagnosis.json").exists()


@pytest.mark.long
def test_logs_in_degrees_are_the_answer(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    known(tmp_path)
    for log in (tmp_path / "logs").glob("run*.csv"):
        pd.read_csv(log).assign(theta=lambda table: np.degrees(table["theta"])).to_csv(log, index=False)
    call(tmp_path)
    content = read_json(tmp_path / "out" / "diagnosis.json")
    assert (content["verdict"], content["effects"], content["comparison"]) == ("check_logs", [], [])
    (row,) = content["logs"]
    assert (row["channel"], row["problem"], row["experiments"]) == ("theta", "degrees", [])
    assert content["confidence"] == pytest.approx(min(row["explains"], 0.99))
    first, second, *_ = capsys.readouterr().out.splitlines()
    assert first.startswith("verdict: check the logs first") and second == row["sentence"]
    page = unescape((tmp_path / "out" / "index.html").read_text())
    assert page.index("<h1>Check the logs first.</h1>") < page.index(row["sentence"])
    drawn = {each.stem for each in (tmp_path / "out" / "figures").glob("*.svg")}
    assert drawn == {"experiments", "before_and_after"}
    assert not [note for note in content["notes"] if "could not be made" in note]


@pytest.mark.long
def test_what_goes_wrong_keeps_the_old_result(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    call(case)
    before = files_of(case)
    monkeypatch.setattr(findings, "write_augmented", raising(BadInput("the disk is full")))
    with pytest.raises(BadInput, match="the disk is full"):
        call(case)
    assert files_of(case) == before


@pytest.mark.long
def test_what_cannot_be_drawn_is_a_note_and_the_rest_is_there(
    case: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    fail = raising(KeyError("no such\nlabel"))
    monkeypatch.setattr(figures, "FIGURES", {**figures.FIGURES, "lacking": fail})
    call(case)
    (note,) = (n for n in read_json(case / "out" / "diagnosis.json")["notes"] if "could not" in n)
    assert note.startswith("figures/lacking.svg could not be made (KeyError: 'no such")
    assert f"note: {note}" in capsys.readouterr().out
    drawn = {path.stem for path in (case / "out" / "figures").glob("*.svg")}
    assert drawn == {*figures.figures_of(case / "out")} - {"lacking"}
    page = (case / "out" / "index.html").read_text()
    assert "figures/lacking.svg could not be made" in page and page.count("data:image/svg+xml") == len(drawn)


@pytest.mark.long
@pytest.mark.parametrize("part", ["write_tables", "write_figures", "write_page"])
def test_no_fault_after_the_answer_costs_it(
    case: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], part: str
) -> None:
    call(case, "whole")
    fail = raising(ZeroDivisionError("of a picture"))
    monkeypatch.setattr(findings if part == "write_tables" else api, part, fail)
    call(case)
    content, whole = (read_json(case / out / "diagnosis.json") for out in ("out", "whole"))
    assert content.pop("notes")[:-1] == whole.pop("notes") and content == whole
    augmented = [(case / out / "augmented_system.yaml").read_bytes() for out in ("out", "whole")]
    assert augmented[0] == augmented[1]
    assert "could not be made (ZeroDivisionError: of a picture)" in capsys.readouterr().out
    assert not (case / "out" / "index.html").exists()


@pytest.mark.long
def test_a_machine_that_cannot_be_shown_live_costs_no_page(
    case: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    call(case, "whole")
    assert 'id="live-data"' in (case / "whole" / "index.html").read_text()
    fail = raising(ValueError("the machine has no instruction for this"))
    monkeypatch.setattr(findings, "write_live", fail)
    call(case)
    page = (case / "out" / "index.html").read_text()
    assert "live.json could not be made (ValueError: the machine has no" in page
    assert 'id="live-data"' not in page and "uPlot" not in page and 'id="live"' not in page


@pytest.mark.long
def test_a_disk_that_is_full_after_the_answer_does_not_cost_it(
    case: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    fail = raising(BadInput("out: cannot be written: No space left on device"))

    def full(*_: object) -> None:
        monkeypatch.setattr(findings, "write_json", fail)
        fail()

    monkeypatch.setattr(findings, "write_tables", full)
    call(case)
    assert read_json(case / "out" / "diagnosis.json")["verdict"] == "effect"
    assert "tables could not be made (out: cannot be written: No space left" in capsys.readouterr().out
