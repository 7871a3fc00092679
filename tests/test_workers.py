"""Worker processes: none outlives the process that it works for."""

import multiprocessing
import os
import signal
import time
from pathlib import Path

import pytest

from unmodelled.base.workers import pool_of


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
