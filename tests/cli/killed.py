"""Run a verb, and end copies of it by signals at many moments of writing: python -m tests.cli.killed --help

A moment is an operation of the file system below the folder of results. There the process forks a copy of
itself, gives it a copy of the folder, and sends it the signal; then it goes on.
"""

import argparse
import json
import os
import shutil
import signal
import sys
from functools import partial
from pathlib import Path
from typing import Any

from tests.commands import exit_code
from tests.conftest import files_of
from unmodelled.__main__ import PROGRAM
from unmodelled.base import workers
from unmodelled.cli import command_line

#: Events of Python that change the file system.
CHANGES = ("open", "os.rename", "os.mkdir", "os.rmdir", "os.remove", "os.chmod", "os.utime")
SIGNALS = (signal.SIGKILL, signal.SIGINT, signal.SIGTERM)
#: Longest time of a copy, s.
LONGEST = 300


class Server:
    """Counts operations below `place` from the first file that is opened to write, and ends copies there."""

    def __init__(self, place: Path, moments: int) -> None:
        self.place, self.moments = place, moments
        self.active, self.is_copy, self.count = False, False, 0
        self.told, self.total = place.with_name("told"), 0
        self.old: dict[str, bytes] = {}
        self.new: dict[str, bytes] = {}
        self.found: list[dict[str, Any]] = []

    def heed(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Audit hook."""
        if not self.active or event not in CHANGES or not self._is_ours(event, arguments):
            return
        if self.count == 0 and not self.is_copy:
            if event != "open":
                return
            self.active = False
            if (status := self._copied()) is None:  # the first copy goes to the end, to count
                self.active = True
            else:
                assert status == 0, self.told.read_text()
                self.total = int(self.place.with_name("count").read_text())
                self._back()
        self.count += 1
        if not self.is_copy:
            self.active = False
            self._end_copies()
        self.active = True

    def _end_copies(self) -> None:
        """End a copy for every moment that is now."""
        for k in range(self.moments):
            if self.count != 1 + round(k * (self.total - 1) / max(1, self.moments - 1)):
                continue
            number = SIGNALS[k % len(SIGNALS)]
            if (status := self._copied()) is None:
                os.kill(os.getpid(), number)  # raises where it does not kill
                return
            there = files_of(self.place / "out")
            self.found.append(
                {
                    **{"moment": self.count, "signal": number.name, "code": status},
                    **{"is": "old" if there == self.old else "new" if there == self.new else "torn"},
                    **{"beside": sorted(p.name for p in self.place.iterdir()), "said": self.told.read_text()},
                }
            )
            self._back()

    def _copied(self) -> int | None:
        """Exit code of a copy of this process that works on a copy of the files; None in the copy."""
        own = self.place.with_name("own")
        self.place.rename(own)
        shutil.copytree(own, self.place)
        if (copy := os.fork()) > 0:
            status = os.waitstatus_to_exitcode(os.waitpid(copy, 0)[1])
            self.new = self.new or files_of(self.place / "out")
            return status
        self.is_copy = True
        signal.alarm(LONGEST)
        file = os.open(self.told, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(file, 1)
        os.dup2(file, 2)
        return None

    def _back(self) -> None:
        shutil.rmtree(self.place)
        self.place.with_name("own").rename(self.place)

    def _is_ours(self, event: str, arguments: tuple[Any, ...]) -> bool:
        path = arguments[0]
        if event == "open":
            mode, flags = arguments[1] or "", arguments[2] or 0
            if not ({*mode} & {*"wax+"} or flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)):
                return False
        elif isinstance(arguments[-1], int) and arguments[-1] >= 0 and event in ("os.remove", "os.rmdir"):
            return True  # shutil.rmtree, relative to a folder
        return isinstance(path, str | Path) and str(path).startswith(str(self.place))


def call(words: list[str]) -> int:
    """Exit code of a verb."""
    return exit_code(*words, program=partial(command_line.main, PROGRAM))


def main() -> None:
    """Write the old result, then the new one until the server has seen enough."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("place", type=Path, help="folder in which the verb writes the folder out")
    parser.add_argument("moments", type=int, help="how often the verb is ended")
    parser.add_argument("old", type=json.loads, help="words of the command line of the old result, as JSON")
    parser.add_argument("new", type=json.loads, help="the same of the new result")
    given = parser.parse_args()
    workers.limit_threads()
    workers.heed_interruptions()
    os.environ["EXP_PROGRESS"] = "quiet"
    output, sys.stdout = sys.stdout, sys.stderr
    out = f"out={given.place / 'out'}"
    # only a process that leaves afterwards may ignore interruptions
    ignore, workers.ignore_interruptions = workers.ignore_interruptions, lambda: None
    assert call([*given.old, out]) == 0
    workers.ignore_interruptions = ignore
    server = Server(given.place, given.moments)
    server.old = files_of(given.place / "out")
    sys.addaudithook(server.heed)
    server.active = True
    code = call([*given.new, out])
    server.active = False
    if server.is_copy:
        given.place.with_name("count").write_text(str(server.count))
        workers.leave(code)
    assert code == 0 and server.found, "nothing was written"
    equal = server.new == server.old
    print(json.dumps({"operations": server.total, "equal": equal, "found": server.found}), file=output)


if __name__ == "__main__":
    main()
