"""Many independent jobs side by side; those that are done survive a kill."""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import shutil
from collections.abc import Callable, Collection, Iterator, Mapping
from concurrent.futures import as_completed
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from unmodelled.base.errors import BadInput
from unmodelled.base.files import hidden, put_folder, read_json, write_json
from unmodelled.base.ownership import check_replaceable
from unmodelled.base.progress import Counter
from unmodelled.base.workers import pool_of

IDENTITY = "identity.json"
LIBRARY = Path(__file__).parents[1]


@contextmanager
def growing_folder(path: Path, about: Mapping[str, Any], code: Collection[Path] = ()) -> Iterator[Path]:
    """Yield a hidden folder beside `path` that takes the place of `path` if the block succeeds.

    Unlike with `replacing_folder`, what a block that was killed had written is still there the next time, as
    long as `about`, which must name everything that decides the result, and the program are the same.

    Args:
        path: of the folder. about: what decides the result. code: folders of programs that decide it beside
            this library.

    Raises:
        BadInput: when the folder cannot be written, another run is at work on it, or it holds what another
            verb or none wrote.
    """
    growing = hidden(path, "growing")
    identity = {"about": json.loads(json.dumps(about)), "code": _code((LIBRARY, *code))}
    try:
        check_replaceable(path)
        growing.mkdir(parents=True, exist_ok=True)
        with _alone(growing, path):
            if not _same(growing / IDENTITY, identity):
                _empty(growing)
                write_json(growing / IDENTITY, identity)
            yield growing
            (growing / IDENTITY).unlink()
            put_folder(growing, path)
    except OSError as error:
        raise BadInput(f"{path}: cannot be written: {error.strerror or error}") from error


@contextmanager
def _alone(growing: Path, path: Path) -> Iterator[None]:
    """Hold a lock on a folder, which the system takes back when the process is killed."""
    folder = os.open(growing, os.O_RDONLY)
    try:
        try:
            fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise BadInput(f"{path}: another run is at work on it: wait, or give another out") from None
        yield
    finally:
        os.close(folder)


def _empty(folder: Path) -> None:
    for path in folder.iterdir():
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()


def _same(file: Path, identity: Mapping[str, Any]) -> bool:
    try:
        return bool(read_json(file) == identity)
    except BadInput:
        return False


def _code(folders: Collection[Path]) -> str:
    """Digest of the programs in `folders` and of the numbers that they ship with."""
    digest = hashlib.sha256()
    for folder in folders:
        for file in sorted(file for kind in ("*.py", "*.json") for file in folder.rglob(kind)):
            digest.update(file.read_bytes())
    return digest.hexdigest()


def run_jobs(jobs: Mapping[str, Callable[[], object]], workers: int, description: str) -> None:
    """Call all of `jobs`, in processes of one thread each; one job, or with one worker, in this process.

    A job that fails does not keep the others from being done.

    Args:
        jobs: by name, functions of a module with their arguments (`functools.partial`).

    Raises:
        Exception: that of the first job that failed, with its name as a note.
    """
    failed: list[Exception] = []
    with Counter(len(jobs), description) as counter:
        for done, (name, error) in enumerate(_done(jobs, min(workers, len(jobs))), start=1):
            counter.update(done)
            if error is not None:
                error.add_note(f"in {name}")
                failed.append(error)
    if failed:
        raise failed[0]


def _done(jobs: Mapping[str, Callable[[], object]], workers: int) -> Iterator[tuple[str, Exception | None]]:
    """Names of jobs as they are finished, and what went wrong."""
    if workers < 2:
        for name, job in jobs.items():
            yield name, _error(job)
        return
    with pool_of(workers) as pool:
        running = {pool.submit(job): name for name, job in jobs.items()}
        for future in as_completed(running):
            yield running[future], _error(future.result)


def _error(job: Callable[[], object]) -> Exception | None:
    try:
        job()
    except Exception as error:
        return error
    return None
