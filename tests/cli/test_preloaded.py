"""Stages that are forks of a process with its libraries loaded."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

import psutil
import pytest

from pipeline.preloaded import ADDRESS
from unmodelled.base.workers import NUMERICAL
from unmodelled.cli.command_line import INTERRUPTION

ASK = "import sys; from pipeline.preloaded import ask; print(ask(sys.argv[1:]))"


class Server(NamedTuple):
    """A process that forks, and the environment of what runs below its command."""

    pid: int
    command: str
    environment: dict[str, str]

    def forks(self) -> list[int]:
        """Stages at work."""
        children = Path(f"/proc/{self.pid}/task/{self.pid}/children").read_text().split()
        return [int(pid) for pid in children if pid != self.command]

    def call(self, *command: str, **environment: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, *command],
            capture_output=True,
            text=True,
            env={**self.environment, **environment},
        )


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    # without progress, which is said after some seconds only
    environment = {**os.environ, **dict.fromkeys(NUMERICAL, "1"), "EXP_PROGRESS": "quiet"}
    command = ["bash", "-c", f"echo $$ ${ADDRESS}; cat; kill -9 $$"]
    with subprocess.Popen(
        [sys.executable, "-m", "pipeline.preloaded", *command],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
    ) as process:
        assert process.stdout is not None and process.stdin is not None
        pid, address = process.stdout.readline().split()
        yield Server(process.pid, pid, {**environment, ADDRESS: address})
        process.stdin.close()
        assert process.wait(timeout=30) == 128 + signal.SIGKILL
    assert not Path(address).parent.exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ["ingest", "--help"],
        ["acquire", "source=slider_crank"],
        ["ingest", "raw=nowhere"],
        ["no_verb"],
    ],
)
def test_the_same_is_printed_and_the_exit_code_is_the_same(
    arguments: list[str], server: Server, tmp_path: Path
) -> None:
    out = [] if arguments[-1] in ("--help", "no_verb") else [f"out={tmp_path / 'out'}"]
    forked = server.call("-m", "pipeline", *arguments, *out)
    alone = server.call("-m", "pipeline", *arguments, *out, **{ADDRESS: ""})
    assert (forked.returncode, forked.stdout, forked.stderr) == (
        alone.returncode,
        alone.stdout,
        alone.stderr,
    )
    assert (tmp_path / "out").exists() == (forked.returncode == 0 and bool(out))


def test_a_stage_that_cannot_be_the_same_is_left_to_who_asks(server: Server, tmp_path: Path) -> None:
    assert server.call("-c", ASK, "--help").stdout.splitlines()[-1] == "0"
    assert server.call("-c", ASK, "--help", OMP_NUM_THREADS="2").stdout == "None\n"
    assert server.call("-O", "-c", ASK, "--help").stdout == "None\n"
    assert server.call("-c", ASK, "--help", **{ADDRESS: str(tmp_path / "socket")}).stdout == "None\n"
    edited = "import pipeline.preloaded as p; p._program = lambda: 'edited'; print(p.ask(['--help']))"
    assert server.call("-c", edited).stdout == "None\n"


def test_callers_that_say_nothing_or_leave_do_not_disturb(server: Server) -> None:
    for said in (b"", b"?", b'?["--help"]\n', b"?nonsense\n"):
        with socket.socket(socket.AF_UNIX) as connection:
            connection.connect(server.environment[ADDRESS])
            connection.sendall(said)
    assert server.call("-c", ASK, "--help").stdout.splitlines()[-1] == "0"


@pytest.mark.parametrize("killed", ["caller", "stage"])
def test_a_stage_and_who_asked_for_it_end_together(killed: str, server: Server, tmp_path: Path) -> None:
    caller = subprocess.Popen(
        [sys.executable, "-m", "pipeline", "acquire", f"out={tmp_path / 'raw'}"],
        env=server.environment,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 30.0
    while not (forks := server.forks()):
        assert time.monotonic() < deadline and caller.poll() is None
        time.sleep(0.01)
    os.kill(caller.pid if killed == "caller" else forks[0], signal.SIGKILL)
    errors = caller.communicate(timeout=30)[1]
    if killed == "stage":
        assert caller.returncode == 1 and errors.endswith("error: the stage was killed\n")
    while server.forks():
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert not (tmp_path / "raw").exists()


def descendants(process: psutil.Process, count: int) -> list[psutil.Process]:
    """All processes below one, once there are `count`."""
    deadline = time.monotonic() + 60.0
    while len(found := process.children(recursive=True)) < count:
        assert time.monotonic() < deadline and process.is_running()
        time.sleep(0.05)
    return found


@contextmanager
def at_work(folder: Path) -> Iterator[tuple[subprocess.Popen[str], list[psutil.Process]]]:
    """A server in a process group of its own, below which a stage works, with its socket in `folder`."""
    stage = [sys.executable, "-m", "pipeline", "acquire", f"out={folder / 'raw'}"]
    with subprocess.Popen(
        [sys.executable, "-m", "pipeline.preloaded", *stage],
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, **dict.fromkeys(NUMERICAL, "1"), "EXP_PROGRESS": "quiet", "TMPDIR": str(folder)},
        start_new_session=True,
    ) as server:
        try:
            # who asks, the fork that does it, and its workers
            yield server, descendants(psutil.Process(server.pid), 3)
        finally:
            with suppress(ProcessLookupError):
                os.killpg(server.pid, signal.SIGKILL)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_nothing_outlives_a_server_that_is_killed(number: signal.Signals, tmp_path: Path) -> None:
    with at_work(tmp_path) as (server, below):
        server.send_signal(number)
        server.communicate(timeout=30)
        assert server.returncode == (143 if number == signal.SIGTERM else -number)
        assert not psutil.wait_procs(below, timeout=30)[1]
    left = list(tmp_path.glob("exp-preloaded-*"))
    assert len(left) == (number == signal.SIGKILL)
    # the next one removes what that one could not
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    assert (
        subprocess.run([sys.executable, "-m", "pipeline.preloaded", "true"], env=environment).returncode == 0
    )
    assert not list(tmp_path.glob("exp-preloaded-*")) and not (tmp_path / "raw").exists()


def test_an_interruption_is_said_once(tmp_path: Path) -> None:
    with at_work(tmp_path) as (server, below):
        os.killpg(server.pid, signal.SIGINT)
        said = server.communicate(timeout=30)[1]
        assert (server.returncode, said) == (130, f"{INTERRUPTION}\n")
        assert not psutil.wait_procs(below, timeout=30)[1]
    assert not list(tmp_path.iterdir())


def test_it_says_how_it_is_used() -> None:
    result = subprocess.run([sys.executable, "-m", "pipeline.preloaded"], capture_output=True, text=True)
    assert result.returncode == 1 and result.stderr.startswith("usage: ")


def test_where_no_socket_can_be_the_command_runs_all_the_same(tmp_path: Path) -> None:
    deep = tmp_path / ("x" * 120)
    deep.mkdir()
    command = [sys.executable, "-m", "pipeline.preloaded", "bash", "-c", "exit 7"]
    assert subprocess.run(command, env={**os.environ, "TMPDIR": str(deep)}).returncode == 7
    assert not list(deep.iterdir())
