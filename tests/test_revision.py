"""The revision that stands beside a result."""

import subprocess
from pathlib import Path

import pytest

from pipeline.revision import revision


def test_only_what_decides_a_result_makes_a_revision_dirty(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert revision() == "unknown"
    for name in ("conf/a.yaml", "dvc.yaml", "dvc.lock", "reports/a.json"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("1\n")
    own = ("-c", "user.name=a", "-c", "user.email=a@b", "-c", "init.defaultBranch=main")
    for command in (("init", "-q"), ("add", "."), ("commit", "-qm", "all")):
        subprocess.run(["git", *own, *command], check=True)
    clean = revision()
    assert 7 <= len(clean) <= 40 and "dirty" not in clean
    (tmp_path / "reports" / "a.json").write_text("2\n")
    (tmp_path / "dvc.lock").write_text("2\n")
    assert revision() == clean
    subprocess.run(["git", *own, "commit", "-qam", "results"], check=True)
    assert revision() == clean
    (tmp_path / "dvc.yaml").write_text("2\n")
    assert revision() == f"{clean}-dirty"
