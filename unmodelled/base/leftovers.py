"""Locks of hidden folders: one that no process holds was left by a killed run, and goes."""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil

from unmodelled.base.markers import ON_ITS_WAY


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold a lock on a file or folder; the operating system releases it if the process is killed."""
    opened = os.open(path, os.O_RDONLY)
    try:
        fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    finally:
        os.close(opened)


def remove_leftovers(path: Path) -> None:
    """Remove the hidden folders that killed runs left beside the folder `path` (`files.replacing_folder`)."""
    with suppress(OSError):
        for found in path.parent.iterdir():
            match = ON_ITS_WAY.fullmatch(found.name)
            if match and match[1] == path.name:
                remove_abandoned(found)


def remove_abandoned(path: Path) -> bool:
    """Remove an unfinished result whose process is gone, and return whether that was so.

    A folder is also locked while it is written: in a container, equal numbers name different processes.
    """
    match = ON_ITS_WAY.fullmatch(path.name)
    writer = int(match[2]) if match else os.getpid()
    try:
        is_file = path.is_symlink() or not path.is_dir()
        if (is_file or writer != os.getpid()) and psutil.pid_exists(writer):
            return False
        if is_file:
            path.unlink()
            return True
        with locked(path):
            if not path.is_dir():  # another process was faster
                return False
            shutil.rmtree(path, ignore_errors=True)
    except OSError:  # at work, or gone already
        return False
    return True
