"""Ctrl-C ends every command with one line and exit code 130; what was there before is there still."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from unmodelled.base.ownership import MARKER
from unmodelled.base.workers import INTERRUPTION

SYSTEM = Path(__file__).parents[2] / "systems" / "pendulum.yaml"


def interrupted(arguments: list[str], folder: Path, ready: Callable[[psutil.Process], bool]) -> list[str]:
    """What a verb says when it is interrupted, as from a terminal, once it is `ready`; no process is left."""
    with subprocess.Popen(
        [sys.executable, "-m", "pipeline", *arguments],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "EXP_PROGRESS": "quiet"},
        start_new_session=True,
    ) as process:
        deadline = time.monotonic() + 90.0
        while not ready(psutil.Process(process.pid)):
            assert process.poll() is None and time.monotonic() < deadline
            time.sleep(0.02)
        below = psutil.Process(process.pid).children(recursive=True)
        os.killpg(process.pid, signal.SIGINT)
        said = process.communicate(timeout=60)[1].splitlines()
        assert process.returncode == 130, said
        assert not psutil.wait_procs(below, timeout=30)[1]
    return said


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "campaign.zip").write_text("of an earlier run")
    (tmp_path / "out" / MARKER).write_text('{"made_by": "acquire"}')
    return tmp_path


def workers(process: psutil.Process) -> bool:
    """Whether the processes of a pool have started, and loaded their libraries for a while."""
    return sum(child.cpu_times().user > 1.0 for child in process.children()) >= 2


@pytest.mark.long
@pytest.mark.parametrize("moment", ["libraries", "workers"])
def test_one_line_and_nothing_is_changed(moment: str, folder: Path) -> None:
    def loading(process: psutil.Process) -> bool:
        return bool(process.cpu_times().user > 0.4)

    out = folder / "out"
    ready = workers if moment == "workers" else loading
    assert interrupted(["acquire", f"out={out}"], folder, ready) == [INTERRUPTION]
    assert [p.name for p in folder.iterdir()] == ["out"]
    assert (out / "campaign.zip").read_text() == "of an earlier run"


def test_the_exit_code_is_130_wherever_it_hits(tmp_path: Path) -> None:
    code = "from unmodelled.base.workers import *\ntry: exec('raise KeyboardInterrupt')\n"
    (tmp_path / "hit.py").write_text(code + "except KeyboardInterrupt: leave(INTERRUPTED)")
    assert subprocess.run([sys.executable, "-m", "hit"], cwd=tmp_path, check=False).returncode == 130


def test_threads_are_not_waited_for(folder: Path) -> None:
    code = "import time; from unmodelled.base.workers import *; heed_interruptions()\n"
    code += "try:\n with threads_of(2) as pool: print(pool.submit(time.sleep, 100).result())\n"
    code += "except KeyboardInterrupt: leave(INTERRUPTED)"
    with subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True) as process:
        while psutil.Process(process.pid).num_threads() < 2:
            assert process.poll() is None
            time.sleep(0.01)
        time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=30)[1] == "" and process.returncode == 130


@pytest.mark.long
@pytest.mark.parametrize("launcher", ["basic", "joblib"])
def test_a_sweep_ends_with_one_line(launcher: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if launcher == "joblib":
        pytest.importorskip("hydra_plugins.hydra_joblib_launcher")
        monkeypatch.setenv("EXP_LAUNCHER", "joblib")
    sweep = folder / "sweep"

    def started(_: psutil.Process) -> bool:
        return sweep.exists() and any(sweep.glob("*/.hydra/overrides.yaml"))

    said = interrupted(["acquire", "-m", "seed=1,2", f"hydra.sweep.dir={sweep}"], folder, started)
    assert said.count(INTERRUPTION) == 1 and not any("Traceback" in line for line in said), said
    assert not list(sweep.rglob("campaign.zip")) and not list(sweep.rglob("error.txt"))
