"""What a killed `dvc repro` leaves is put right; what is at work is left alone."""

import fcntl
import hashlib
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
import yaml
from dvc.schema import COMPILED_LOCKFILE_SCHEMA
from dvc.utils.serialize import ParseError, load_yaml
from voluptuous import Invalid

from pipeline.mend import mend
from unmodelled.base.leftovers import locked
from unmodelled.base.progress import track

GONE = 2**22 + 1  # larger than any process id


@pytest.fixture(autouse=True)
def _no_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipeline.mend.PAUSE", 0.0)


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


def used(root: Path, content: str) -> Path:
    path = root / ".dvc" / "tmp" / "rwlock"
    path.write_text(content)
    return path


def test_nothing_is_done_before_dvc_has_run(tmp_path: Path) -> None:
    (tmp_path / "dvc.lock").write_text("half: [")
    assert mend(tmp_path) == []
    assert (tmp_path / "dvc.lock").exists()


@pytest.mark.parametrize("content", ["", '{"write": {'])
def test_a_part_of_the_list_of_files_in_use_is_removed(content: str, root: Path) -> None:
    path = used(root, content)
    assert len(mend(root)) == 1 and not path.exists()


def listed(process: int) -> str:
    return f'{{"write": {{"/a": {{"pid": {process}, "cmd": "dvc"}}}}, "read": {{}}}}'


def test_a_list_of_files_that_dvc_uses_stays(root: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", "input()", "dvc"], stdin=subprocess.PIPE) as process:
        path = used(root, listed(process.pid))
        assert mend(root) == [] and path.exists()
        process.kill()


def test_a_list_of_files_whose_process_was_killed_is_removed_before_it_is_reaped(root: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", "input()", "dvc"], stdin=subprocess.PIPE) as process:
        process.kill()
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
        path = used(root, listed(process.pid))
        assert mend(root) == [] and not path.exists()


@pytest.mark.parametrize("process", [GONE, os.getpid()], ids=["gone", "another program"])
def test_a_list_of_files_that_dvc_no_longer_uses_is_removed(process: int, root: Path) -> None:
    path = used(root, listed(process))
    assert mend(root) == [] and not path.exists()


def test_a_list_that_dvc_writes_in_the_same_moment_stays(root: Path) -> None:
    """Both are at it: DVC has the guard, and replaces the list of a killed run by its own."""
    path, code = used(root, listed(GONE)), "from pipeline.mend import main; raise SystemExit(main())"
    with subprocess.Popen([sys.executable, "-c", "input()", "dvc"], stdin=subprocess.PIPE) as dvc:
        with (root / ".dvc" / "tmp" / "rwlock.lock").open("a") as guard:
            fcntl.flock(guard, fcntl.LOCK_EX)
            mending = subprocess.Popen([sys.executable, "-c", code], cwd=root)
            time.sleep(1.0)
            assert mending.poll() is None or mending.returncode == 0
            path.write_text(listed(dvc.pid))
        assert mending.wait(60) == 0 and path.read_text() == listed(dvc.pid)
        dvc.kill()


@pytest.mark.parametrize("round_", range(20))
def test_several_runs_mend_one_checkout_at_once(round_: int, root: Path) -> None:
    used(root, listed(GONE) if round_ % 2 else "")
    (root / "dvc.lock").write_text(WHOLE[:40])
    damaged = [cached(root, bytes([k]) * 100) for k in range(20)]
    for path in damaged:
        path.write_bytes(b"mad")
    left = root / "data" / f".out.{GONE}.0123abcd.tmp"
    left.mkdir(parents=True)
    with ThreadPoolExecutor(4) as pool:
        said = [line for lines in pool.map(mend, [root] * 4) for line in lines]
    assert len(said) == len({*said})  # every repair is made, and told, once
    assert not left.exists() and not any(path.exists() for path in damaged)
    assert not (root / "dvc.lock").exists() and not (root / ".dvc" / "tmp" / "rwlock").exists()


def test_what_another_run_has_made_anew_stays_in_the_cache(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = cached(root, b"x" * 100)
    path.write_bytes(b"mad")

    def made_anew(*arguments: Any) -> list[Any]:
        found = list(track(*arguments))
        path.write_bytes(b"x" * 100)
        return found

    monkeypatch.setattr("pipeline.mend.track", made_anew)
    assert mend(root) == [] and path.read_bytes() == b"x" * 100
    assert [p.name for p in path.parent.iterdir()] == [path.name]


FILE = """
    - path: a
      hash: md5
      md5: 000102030405060708090a0b0c0d0e0f.dir
      size: 312
      nfiles: 2"""
WHOLE = f"""schema: '2.0'
stages:
  first:
    cmd: make it
    deps:{FILE}
  second@a-b:
    cmd: make it
    deps:{FILE}
    outs:{FILE}
"""


def test_a_part_of_dvc_lock_is_put_aside_unless_dvc_can_read_it(root: Path) -> None:
    for length in range(len(WHOLE)):
        (root / "dvc.lock").write_text(WHOLE[:length])
        try:
            readable = length > 0 and bool(COMPILED_LOCKFILE_SCHEMA(load_yaml(root / "dvc.lock")))
        except (ParseError, Invalid):
            readable = False
        if mend(root):
            aside = root / "dvc.lock.damaged.tmp"
            assert aside.read_text() == WHOLE[:length], length
            assert not (root / "dvc.lock").exists(), length
            aside.unlink()
        else:
            assert readable, length


def test_a_whole_dvc_lock_stays(root: Path) -> None:
    (root / "dvc.lock").write_text(WHOLE)
    assert mend(root) == []
    assert (root / "dvc.lock").read_text() == WHOLE


def test_a_lock_that_is_being_written_stays(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lengths = iter([5, len(WHOLE)])

    def goes_on(seconds: float) -> None:
        (root / "dvc.lock").write_text(WHOLE[: next(lengths)])

    monkeypatch.setattr("time.sleep", goes_on)
    (root / "dvc.lock").write_text(WHOLE[:3])
    assert mend(root) == []
    assert (root / "dvc.lock").read_text() == WHOLE


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
    with locked(root / "data" / f".out.{os.getpid()}.0123abcd.tmp"):  # as whoever writes it does
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
    used(tmp_path, "")
    assert len(mend(tmp_path)) == 3
    dvc("repro")
    assert (tmp_path / "data" / "a").read_text() == "made\n"
