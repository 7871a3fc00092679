"""What a killed `dvc repro` leaves is put right; what is at work is left alone."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from dvc.lock import Lock

from pipeline.mend import mend

GONE = 2**22 + 1  # larger than any process id


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A checkout in which DVC has run."""
    (tmp_path / ".dvc" / "tmp").mkdir(parents=True)
    return tmp_path


def cached(root: Path, content: bytes) -> Path:
    digest = hashlib.md5(content).hexdigest()
    path = root / ".dvc" / "cache" / "files" / "md5" / digest[:2] / digest[2:]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return path


def locks(root: Path, content: str) -> Path:
    path = root / ".dvc" / "tmp" / "rwlock"
    path.write_text(content)
    return path


def test_nothing_is_done_before_dvc_has_run(tmp_path: Path) -> None:
    (tmp_path / "dvc.lock").write_text("half: [")
    assert mend(tmp_path) == []
    assert (tmp_path / "dvc.lock").exists()


@pytest.mark.parametrize(
    "content", ["", '{"write": {', "[]", '{"write": {"/a": {"pid": 4194305, "cmd": "dvc"}}}']
)
def test_locks_of_processes_that_are_gone_are_removed(content: str, root: Path) -> None:
    path = locks(root, content)
    assert mend(root) == []
    assert not path.exists()


def test_locks_of_a_process_that_has_the_number_of_a_dvc_are_removed(root: Path) -> None:
    """After a restart numbers are taken again."""
    path = locks(root, json.dumps({"write": {}, "read": {"/a": [{"pid": os.getpid(), "cmd": "dvc repro"}]}}))
    mend(root)
    assert not path.exists()


def test_a_dvc_at_work_keeps_its_locks(root: Path) -> None:
    code = "import sys, time; print('ready', flush=True); time.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", code, "dvc"], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None and process.stdout.readline()
        path = locks(root, json.dumps({"write": {"/a": {"pid": process.pid, "cmd": "dvc repro"}}}))
        mend(root)
        process.kill()
    assert path.exists()


STAGE = {"cmd": "true", "deps": [{"path": "a", "hash": "md5", "md5": "0" * 32, "size": 3}]}
WHOLE = yaml.safe_dump({"schema": "2.0", "stages": {f"stage{k}": STAGE for k in range(30)}}, sort_keys=False)


@pytest.mark.parametrize("length", [0, 3, 25, len(WHOLE) // 2 + 3])
def test_half_a_dvc_lock_is_put_aside(length: int, root: Path) -> None:
    (root / "dvc.lock").write_text(WHOLE[:length])
    (line,) = mend(root)
    assert "dvc.lock" in line and not (root / "dvc.lock").exists()
    assert (root / "dvc.lock.damaged.tmp").read_text() == WHOLE[:length]


def test_a_whole_dvc_lock_stays(root: Path) -> None:
    (root / "dvc.lock").write_text(WHOLE)
    assert mend(root) == []
    assert (root / "dvc.lock").read_text() == WHOLE


def test_nothing_is_touched_while_dvc_holds_its_lock(root: Path) -> None:
    (root / "dvc.lock").write_text("half: [")
    path = locks(root, "")
    with Lock(str(root / ".dvc" / "tmp" / "lock")):
        assert mend(root) == []
    assert path.exists() and (root / "dvc.lock").exists()
    assert len(mend(root)) == 1


def test_a_damaged_file_of_the_cache_is_removed_and_its_copy_looked_at(root: Path) -> None:
    good, bad = cached(root, b"x" * 100), cached(root, b"y" * 200)
    bad.write_bytes(b"y" * 199 + b"z")
    (root / "data").mkdir()
    for path, name in ((good, "good"), (bad, "bad")):
        (root / "data" / name).write_bytes(path.read_bytes())
        os.utime(root / "data" / name, (0, 0))
    (line,) = mend(root)
    assert str(bad) in line and not bad.exists() and good.exists()
    times = {p.name: p.stat().st_mtime for p in (root / "data").iterdir()}
    assert times["good"] == 0 and times["bad"] > 0


def test_what_a_killed_stage_was_writing_is_removed(root: Path) -> None:
    names = {
        **{f".out.{GONE}.0123abcd.tmp": False, f".out.{os.getpid()}.0123abcd.tmp": True},
        **{".out.growing.tmp": True, ".leave_one_out.checkpoint": True, "out": True},
    }
    for name in names:
        (root / "data" / name).mkdir(parents=True)
    assert len(mend(root)) == 1
    assert {p.name for p in (root / "data").iterdir()} == {name for name, stays in names.items() if stays}


def test_dvc_goes_on_after_a_damaged_cache_and_half_a_lock(tmp_path: Path) -> None:
    """With DVC itself: what it would hand on damaged is made again, what it would refuse is forgotten."""

    def dvc(*arguments: str) -> None:
        command = [sys.executable, "-m", "dvc", *arguments]
        subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, env=environment)

    environment = {**os.environ, "DVC_SITE_CACHE_DIR": str(tmp_path / "site")}
    make = f"{sys.executable} -c \"print('made', file=open('data/a', 'w'))\""
    stages = {"make": {"cmd": make, "deps": ["in"], "outs": ["data/a"]}}
    (tmp_path / "dvc.yaml").write_text(yaml.safe_dump({"stages": stages}))
    (tmp_path / "in").write_text("")
    (tmp_path / "data").mkdir()
    dvc("init", "-q", "--no-scm")
    dvc("repro")
    (copy,) = (p for p in (tmp_path / ".dvc/cache/files").rglob("*") if p.is_file())
    copy.chmod(0o644)
    copy.write_text("mad\0\n")
    copy.chmod(0o444)  # the mode by which DVC believes it
    (tmp_path / "data" / "a").unlink()
    (tmp_path / "dvc.lock").write_bytes((tmp_path / "dvc.lock").read_bytes()[:18])
    locks(tmp_path, "")
    assert len(mend(tmp_path)) == 2
    dvc("repro")
    assert (tmp_path / "data" / "a").read_text() == "made\n"
