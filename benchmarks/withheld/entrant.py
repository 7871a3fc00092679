"""Who enters the benchmark: a program that reads a system file and logs, and writes an answer."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from resource import struct_rusage

from benchmarks.head_to_head.__main__ import METHODS
from unmodelled.base.errors import BadInput, printable
from unmodelled.base.workers import THREADS

ROOT = Path(__file__).parents[2]
#: Wall seconds per CPU second of the cap: a process that waits forever uses no CPU time.
PATIENCE = 20.0
#: Seconds between two looks at a process.
PAUSE = 0.1


@dataclass(frozen=True)
class Run:
    """A finished process."""

    cpu: float  # user and system seconds of the process and its children
    memory: float  # largest of one of them, MB
    wall: float  # s
    error: str  # why there is no answer; "" if there is one


@dataclass(frozen=True)
class Entrant:
    """A program that answers a case: `python <program> system=FILE logs=FOLDER out=FOLDER <words> -q`.

    It writes out/answer.json (see `score`), or out/diagnosis.json, which has the same entries.
    """

    name: str  # in the rows
    program: tuple[str, ...] = ("-m", "unmodelled", "diagnose")  # words after `python`
    words: tuple[str, ...] = ()  # further ones, such as a switch
    checkout: Path = ROOT  # working tree whose packages it imports

    @classmethod
    def of(cls, word: str) -> Entrant:
        """Read a name of `METHODS` or `unmodelled`, NAME:SCRIPT.py, or NAME:CHECKOUT[+WORD...].

        The last one is the diagnosis of another working tree.
        """
        name, _, rest = word.partition(":")
        if not rest and name in METHODS:
            return cls(name, ("-m", "benchmarks.withheld.entrants.method", name))
        if not rest and name == "unmodelled":
            return cls(name)
        path, *words = rest.split("+")
        if name.isidentifier() and Path(path).suffix == ".py" and Path(path).is_file():
            return cls(name, (str(Path(path).resolve()),), tuple(words))
        if name.isidentifier() and rest and (Path(path) / "unmodelled").is_dir():
            return cls(name, words=tuple(words), checkout=Path(path).resolve())
        raise BadInput(
            f"entrant: must be unmodelled, {', '.join(METHODS)}, NAME:SCRIPT.py or NAME:CHECKOUT[+WORD...] "
            f"with a working tree, got {word!r}"
        )

    @property
    def revision(self) -> str:
        """Commit of the working tree."""
        call = ["git", "-C", str(self.checkout), "describe", "--always", "--dirty"]
        return subprocess.run(call, capture_output=True, text=True).stdout.strip()

    def run(self, system: Path, logs: Path, out: Path, cap: float) -> Run:
        """Answer in a fresh process of one numerical thread, which is ended after `cap` CPU seconds."""
        words = f"system={system}", f"logs={logs}", f"out={out}", *self.words, "-q"
        call = [sys.executable, *self.program, *words]
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
                # what the process left behind, and the process itself if the bench is interrupted
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
        cpu, wall = used.ru_utime + used.ru_stime, time.monotonic() - start
        unit = 1 if sys.platform == "darwin" else 1024
        error = "" if code == 0 else _reason(code, cpu, wall, cap, log.read_text(errors="replace"))
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


def _reason(code: int, cpu: float, wall: float, cap: float, told: str) -> str:
    if code in (-signal.SIGKILL, -signal.SIGXCPU):  # at the cap, or where there is no memory left
        return f"killed after {cpu:.0f} CPU s and {wall:.0f} s, with a cap of {cap:.0f} CPU s"
    last = (told.strip().splitlines() or ["nothing said"])[-1]
    return printable(f"exit code {code}: {last}"[:300])
