"""A progress bar on long work: rich on a terminal, a plain line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator
from types import TracebackType
from typing import TypeVar

T = TypeVar("T")

#: Seconds between two plain lines when the output is not a terminal.
INTERVAL = 15.0


class Counter:
    """Shows how far a piece of work got and how long it still takes.

    Args:
        total: number of items. description: what is being done.
    """

    def __init__(self, total: int, description: str) -> None:
        self.total, self.description = total, description
        self._start = self._last = time.monotonic()
        self._bar = None
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import Progress

            self._bar = Progress(console=Console(stderr=True), transient=True)
            self._task = self._bar.add_task(description, total=total)

    def __enter__(self) -> Counter:
        if self._bar:
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar:
            self._bar.stop()

    def update(self, done: int) -> None:
        """Say that `done` items are finished."""
        now = time.monotonic()
        if self._bar:
            self._bar.update(self._task, completed=done)
        elif now - self._last > INTERVAL:
            self._last, left = now, (now - self._start) / done * (self.total - done)
            print(f"{self.description}: {done}/{self.total}, {left:.0f} s left", file=sys.stderr, flush=True)


def track(items: Iterable[T], total: int, description: str) -> Iterator[T]:
    """Iterate over `items` with a progress bar."""
    with Counter(total, description) as counter:
        for done, item in enumerate(items, start=1):
            yield item
            counter.update(done)
