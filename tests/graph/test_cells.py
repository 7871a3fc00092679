"""One command for many cells of a verb."""

import json
from pathlib import Path

import psutil
import pytest

from pipeline.cells import cells
from tests.cli.test_interrupted import interrupted
from tests.commands import python
from unmodelled.base.workers import INTERRUPTION


def test_lists_are_expanded_and_named_in_other_values() -> None:
    words = "train model=@models split=@splits out=fits/{model}/{split}/x + draw only=[a] out=data/b/c/d"
    found = cells(words.split(), {"models": ["a", "b"], "splits": [1, 2]})
    assert list(found) == ["a-1", "a-2", "b-1", "b-2", "c-d"]
    assert found["b-1"] == ["train", "model=b", "split=1", "out=fits/b/1/x"]
    assert found["c-d"] == ["draw", "only=[a]", "out=data/b/c/d"]


def test_a_name_that_hydra_would_take_for_nothing_stays_a_name() -> None:
    found = cells(["acquire", "source.kind=@kinds", "out=raw/{source.kind}"], {"kinds": ["null"]})
    assert found == {"null": ["acquire", "source.kind='null'", "out=raw/null"]}


def test_cells_of_one_name_are_refused() -> None:
    with pytest.raises(ValueError, match="out"):
        cells(["ingest", "out=data/a/x", "+", "ingest", "out=data/b/x"], {})


@pytest.mark.long
def test_all_cells_are_run_and_noted(tmp_path: Path) -> None:
    (tmp_path / "params.yaml").write_text("sources: [pendulum, slider_crank]\n")
    words = ["acquire", "source=@sources", "out=raw/{source}"]
    done = python("-m", "pipeline.cells", *words, cwd=tmp_path, DVC_STAGE="acquire", DVC_ROOT=str(tmp_path))
    assert done.returncode == 0, done.stderr
    assert {p.parent.name for p in tmp_path.glob("raw/*/provenance.json")} == {"pendulum", "slider_crank"}
    notes = [json.loads(p.read_text()) for p in sorted((tmp_path / "data/executions").iterdir())]
    assert [note["stage"] for note in notes] == ["acquire@pendulum", "acquire@slider_crank"]
    assert notes[0]["command"].endswith("acquire source=pendulum out=raw/pendulum")


@pytest.mark.long
def test_a_cell_that_is_refused_says_why_and_the_others_are_done(tmp_path: Path) -> None:
    (tmp_path / "params.yaml").write_text("{}\n")
    words = ["acquire", "source=pendulum", "out=raw/a", "+", "ingest", "raw=nowhere", "out=b"]
    done = python("-m", "pipeline.cells", *words, cwd=tmp_path)
    assert done.returncode == 2 and done.stderr.count("error: ") == 1 and "Traceback" not in done.stderr
    assert (tmp_path / "raw/a/provenance.json").exists() and not (tmp_path / "b").exists()


def test_without_a_command_the_usage_is_said(tmp_path: Path) -> None:
    (tmp_path / "params.yaml").write_text("{}\n")
    done = python("-m", "pipeline.cells", cwd=tmp_path)
    assert done.returncode == 2 and "python -m pipeline.cells <verb>" in done.stderr


def test_an_interruption_is_said_once_and_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "params.yaml").write_text("{}\n")
    words = ["acquire", "source=virtual", "out=data/raw/a", "+", "acquire", "source=clutch", "out=data/raw/b"]

    def all_at_work(process: psutil.Process) -> bool:
        return len(process.children(recursive=True)) >= 3

    assert interrupted(["pipeline.cells", *words], tmp_path, all_at_work) == [INTERRUPTION]
    assert not list(tmp_path.glob("data/raw/[!.]*"))
