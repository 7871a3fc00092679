"""Put right what a killed `dvc repro` left, so that the next one needs no help: python -m pipeline.mend

DVC rewrites its lock files in place, so that a kill can leave half of one, and takes every file of its cache
for what its name says without looking.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import re
import shutil
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import psutil

from unmodelled.base.ownership import ON_ITS_WAY
from unmodelled.base.progress import track

#: What stages write.
RESULTS = ("data", "reports")
_OBJECT = re.compile(r"[0-9a-f]{30}(?:\.dir)?")


def mend(root: Path) -> list[str]:
    """Put right the checkout `root` and say what, a line each; nothing while DVC holds its lock.

    - Locks of processes that are gone are removed.
    - Half a dvc.lock is put aside: the next `dvc repro` writes it anew from what it knows of earlier runs.
    - A damaged file of the cache is removed: the next `dvc repro` makes it again.
    - What a killed stage was writing is removed, unless the stage goes on from there.
    """
    temporary = root / ".dvc" / "tmp"
    if not temporary.is_dir():
        return []
    with (temporary / "lock").open("a") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return []
        _release(temporary / "rwlock")
        state = [*_state(root / "dvc.lock")]
    return [*state, *_cache(root), *_leftovers(root)]


def _release(path: Path) -> None:
    if path.exists() and not _at_work(path.read_bytes()):
        path.unlink()


def _at_work(content: bytes) -> bool:
    """Whether a DVC that is still running has written any of the locks."""
    try:
        written = json.loads(content)
        shared = (lock for locks in written.get("read", {}).values() for lock in locks)
        locks = [*written.get("write", {}).values(), *shared]
        return any(_is_dvc(int(lock["pid"])) for lock in locks)
    except (ValueError, TypeError, AttributeError, LookupError):
        return False


def _is_dvc(process: int) -> bool:
    try:
        return any("dvc" in word for word in psutil.Process(process).cmdline())
    except psutil.Error:
        return False


def _state(path: Path) -> Iterator[str]:
    from dvc.schema import COMPILED_LOCKFILE_SCHEMA
    from dvc.utils.serialize import ParseError, load_yaml
    from voluptuous import Invalid

    if not path.exists():
        return
    try:
        COMPILED_LOCKFILE_SCHEMA(load_yaml(path))
    except (ParseError, Invalid):
        aside = path.with_name(f"{path.name}.damaged.tmp")
        path.replace(aside)
        yield f"{path}: was not written to its end; kept as {aside.name}, a new one is made"


def _cache(root: Path) -> Iterator[str]:
    folder = root / ".dvc" / "cache" / "files" / "md5"
    objects = [path for path in folder.glob("[0-9a-f][0-9a-f]/*") if _OBJECT.fullmatch(path.name)]
    with ThreadPoolExecutor() as pool:
        whole = track(pool.map(_is_whole, objects), len(objects), "checking the cache of DVC")
        damaged = {path: path.stat().st_size for path, fine in zip(objects, whole, strict=True) if not fine}
    for path in (path for name in RESULTS for path in (root / name).rglob("*") if damaged):
        # it may be a link to what is damaged, or a copy of it: a new time makes DVC look
        if path.is_file() and path.stat().st_size in damaged.values():
            os.utime(path)
    for path in damaged:
        path.unlink()
        yield f"{path}: was damaged and is removed; what needs it is made again"


def _is_whole(path: Path) -> bool:
    with path.open("rb") as file:
        found = hashlib.file_digest(file, lambda: hashlib.md5(usedforsecurity=False)).hexdigest()
    return found == path.parent.name + path.name.removesuffix(".dir")


def _leftovers(root: Path) -> Iterator[str]:
    for path in (path for folder in RESULTS for path in (root / folder).rglob(".*.tmp")):
        found = ON_ITS_WAY.fullmatch(path.name)
        if found and not psutil.pid_exists(int(found.group(2))):
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)
            yield f"{path}: was left by a run that was killed and is removed"


def main() -> int:
    """Mend the working directory; an exit code."""
    try:
        done = mend(Path.cwd())
    except OSError as error:
        print(f"error: {error.filename}: cannot be mended: {error.strerror}", file=sys.stderr)
        return 2
    for line in done:
        print(line, file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
