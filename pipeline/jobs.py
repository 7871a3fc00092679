"""Independent jobs in parallel; finished jobs are kept if the run is killed."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable, Collection, Iterator, Mapping
from concurrent.futures import as_completed
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import unmodelled
from unmodelled.base.errors import BadInput
from unmodelled.base.files import hidden, put_folder, read_json, write_json
from unmodelled.base.leftovers import locked
from unmodelled.base.ownership import check_replaceable
from unmodelled.base.progress import Counter
from unmodelled.base.workers import pool_of

IDENTITY = "identity.json"
LIBRARY = Path(unmodelled.__file__).parent


@contextmanager
def growing_folder(path: Path, about: Mapping[str, Any], code: Collection[Path] = ()) -> Iterator[Path]:
    """Yield a hidden folder that becomes `path` if the block succeeds, and that is kept if the run is killed.

    A later call with the same `about` and the same program continues with its files, any other one without.
    """
    growing = hidden(path, "growing")
    identity = {"about": json.loads(json.dumps(about)), "code": _code((LIBRARY, *code))}
    try:
        check_replaceable(path, whole=True)
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
    """Hold a lock on a folder, and refuse one that another run works on."""
    with ExitStack() as stack:
        try:
            stack.enter_context(locked(growing))
        except BlockingIOError:
            raise BadInput(f"{path}: another run is at work on it: wait, or give another out") from None
        yield


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
    """Return the digest of all programs in `folders` and of their JSON files."""
    digest = hashlib.sha256()
    for folder in folders:
        for file in sorted(file for kind in ("*.py", "*.json") for file in folder.rglob(kind)):
            digest.update(file.read_bytes())
    return digest.hexdigest()


def run_jobs(jobs: Mapping[str, Callable[[], object]], workers: int, description: str) -> None:
    """Call all jobs, also if some fail, in worker processes of one thread each.

    A single job, or a single worker, runs in this process.
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
    """Yield the name of each finished job and its exception, or None."""
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
