"""Worker threads and processes that end when this process ends or is interrupted."""

from __future__ import annotations

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
#: Environment variable with which a new Python does not look for modules in its working folder, where files
#: of a stranger may lie beside logs.
SAFE_PATH = {"PYTHONSAFEPATH": "1"}
#: Signals that end a program: Ctrl-C, and the request of `kill`, `timeout`, a container or a cluster.
SIGNALS = (signal.SIGINT, signal.SIGTERM)
#: Message of a program that one of them ended.
INTERRUPTION = "interrupted: what was not finished is not written; the same command starts it again"
#: Whether one of them came: a library may make another exception of KeyboardInterrupt.
interrupted = threading.Event()
#: The last one that came.
_ended_by: int = signal.SIGINT
#: Says nothing of semaphores that a process has left behind; the tracker removes them all the same.
_LEFT_BEHIND = "ignore:resource_tracker:UserWarning"
#: Seconds until an interruption that could not be raised is tried again.
_LATER = 0.05


class _Processes(ProcessPoolExecutor):
    """Pool of processes that ignore Ctrl-C: the process that they work for handles it."""

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        # a process that is started here keeps the mask
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return super().submit(function, *args, **kwargs)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def pool_of(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool of worker processes, each of which uses one thread for numerics.

    The start method is the one chosen by `multiprocessing.set_start_method`, otherwise "spawn": a forked
    process has none of the threads of its parent and may wait for them forever.
    """
    context = get_context(get_start_method(allow_none=True) or "spawn")
    with _environment(**SAFE_PATH, PYTHONWARNINGS=_warnings()):
        resource_tracker.ensure_running()  # would undo the mask of the first process
    with (
        _environment(**SAFE_PATH, **dict.fromkeys(THREADS, "1")),
        _ended(_Processes(workers, context, _watch_parent), waits=True) as pool,
    ):
        yield pool


@contextmanager
def threads_of(workers: int) -> Iterator[ThreadPoolExecutor]:
    """Yield a pool of threads of this process."""
    with _ended(ThreadPoolExecutor(workers), waits=False) as pool:
        yield pool


@contextmanager
def _ended(pool: T, waits: bool) -> Iterator[T]:
    """Wait for all submitted jobs; after an interruption kill processes and do not wait for threads."""
    try:
        yield pool
    except KeyboardInterrupt:
        for process in active_children():
            process.kill()
        pool.shutdown(wait=waits, cancel_futures=True)
        raise
    finally:
        pool.shutdown(wait=not interrupted.is_set() or waits)


def limit_threads() -> None:
    """Limit numerical libraries that are not loaded yet to one thread each, unless the user has set a number.

    Matrices here are so small that threads mostly wait for each other.
    """
    for library in NUMERICAL:
        os.environ.setdefault(library, "1")


def _interrupt(number: int, _: object) -> NoReturn:
    global _ended_by
    if interrupted.is_set():
        os._exit(128 + number)
    _ended_by = number
    interrupted.set()
    threading.excepthook = lambda _: None  # what is cut off in the middle has nothing to say
    raise KeyboardInterrupt


def heed_interruptions() -> None:
    """Let the first Ctrl-C or SIGTERM raise KeyboardInterrupt, and the second one end the process."""

    def again(about: sys.UnraisableHookArgs) -> None:
        if not issubclass(about.exc_type, KeyboardInterrupt):
            if not interrupted.is_set():
                sys.__unraisablehook__(about)
            return
        # where nothing can be raised, as in a destructor: a little later
        interrupted.clear()
        threading.Timer(_LATER, os.kill, (os.getpid(), _ended_by)).start()

    sys.unraisablehook = again
    for number in SIGNALS:
        signal.signal(number, _interrupt)


def exit_code() -> int:
    """Return the exit code of this process after an interruption, as shells count: 128 and the signal."""
    return 128 + _ended_by


def ignore_interruptions() -> None:
    """Let Ctrl-C and SIGTERM do nothing from now on, because all results are written.

    Python itself would end by the signal, not by the exit code, if one came while it shuts down.
    """
    for number in SIGNALS:
        if signal.getsignal(number) is _interrupt:
            signal.signal(number, signal.SIG_IGN)


def leave(code: int) -> NoReturn:
    """End this process; after an interruption at once.

    Then threads are not waited for. Python would also end by the signal, not by the exit code, if the
    interruption came within the `exec` of a string, which makes every dataclass.
    """
    ignore_interruptions()
    if code in [128 + number for number in SIGNALS]:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    sys.exit(code)


def _watch_parent() -> None:
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os.kill(os.getpid(), signal.SIGKILL)


def _warnings() -> str:
    """Warnings of the user, and none of Python's tracker of semaphores, which outlives an interruption."""
    given = os.environ.get("PYTHONWARNINGS", "")
    return f"{given},{_LEFT_BEHIND}" if given else _LEFT_BEHIND


@contextmanager
def _environment(**values: str) -> Iterator[None]:
    """Give environment variables to processes that are started in the block."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name)
            else:
                os.environ[name] = value
