"""What is noted of a stage of the graph that came to its end, and the revision beside a result."""

import json
import subprocess
from pathlib import Path

import pytest

from pipeline.__main__ import EXECUTIONS, PACKAGES, note
from pipeline.revision import revision
from tests.commands import exit_code


def test_a_stage_of_the_graph_is_noted_when_it_is_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    command = ["site", "out=pages", "metrics=numbers"]
    for name in ("DVC_STAGE", "DVC_ROOT"):
        monkeypatch.delenv(name, raising=False)
    assert exit_code(*command) == 0
    assert not (tmp_path / EXECUTIONS).exists()
    monkeypatch.setenv("DVC_STAGE", "site@a")
    monkeypatch.setenv("DVC_ROOT", str(tmp_path / "root"))
    assert exit_code(*command) == 0
    (path,) = (tmp_path / "root" / EXECUTIONS).iterdir()
    content = json.loads(path.read_text())
    assert path.name == "site@a.json" and content["stage"] == "site@a"
    assert content["command"] == "python -m pipeline site out=pages metrics=numbers"
    assert "metrics: numbers\n" in content["configuration"] and content["seed"] is None
    assert 0 < content["seconds"] < 60 and set(content["versions"]) == {"python", *PACKAGES}
    # one that fails leaves the note of the last that did not
    (tmp_path / "numbers").mkdir()
    (tmp_path / "numbers" / "a.json").write_text("{")
    assert exit_code(*command) == 2
    assert json.loads(path.read_text()) == content


def test_a_stage_cannot_write_elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DVC_STAGE", "elsewhere/dvc.yaml:../train")
    monkeypatch.setenv("DVC_ROOT", str(tmp_path))
    note("python -m pipeline train", "seed: 1\n", 1, 2.0)
    (path,) = (tmp_path / EXECUTIONS).iterdir()
    assert json.loads(path.read_text())["seed"] == 1


def test_only_what_decides_a_result_makes_a_revision_dirty(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipeline.revision.CHECKOUT", tmp_path)
    assert revision() == "unknown"
    for name in ("conf/a.yaml", "dvc.yaml", "dvc.lock", "reports/a.json"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("1\n")
    own = ("-c", "user.name=a", "-c", "user.email=a@b", "-c", "init.defaultBranch=main")
    for command in (("init", "-q"), ("add", "."), ("commit", "-qm", "all")):
        subprocess.run(["git", *own, *command], cwd=tmp_path, check=True)
    clean = revision()
    assert 7 <= len(clean) <= 40 and "dirty" not in clean
    (tmp_path / "reports" / "a.json").write_text("2\n")
    (tmp_path / "dvc.lock").write_text("2\n")
    assert revision() == clean
    subprocess.run(["git", *own, "commit", "-qam", "results"], cwd=tmp_path, check=True)
    assert revision() == clean
    (tmp_path / "dvc.yaml").write_text("2\n")
    assert revision() == f"{clean}-dirty"


def test_a_repository_in_which_the_program_is_started_is_not_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its settings name commands that git runs."""
    own = revision()
    subprocess.run(["git", "init", "-q"], cwd=tmp_path, check=True)
    (tmp_path / "conf").write_text("1\n")
    subprocess.run(["git", "add", "conf"], cwd=tmp_path, check=True)
    with (tmp_path / ".git" / "config").open("a") as config:
        config.write(f'[core]\n\tfsmonitor = "touch {tmp_path}/executed; false"\n')
    monkeypatch.chdir(tmp_path)
    assert revision() == own and not (tmp_path / "executed").exists()
