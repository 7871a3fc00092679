"""What is noted of a stage: only of stages of the graph, only of those that came to their end."""

import json
from pathlib import Path

import pytest

from pipeline.__main__ import EXECUTIONS, PACKAGES, note
from tests.commands import python


def test_a_stage_of_the_graph_is_noted_when_it_is_done(tmp_path: Path) -> None:
    command = ["-m", "pipeline", "site", "out=pages", "metrics=numbers"]
    stage = {"DVC_STAGE": "site@a", "DVC_ROOT": str(tmp_path / "root")}
    assert python(*command, cwd=tmp_path, DVC_STAGE=None, DVC_ROOT=None).returncode == 0
    assert not (tmp_path / EXECUTIONS).exists()
    assert python(*command, cwd=tmp_path, **stage).returncode == 0
    (path,) = (tmp_path / "root" / EXECUTIONS).iterdir()
    content = json.loads(path.read_text())
    assert path.name == "site@a.json" and content["stage"] == "site@a"
    assert content["command"] == "python -m pipeline site out=pages metrics=numbers"
    assert "metrics: numbers\n" in content["configuration"] and content["seed"] is None
    assert 0 < content["seconds"] < 60 and set(content["versions"]) == {"python", *PACKAGES}
    # one that fails leaves the note of the last that did not
    (tmp_path / "numbers").mkdir()
    (tmp_path / "numbers" / "a.json").write_text("{")
    assert python(*command, cwd=tmp_path, **stage).returncode == 2
    assert json.loads(path.read_text()) == content


def test_a_stage_cannot_write_elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DVC_STAGE", "elsewhere/dvc.yaml:../train")
    monkeypatch.setenv("DVC_ROOT", str(tmp_path))
    note("python -m pipeline train", "seed: 1\n", 1, 2.0)
    (path,) = (tmp_path / EXECUTIONS).iterdir()
    assert json.loads(path.read_text())["seed"] == 1
