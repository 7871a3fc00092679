"""A form of the diagnosis: the command `python -m unmodelled diagnose` of a checkout, with further words."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from resource import struct_rusage

from unmodelled.base.errors import BadInput
from unmodelled.base.workers import THREADS

#: Wall seconds per CPU second of the cap: a process that waits forever uses no CPU time.
PATIENCE = 20.0
#: Seconds between two looks at a process.
PAUSE = 0.1


@dataclass(frozen=True)
class Run:
    """A finished process.

    Attributes:
        cpu: user and system seconds of the process and its children.
        memory: largest memory of one of them, MB.
        wall: duration, s.
        error: reason why there is no answer; "" if there is one.
    """

    cpu: float
    memory: float
    wall: float
    error: str


@dataclass(frozen=True)
class Form:
    """A form of the diagnosis.

    Attributes:
        name: name in the rows.
        checkout: working tree whose program runs.
        words: further words of the command, such as a switch.
        program: words after `python` that start a diagnosis; another one is for tests.
    """

    name: str
    checkout: Path
    words: tuple[str, ...] = ()
    program: tuple[str, ...] = field(default=("-m", "unmodelled", "diagnose"))

    @classmethod
    def of(cls, word: str) -> Form:
        """Read NAME:CHECKOUT or NAME:CHECKOUT,WORD,WORD.

        Args:
            word: the text.

        Raises:
            BadInput: when there is no such working tree.
        """
        name, _, rest = word.partition(":")
        checkout, *words = rest.split(",")
        if not name.isidentifier() or not (Path(checkout) / "unmodelled").is_dir():
            raise BadInput(f"form: must be NAME:CHECKOUT[,WORD...] with a working tree, got {word!r}")
        return cls(name, Path(checkout).resolve(), tuple(words))

    @property
    def revision(self) -> str:
        """Commit of the working tree."""
        call = ["git", "-C", str(self.checkout), "describe", "--always", "--dirty"]
        return subprocess.run(call, capture_output=True, text=True).stdout.strip()

    def run(self, system: Path, logs: Path, out: Path, cap: float) -> Run:
        """Diagnose in a fresh process of one numerical thread.

        Args:
            system: system file.
            logs: log folder.
            out: folder of the answer.
            cap: CPU seconds after which the process is ended.
        """
        call = [
            sys.executable,
            *self.program,
            f"system={system}",
            f"logs={logs}",
            f"out={out}",
            *self.words,
            "-q",
        ]
        env = {**os.environ, **dict.fromkeys(THREADS, "1"), "PYTHONPATH": str(self.checkout)}
        log = out.with_suffix(".log")
        with log.open("w") as told:
            process = subprocess.Popen(
                # the kernel ends it at the cap; the working folder is no checkout, so that PYTHONPATH decides
                ["sh", "-c", f'ulimit -t {round(cap)}; exec "$@"', "sh", *call],
                cwd=out.parent,
                env=env,
                stdout=told,
                stderr=told,
                start_new_session=True,
            )
            start = time.monotonic()
            try:
                code, used = _waited(process, start + PATIENCE * cap)
            finally:
                _end(process)
        cpu, wall = used.ru_utime + used.ru_stime, time.monotonic() - start
        unit = 1 if sys.platform == "darwin" else 1024
        error = "" if code == 0 else _reason(code, cpu, wall, cap, log.read_text())
        return Run(cpu, used.ru_maxrss * unit / 1e6, wall, error)


def _waited(process: subprocess.Popen[bytes], end: float) -> tuple[int, struct_rusage]:
    """Exit code and use of a process, which is killed at `end`."""
    while True:
        pid, status, used = os.wait4(process.pid, os.WNOHANG)
        if pid:
            process.returncode = os.waitstatus_to_exitcode(status)
            return process.returncode, used
        if time.monotonic() > end:
            os.killpg(process.pid, signal.SIGKILL)
        time.sleep(PAUSE)


def _end(process: subprocess.Popen[bytes]) -> None:
    """End what the process left behind, and the process itself if the bench is interrupted."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        return


def _reason(code: int, cpu: float, wall: float, cap: float, told: str) -> str:
    if code in (-signal.SIGKILL, -signal.SIGXCPU):  # at the cap, or where there is no memory left
        return f"killed after {cpu:.0f} CPU s and {wall:.0f} s, with a cap of {cap:.0f} CPU s"
    last = (told.strip().splitlines() or ["nothing said"])[-1]
    return f"exit code {code}: {last}"[:300]
