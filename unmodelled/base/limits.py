"""Limits on what is read: regular files whose content fits into the free memory, checked before reading."""

from __future__ import annotations

import os
import resource
import signal
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import psutil

from unmodelled.base.errors import BadInput

#: What is read may take one part in so many of the memory that is left. It is copied once when it becomes
#: arrays and once when it is put on a uniform clock, and half of the memory is for the work itself.
PARTS = 4
#: Bytes that may be read however little memory is left; the libraries alone take a hundred times as much.
ALWAYS = 4_000_000
#: Bytes in memory per byte of a text, at most: cells of one character as a list of lists, or nested JSON
#: lists, in CPython 3.11.
OBJECTS = 100
#: Bytes in memory per byte of a text that becomes an array of numbers: eight for two characters.
NUMBERS = 4
#: Time on the clock that a limited process may take, in processor times: others use the machine, and what
#: waits for a pipe uses no processor.
WAITING = 4.0

#: Where control groups (cgroups) of either version are mounted, and the group of this process is named.
_GROUPS, _OWN = Path("/sys/fs/cgroup"), Path("/proc/self/cgroup")
_KINDS = {
    stat.S_IFIFO: "a named pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def check_file(path: Path, factor: float = 1.0) -> None:
    """Refuse a file that is endless or too large for the free memory; opening a missing one tells more."""
    try:
        about = path.stat()
    except (OSError, ValueError):
        return
    kind = _KINDS.get(stat.S_IFMT(about.st_mode))
    if kind is None and stat.S_ISREG(about.st_mode) and _of_kernel(path):
        kind = "made by the kernel"
    if kind:
        raise BadInput(f"{path}: is {kind}, not a regular file: copy what it gives into a file")
    if stat.S_ISREG(about.st_mode):
        check_memory(path, factor * about.st_size)


def _of_kernel(path: Path) -> bool:
    """Whether a file is on no disk: the kernel makes its content when it is read, or lets the reader wait."""
    return any(Path(os.path.realpath(path)).is_relative_to(place) for place in ("/proc", "/sys"))


def check_memory(what: Path | str, needed: float) -> None:
    """Refuse content that takes more than a quarter of the free memory."""
    if not fits(needed):
        left = available()
        raise BadInput(
            f"{what}: is too large: would take {_shown(needed)} of memory, {_shown(left)} are free and "
            f"{_shown(_allowed(left))} of them the most for it: give fewer rows or experiments, or free some "
            "memory"
        )


def check_address_space(needed: float) -> None:
    """Refuse to go on where less address space is left: libraries written in C end the process without it."""
    left = _left_to_process()
    if resource.getrlimit(resource.RLIMIT_AS)[0] != resource.RLIM_INFINITY and left < needed:
        raise BadInput(
            f"the limit on the address space of this process leaves {_shown(left)}, and {_shown(needed)} are "
            "needed: raise the limit (ulimit -v)"
        )


def fits(needed: float) -> bool:
    """Return whether content takes at most a quarter of the free memory, or 4 MB."""
    return needed <= ALWAYS or needed <= _allowed(available())


@contextmanager
def limited_process(seconds: float) -> Iterator[None]:
    """Limit the memory of this process to what `check_memory` allows, and the time of a block.

    Meant for a worker process that reads files. Beyond the memory Python raises MemoryError; at the end of
    the time the process ends.
    """
    _limit_memory()
    limit_time(seconds)
    try:
        yield
    finally:
        limit_time(0.0)


def limit_time(seconds: float) -> None:
    """End this process after some processor time, and after `WAITING` times as long on the clock."""
    signal.setitimer(signal.ITIMER_PROF, seconds)
    signal.setitimer(signal.ITIMER_REAL, WAITING * seconds)


@cache  # once: a second time it would leave a part of the part
def _limit_memory() -> None:
    most = int(psutil.Process().memory_info().vms + _allowed(available()))
    resource.setrlimit(resource.RLIMIT_AS, (most, resource.getrlimit(resource.RLIMIT_AS)[1]))


def _allowed(left: int) -> float:
    return max(float(ALWAYS), (left - int(psutil.Process().memory_info().rss)) / PARTS)


def available() -> int:
    """Return the memory that this process can still take, in bytes.

    The smallest value counts: of the machine, of the control groups (Linux) or of the process limit.
    """
    return max(0, min(int(psutil.virtual_memory().available), *_left_in_groups(), _left_to_process()))


def _left_to_process() -> int:
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit == resource.RLIM_INFINITY:
        return int(psutil.virtual_memory().total)
    return limit - int(psutil.Process().memory_info().vms)


def _left_in_groups() -> Iterator[int]:
    """Yield the free memory of each control group of this process, in bytes; cached files count as free."""
    try:
        lines = [line.split(":", 2) for line in _OWN.read_text().splitlines()]
    except OSError:  # no Linux
        lines = []
    yield int(psutil.virtual_memory().total)
    for _, controllers, own in lines:
        if controllers == "":
            root, names, cached = _GROUPS, ("memory.max", "memory.current"), ("inactive_file", "active_file")
        elif controllers == "memory":
            root, names = _GROUPS / "memory", ("memory.limit_in_bytes", "memory.usage_in_bytes")
            cached = ("total_inactive_file", "total_active_file")
        else:
            continue
        group = root / own.strip("/")
        for folder in (group, *group.parents):
            if not folder.is_relative_to(root):
                break
            try:
                limit, used = ((folder / name).read_text().strip() for name in names)
                kept = dict(line.split() for line in (folder / "memory.stat").read_text().splitlines())
            except (OSError, ValueError):  # the outermost group has no limit
                continue
            if limit != "max":
                yield int(limit) - int(used) + sum(int(kept.get(name, 0)) for name in cached)


def _shown(size: float) -> str:
    return f"{size / 1e9:.3g} GB" if size >= 1e8 else f"{size / 1e6:.3g} MB"
