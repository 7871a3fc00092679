"""Progress of long work: bars on a terminal, occasional lines elsewhere; quiet or verbose on request."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from multiprocessing import parent_process
from typing import TYPE_CHECKING, Literal, TypeVar

if TYPE_CHECKING:
    from rich.progress import Progress

T = TypeVar("T")
Mode = Literal["quiet", "plain", "rich", "verbose"]

#: Says how much is shown: quiet (nothing), plain (lines, also on a terminal), verbose (a line every second).
VARIABLE = "EXP_PROGRESS"
#: Seconds of work before a bar or a first plain line is shown.
SOON, FIRST = 0.5, 5.0
#: Seconds between two plain lines, and between two that are verbose.
INTERVAL, OFTEN = 15.0, 1.0

_SILENT = ContextVar("silent", default=False)


def mode() -> Mode:
    """Return how progress is shown, from the environment variable EXP_PROGRESS and the kind of terminal."""
    chosen = "quiet" if _SILENT.get() else os.environ.get(VARIABLE, "")
    if parent_process() is not None or chosen == "quiet":
        return "quiet"
    if chosen == "verbose":
        return "verbose"
    return "rich" if sys.stderr.isatty() and chosen != "plain" else "plain"


@contextmanager
def silence() -> Iterator[None]:
    """Show no progress in this thread while the context is open."""
    token = _SILENT.set(True)
    try:
        yield
    finally:
        _SILENT.reset(token)


def say(what: str) -> None:
    """Print the current step on standard error, unless progress is quiet."""
    if mode() != "quiet":
        _print(f"{what} ...")


class Counter:
    """Progress of some work with its remaining time; a nested counter is shown below the outer one."""

    def __init__(self, total: int, description: str) -> None:
        self.total, self.description = total, description
        self._mode = mode()
        self._start = time.monotonic()
        self._next = self._start + {"rich": SOON, "verbose": OFTEN}.get(self._mode, FIRST)
        self._task: int | None = None

    def __enter__(self) -> Counter:
        return self

    def __exit__(self, *_: object) -> None:
        if self._task is not None:
            _Bars.remove(self._task)

    def update(self, done: int) -> None:
        """Show a new number of finished items."""
        now = time.monotonic()
        if self._task is not None:
            _Bars.update(self._task, done)
        elif self._mode != "quiet" and now >= self._next and done > 0:
            if self._mode == "rich":
                self._task = _Bars.add(self.total, self.description, done)
                return
            self._next = now + (OFTEN if self._mode == "verbose" else INTERVAL)
            left = (now - self._start) / done * (self.total - done)
            _print(f"{self.description}: {done}/{self.total}, {_shown(left)} left")


def track(items: Iterable[T], total: int, description: str) -> Iterator[T]:
    """Iterate over items and show the progress."""
    with Counter(total, description) as counter:
        for done, item in enumerate(items, start=1):
            yield item
            counter.update(done)


class _Bars:
    """Shared display of all active counters: a terminal can show one display at a time."""

    shown: Progress | None = None
    count = 0

    @classmethod
    def add(cls, total: int, description: str, done: int) -> int:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        if cls.shown is None:
            left = TimeRemainingColumn(elapsed_when_finished=True), TextColumn("left")
            columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), *left)
            cls.shown = Progress(*columns, console=Console(stderr=True), transient=True)
            cls.shown.start()
        cls.count += 1
        task = int(cls.shown.add_task(description, total=total, completed=done))
        cls.shown.refresh()
        return task

    @classmethod
    def update(cls, task: int, done: int) -> None:
        if cls.shown is not None:
            cls.shown.update(task, completed=done)  # type: ignore[arg-type]

    @classmethod
    def remove(cls, task: int) -> None:
        cls.count -= 1
        if cls.shown is not None:
            cls.shown.remove_task(task)  # type: ignore[arg-type]
        if cls.shown is not None and cls.count == 0:
            cls.shown.stop()
            cls.shown = None


def _print(line: str) -> None:
    if _Bars.shown is not None:
        _Bars.shown.console.print(line, markup=False, highlight=False)
    else:
        print(line, file=sys.stderr, flush=True)


def _shown(seconds: float) -> str:
    """Return a duration as text.

    Examples:
        >>> _shown(41.7), _shown(95), _shown(8000)
        ('42 s', '1 min 35 s', '2 h 13 min')
    """
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
