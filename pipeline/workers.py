"""Processes that work for this one: of one thread each, and at an end when it ends, however that is."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, get_start_method, parent_process
from multiprocessing.connection import wait

#: What numerical libraries read when they are loaded: how many threads they may use.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@contextmanager
def pool_of(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Processes as the program has chosen to start them (`multiprocessing.set_start_method`).

    Without a choice they load their libraries anew: a fork of a process has none of its threads, and may wait
    for them.
    """
    context = get_context(get_start_method(allow_none=True) or "spawn")
    with _single_threaded(), ProcessPoolExecutor(workers, context, _watch_parent) as pool:
        yield pool


def _watch_parent() -> None:
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os.kill(os.getpid(), signal.SIGKILL)


@contextmanager
def _single_threaded() -> Iterator[None]:
    """Processes that are started in the block use one thread."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name)
            else:
                os.environ[name] = value
