"""Ctrl-C and SIGTERM end every command with one line and an exit code; what was there before stays."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil
import pytest

from unmodelled.base.markers import MARKER
from unmodelled.base.workers import INTERRUPTION

Ready = Callable[[psutil.Process], bool]
#: What is said on standard error is read, all else is not.
SAID: Any = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}


def interrupted(
    arguments: list[str], folder: Path, ready: Ready, number: signal.Signals = signal.SIGINT
) -> list[str]:
    """What a module says when it is interrupted as from a terminal once it is `ready`; no process is left."""
    environment = {**os.environ, "EXP_PROGRESS": "quiet"}
    how = {"cwd": folder, "env": environment, "start_new_session": True, **SAID}
    with subprocess.Popen([sys.executable, "-m", *arguments], **how) as process:
        deadline = time.monotonic() + 90.0
        while not ready(psutil.Process(process.pid)):
            assert process.poll() is None and time.monotonic() < deadline
            time.sleep(0.02)
        below = psutil.Process(process.pid).children(recursive=True)
        os.killpg(process.pid, number)
        said = process.communicate(timeout=60)[1].splitlines()
        assert process.returncode == 128 + number, said
        assert not psutil.wait_procs(below, timeout=30)[1]
    return said


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "campaign.zip").write_text("of an earlier run")
    (tmp_path / "out" / MARKER).write_text('{"files": ["campaign.zip"], "made_by": "acquire"}')
    return tmp_path


def loading(process: psutil.Process) -> bool:
    """Whether the process has loaded libraries for a while."""
    return bool(process.cpu_times().user > 0.4)


def workers(process: psutil.Process) -> bool:
    """Whether the processes of a pool have started, and loaded their libraries for a while."""
    return sum(child.cpu_times().user > 1.0 for child in process.children()) >= 2


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("ready", [loading, workers])
def test_one_line_and_nothing_is_changed(ready: Ready, number: signal.Signals, folder: Path) -> None:
    out = folder / "out"
    assert interrupted(["pipeline", "acquire", f"out={out}"], folder, ready, number) == [INTERRUPTION]
    assert [p.name for p in folder.iterdir()] == ["out"]
    assert (out / "campaign.zip").read_text() == "of an earlier run"


def test_a_pool_that_is_left_at_once_says_nothing(tmp_path: Path) -> None:
    """Its semaphores are left behind."""
    code = "from unmodelled.base.workers import *\nif __name__ == '__main__':\n    with pool_of(1) as pool:\n"
    (tmp_path / "left.py").write_text(
        code + "        print(pool.submit(abs, -1).result(), flush=True)\n        os._exit(130)"
    )
    found = subprocess.run([sys.executable, "-m", "left"], cwd=tmp_path, capture_output=True, check=False)
    assert (found.returncode, found.stdout, found.stderr) == (130, b"1\n", b"")


def test_the_exit_code_is_130_wherever_it_hits(tmp_path: Path) -> None:
    code = "from unmodelled.base.workers import *\ntry: exec('raise KeyboardInterrupt')\n"
    (tmp_path / "hit.py").write_text(code + "except KeyboardInterrupt: leave(exit_code())")
    assert subprocess.run([sys.executable, "-m", "hit"], cwd=tmp_path, check=False).returncode == 130


#: Sends itself a signal as its very last act, when Python has already taken its handlers away.
LATE = """
import os, sys
from unmodelled.base.workers import *
class Last:
    def __del__(self, kill=os.kill, process=os.getpid(), number=int(sys.argv[1])):
        kill(process, number)
heed_interruptions()
last = Last()
leave(0)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_python_shuts_down_changes_no_exit_code(number: signal.Signals) -> None:
    command = [sys.executable, "-c", LATE, str(int(number))]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_what_is_said_to_be_written_is_a_success(number: signal.Signals, tmp_path: Path) -> None:
    """From the line on; before it, the result is not there yet or the exit code is that of the signal."""
    example = Path(__file__).parents[2] / "unmodelled" / "api" / "examples" / "pendulum"
    system, logs = f"system={example / 'pendulum.yaml'}", f"logs={example / 'logs'}"
    command = [sys.executable, "-m", "unmodelled", "simulate", system, logs, "out=answer"]
    for wait in (0.0, 0.05):
        with subprocess.Popen(command, cwd=tmp_path, **SAID) as process:
            assert process.stderr is not None and any(line.startswith("wrote ") for line in process.stderr)
            time.sleep(wait)
            process.send_signal(number)
            assert process.wait(30) == 0
        assert (tmp_path / "answer" / "index.html").exists()


def test_threads_are_not_waited_for(folder: Path) -> None:
    code = "import time; from unmodelled.base.workers import *; heed_interruptions()\n"
    code += "try:\n with threads_of(2) as pool: print(pool.submit(time.sleep, 100).result())\n"
    code += "except KeyboardInterrupt: leave(exit_code())"
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

    words = ["pipeline", "acquire", "-m", "seed=1,2", f"hydra.sweep.dir={sweep}"]
    said = interrupted(words, folder, started)
    assert said.count(INTERRUPTION) == 1 and not any("Traceback" in line for line in said), said
    assert not list(sweep.rglob("campaign.zip")) and not list(sweep.rglob("error.txt"))
