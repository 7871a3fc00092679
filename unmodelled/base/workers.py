"""Threads and processes that work for this one, and end when it ends or is interrupted, however that is."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context, get_start_method, parent_process, resource_tracker
from multiprocessing.connection import wait
from typing import Any, NoReturn, TypeVar

T = TypeVar("T", bound=Executor)

#: Environment variables that numerical libraries read when they are loaded: how many threads they may use.
NUMERICAL = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
#: The same for processes that work side by side: numba, too, uses one.
THREADS = (*NUMERICAL, "NUMBA_NUM_THREADS")
#: Exit code of a program that Ctrl-C ended, as shells count: 128 and the number of the signal.
INTERRUPTED = 128 + signal.SIGINT
#: Whether Ctrl-C was pressed: a library may make another exception of KeyboardInterrupt.
interrupted = threading.Event()
#: Seconds until an interruption that could not be raised is tried again.
_LATER = 0.05
#: Of Linux's prctl: choose the signal that a process gets when its parent ends (sys/prctl.h).
_PR_SET_PDEATHSIG = 1


class _Processes(ProcessPoolExecutor):
    """Processes that Ctrl-C does not reach: it is for the process that they work for."""

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        # a process that is started here keeps the mask
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return super().submit(function, *args, **kwargs)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def pool_of(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Processes as the program has chosen to start them (`multiprocessing.set_start_method`).

    Without a choice they load their libraries anew: a fork of a process has none of its threads, and may wait
    for them.
    """
    context = get_context(get_start_method(allow_none=True) or "spawn")
    resource_tracker.ensure_running()  # would undo the mask of the first process
    with _single_threaded(), _ended(_Processes(workers, context, _watch_parent), waits=True) as pool:
        yield pool


@contextmanager
def threads_of(workers: int) -> Iterator[ThreadPoolExecutor]:
    """Threads of this process."""
    with _ended(ThreadPoolExecutor(workers), waits=False) as pool:
        yield pool


@contextmanager
def _ended(pool: T, waits: bool) -> Iterator[T]:
    """Wait for all that was submitted; after an interruption kill processes, and do not wait for threads."""
    try:
        yield pool
    except KeyboardInterrupt:
        for process in active_children():
            process.kill()
        pool.shutdown(wait=waits, cancel_futures=True)
        raise
    finally:
        pool.shutdown(wait=not interrupted.is_set() or waits)


def one_thread() -> None:
    """Give numerical libraries one thread unless the user says otherwise; they read it when they are loaded.

    Matrices here are so small that threads wait for each other, beside another process most of the time.
    Work that profits from cores has processes.
    """
    for library in NUMERICAL:
        os.environ.setdefault(library, "1")


def heed_interruptions() -> None:
    """Let Ctrl-C raise KeyboardInterrupt in this process, and a second one end it at once."""

    def interrupt(*_: object) -> NoReturn:
        if interrupted.is_set():
            os._exit(INTERRUPTED)
        interrupted.set()
        threading.excepthook = lambda _: None  # what is cut off in the middle has nothing to say
        raise KeyboardInterrupt

    def again(about: sys.UnraisableHookArgs) -> None:
        if not issubclass(about.exc_type, KeyboardInterrupt):
            if not interrupted.is_set():
                sys.__unraisablehook__(about)
            return
        # where nothing can be raised, as in a destructor: a little later
        interrupted.clear()
        threading.Timer(_LATER, os.kill, (os.getpid(), signal.SIGINT)).start()

    sys.unraisablehook = again
    signal.signal(signal.SIGINT, interrupt)


def leave(code: int) -> NoReturn:
    """End this process; after an interruption at once.

    Then threads are not waited for. Python would also end by the signal, not by the exit code, if the
    interruption came within the `exec` of a string, which makes every dataclass.
    """
    if code == INTERRUPTED:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    sys.exit(code)


def end_with_parent(number: int) -> None:
    """Let Linux send the signal `number` to this process when its parent ends; elsewhere nothing is done."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, number)


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
