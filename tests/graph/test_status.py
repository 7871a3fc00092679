"""What `make status` says of the graph, from what DVC says of it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.status import read_edges, readers_of, rows_of, status
from tests.conftest import ROOT, stages

DOT = """strict digraph {
"code";
"site";
"acquire";
"train@a-b";
"train@c-b";
"code" -> "train@a-b";
"code" -> "train@c-b";
"acquire" -> "train@a-b";
"acquire" -> "train@c-b";
"train@a-b" -> "site";
"code" -> "acquire";
"code" -> "site";
}
"""


@pytest.fixture
def notes(tmp_path: Path) -> Path:
    """What two cells of one stage, and one that no longer exists, noted of their last runs."""
    for name, seconds, day in (("train@a-b", 70.0, 3), ("train@c-b", 50.0, 1), ("gone", 1.0, 2)):
        about = {"stage": name, "seconds": seconds, "finished": f"2026-12-0{day}T10:11:12+00:00"}
        (tmp_path / f"{name}.json").write_text(json.dumps(about))
    return tmp_path


def test_writers_come_before_readers() -> None:
    edges = read_edges(DOT)
    assert [*edges] == ["code", "acquire", "train@a-b", "site", "train@c-b"]
    assert edges["train@a-b"] == {"code", "acquire"}
    assert readers_of({"acquire"}, edges) == {"train@a-b", "train@c-b", "site"}
    assert readers_of({"train@c-b"}, edges) == set()


def test_cells_are_added_up(notes: Path) -> None:
    row = rows_of(read_edges(DOT), notes)["train"]
    assert (row.cells, row.seconds, row.finished) == (["train@a-b", "train@c-b"], 120.0, "2026-12-03 10:11")


def test_stages_that_run_those_that_may_and_the_last_time_are_told(notes: Path) -> None:
    text = status({"train@a-b": [], "code": []}, DOT, notes)
    lines = {line.split()[0]: line for line in text.splitlines() if line}
    assert (
        "1 of 2" in lines["train"] and "2026-12-03 10:11" in lines["train"] and "2 min 0 s" in lines["train"]
    )
    assert "+ 1 of 1" in lines["site"] and lines["acquire"].split()[2] == "-" and "1 of 1" in lines["code"]
    assert "2 cells run, 1 may run, 2 are up to date; the last runs of those that run took 2 min" in text
    # train reads acquire, site reads train and not acquire
    assert lines["train"].split()[1].startswith("*") and lines["site"].split()[1] == "*"


def test_a_change_of_the_digests_alone_makes_nothing_uncertain(notes: Path) -> None:
    assert "1 cells run, 0 may run, 4 are up to date." in status({"code": []}, DOT, notes)


@pytest.mark.long
def test_the_drawing_of_the_graph_fits_a_screen(tmp_path: Path) -> None:
    dot = subprocess.run(
        [sys.executable, "-m", "dvc", "dag", "--dot"], cwd=ROOT, capture_output=True, text=True
    )
    assert dot.returncode == 0, dot.stderr
    text = status({name: [] for name in read_edges(dot.stdout)}, dot.stdout, tmp_path)
    assert {line.split()[0] for line in text.splitlines() if line} >= {
        n for n in stages() if "_real" not in n
    }
    assert max(map(len, text.splitlines())) <= 120 and len(text.splitlines()) < 45
