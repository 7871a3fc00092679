"""Jobs side by side: all are done, failures are told, what was done before a kill is kept; workers end."""

import multiprocessing
import os
import signal
import time
from collections.abc import Collection
from functools import partial
from pathlib import Path

import pytest

from pipeline.jobs import IDENTITY, growing_folder, run_jobs
from unmodelled.base.errors import BadInput
from unmodelled.base.files import write_json
from unmodelled.base.markers import MARKER
from unmodelled.base.workers import pool_of

ABOUT = {"seed": 1, "levels": (0.5, 2.0)}


def work(path: Path) -> None:
    """Writes which process did it with how many threads; refuses a name that begins with `bad`."""
    if path.name.startswith("bad"):
        raise BadInput(f"{path.name} cannot be used")
    write_json(path, [os.getpid(), os.environ.get("OMP_NUM_THREADS")])


@pytest.mark.parametrize("workers", [1, 2])
def test_a_failing_job_does_not_keep_others_from_being_done(workers: int, tmp_path: Path) -> None:
    names = ("a.json", "bad.json", "c.json")
    with pytest.raises(BadInput, match=r"bad\.json cannot be used") as caught:
        run_jobs({name: partial(work, tmp_path / name) for name in names}, workers, "working")
    assert caught.value.__notes__ == ["in bad.json"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.json", "c.json"]


def test_processes_have_one_thread_each(tmp_path: Path) -> None:
    before = dict(os.environ)
    run_jobs({name: partial(work, tmp_path / name) for name in ("a", "b")}, 2, "working")
    texts = [(tmp_path / name).read_text() for name in ("a", "b")]
    assert all('"1"' in text and str(os.getpid()) not in text for text in texts)
    assert dict(os.environ) == before


def results(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir() if path.name != MARKER)


def interrupted(path: Path, about: dict[str, object], *names: str, code: Collection[Path] = ()) -> list[str]:
    """Writes files of some names and is killed; what was there when it began."""
    with pytest.raises(KeyboardInterrupt), growing_folder(path, about, code) as folder:
        there = sorted(p.name for p in folder.iterdir() if p.name != IDENTITY)
        for name in names:
            write_json(folder / name, name)
        raise KeyboardInterrupt
    return there


def test_what_was_done_before_a_kill_is_kept(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with growing_folder(out, {}) as folder:
        write_json(folder / "old.json", 0)
    assert interrupted(out, ABOUT, "a.json") == []
    assert interrupted(out, ABOUT, "b.json") == ["a.json"]
    assert results(out) == ["old.json"]
    with growing_folder(out, ABOUT) as folder:
        write_json(folder / "c.json", 0)
    assert results(out) == ["a.json", "b.json", "c.json"]
    assert list(tmp_path.iterdir()) == [out]
    assert interrupted(out, ABOUT) == []


def test_other_work_starts_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    interrupted(out, ABOUT, "a.json")
    assert interrupted(out, ABOUT | {"seed": 2}, "b.json") == []
    assert interrupted(out, ABOUT | {"seed": 2}) == ["b.json"]
    program = tmp_path / "program"
    program.mkdir()
    (program / "a.py").write_text("a = 1")
    assert interrupted(out, ABOUT | {"seed": 2}, "c.json", code=[program]) == []
    assert interrupted(out, ABOUT | {"seed": 2}, code=[program]) == ["c.json"]
    (program / "a.py").write_text("a = 2")
    assert interrupted(out, ABOUT | {"seed": 2}, "d.json") == []
    monkeypatch.setattr("pipeline.jobs.LIBRARY", tmp_path / "program")
    assert interrupted(out, ABOUT | {"seed": 2}) == []


def test_a_second_run_at_once_is_refused_and_the_first_goes_on(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with growing_folder(out, ABOUT) as folder:
        write_json(folder / "a.json", 0)
        with pytest.raises(BadInput, match="out: another run is at work on it"), growing_folder(out, ABOUT):
            pass
        write_json(folder / "b.json", 0)
    assert results(out) == ["a.json", "b.json"]
    assert list(tmp_path.iterdir()) == [out]


def test_a_folder_of_a_user_is_refused_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("years of work")
    with (
        pytest.raises(BadInput, match=r"'thesis\.txt'.*no verb made it"),
        growing_folder(tmp_path / "mine", {}),
    ):
        raise AssertionError
    assert [str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*")] == ["mine", "mine/thesis.txt"]


def test_a_folder_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(BadInput, match="cannot be written"), growing_folder(tmp_path / "file" / "out", ABOUT):
        pass


def wait_long(told: Path) -> None:
    (told / str(os.getpid())).touch()
    time.sleep(60.0)


def employ(method: str, told: Path) -> None:
    """Is killed while its workers are at work."""
    multiprocessing.set_start_method(method, force=True)
    with pool_of(2) as pool:
        for _ in range(2):
            pool.submit(wait_long, told)
        while len(list(told.iterdir())) < 2:
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGKILL)


def at_work(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().split()[2] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.parametrize("method", ["spawn", "fork"])
def test_workers_end_with_the_process_they_work_for(method: str, tmp_path: Path) -> None:
    process = multiprocessing.get_context("spawn").Process(target=employ, args=(method, tmp_path))
    process.start()
    process.join(30.0)
    assert process.exitcode == -signal.SIGKILL
    pids = [int(path.name) for path in tmp_path.iterdir()]
    assert len(pids) == 2
    deadline = time.monotonic() + 20.0
    while any(at_work(pid) for pid in pids):
        assert time.monotonic() < deadline
        time.sleep(0.01)
