"""Repair what a killed `dvc repro` left behind: python -m pipeline.mend

DVC writes its lock files in place, so that a kill can leave an incomplete file, and trusts the name of every
file in its cache without reading it. Only the layout that DVC documents is used here.
"""

import fcntl
import hashlib
import json
import os
import re
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import psutil
import yaml

from unmodelled.base.leftovers import remove_abandoned
from unmodelled.base.markers import ON_ITS_WAY
from unmodelled.base.progress import track

#: Folders of results.
RESULTS = ("data", "reports")
#: Longest pause while DVC writes a file, s: one that has been incomplete for longer stays so.
PAUSE = 3.0
#: A process in DVC's list of files in use.
_PROCESS = re.compile(r'"pid": (\d+)')
_OBJECT = re.compile(r"[0-9a-f]{30}(?:\.dir)?")


def mend(root: Path) -> list[str]:
    """Repair a checkout in which DVC may be at work, and return a line for every repair.

    - A part of dvc.lock is put aside: the next `dvc repro` writes the file anew from its cache of runs.
    - DVC's list of files in use is removed where it is a part of one, or where no process in it is at work:
      DVC takes a killed process that is not yet reaped, and another program with its number, for one that is.
    - A damaged file of the cache is removed: the next `dvc repro` makes it again.
    - An unfinished result of a process that is gone is removed, unless its stage goes on from there.

    Another run may mend the same checkout, and DVC may write it: only what was judged is removed.
    """
    if not (root / ".dvc" / "tmp").is_dir():
        return []
    return [*_files_of_dvc(root), *_cache(root), *_leftovers(root)]


def _files_of_dvc(root: Path) -> Iterator[str]:
    lock = root / "dvc.lock"
    if _stays_partial(lock, _is_lock):
        aside = lock.with_name(f"{lock.name}.damaged.tmp")
        with suppress(FileNotFoundError):
            lock.replace(aside)
            yield f"{lock}: was not written to its end; kept as {aside.name}, a new one is made"
    with _dvc_waits(root), suppress(FileNotFoundError):
        yield from _list_of_files_in_use(root / ".dvc" / "tmp" / "rwlock")


def _list_of_files_in_use(used: Path) -> Iterator[str]:
    text = used.read_text(errors="replace")
    try:
        whole = json.loads(text) is not None
    except ValueError:
        whole = False
    if whole and any(map(_is_at_work, set(_PROCESS.findall(text)))):
        return
    used.unlink()
    if not whole:
        yield f"{used}: was not written to its end and is removed"


@contextmanager
def _dvc_waits(root: Path) -> Iterator[None]:
    """Hold the lock under which DVC, and another `mend`, read and write the list of files in use."""
    with (root / ".dvc" / "tmp" / "rwlock.lock").open("a") as guard:
        fcntl.flock(guard, fcntl.LOCK_EX)
        yield


def _is_at_work(process: str) -> bool:
    """Whether a process is one of DVC's and alive."""
    try:
        found = psutil.Process(int(process))
        return found.status() != psutil.STATUS_ZOMBIE and "dvc" in (Path(w).name for w in found.cmdline())
    except psutil.Error:
        return False


def _stays_partial(path: Path, is_whole: Callable[[str], bool]) -> bool:
    """Whether a file is incomplete and nobody is writing it."""
    before = None
    while True:
        try:
            text = path.read_text(errors="replace")
        except FileNotFoundError:
            return False
        try:
            if is_whole(text):
                return False
        except (ValueError, yaml.YAMLError):
            pass
        if text == before:
            return True
        before = text
        time.sleep(PAUSE)


def _is_lock(text: str) -> bool:
    """Whether a dvc.lock has all that DVC needs to read it; what lacks at its end, DVC makes again."""
    content = yaml.load(text, getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    stages = content["stages"] if isinstance(content, dict) and "stages" in content else None
    return isinstance(stages, dict) and all(map(_is_stage, stages.values()))


def _is_stage(stage: Any) -> bool:
    if not isinstance(stage, dict) or not stage.get("cmd"):
        return False
    listed = [stage.get(key, []) for key in ("deps", "outs")]
    return all(isinstance(files, list) and all(map(_is_file, files)) for files in listed)


def _is_file(file: Any) -> bool:
    whole = isinstance(file, dict) and None not in file.values()
    return whole and isinstance(file.get("md5", ""), str)  # its first digits may be those of a number


def _cache(root: Path) -> Iterator[str]:
    folder = root / ".dvc" / "cache" / "files" / "md5"
    objects = [path for path in folder.glob("[0-9a-f][0-9a-f]/*") if _OBJECT.fullmatch(path.name)]
    with ThreadPoolExecutor() as pool:
        sizes = track(pool.map(_damaged_size, objects), len(objects), "checking the cache of DVC")
        damaged = {path: size for path, size in zip(objects, sizes, strict=True) if size is not None}
    for path in _results(root) if damaged else ():
        # it may be a link to what is damaged, or a copy of it: a new time makes DVC look
        with suppress(FileNotFoundError):
            if path.is_file() and path.stat().st_size in damaged.values():
                os.utime(path)
    for path in damaged:
        if _removed_if_damaged(path):
            yield f"{path}: was damaged and is removed; what needs it is made again"


def _results(root: Path) -> Iterator[Path]:
    """Yield files and folders of the results, but for those that another run removes meanwhile."""
    for top in RESULTS:
        for place, folders, files in os.walk(root / top):
            yield from (Path(place, name) for name in (*folders, *files))


def _removed_if_damaged(path: Path) -> bool:
    """Remove a file of the cache, but put it back where another run has made it anew in the meantime."""
    aside = path.with_name(f"{path.name}.{os.getpid()}.damaged.tmp")
    try:
        path.replace(aside)
    except FileNotFoundError:
        return False
    if _digest(aside) == _name(path):
        aside.replace(path)
        return False
    aside.unlink()
    return True


def _damaged_size(path: Path) -> int | None:
    """Size of a file of the cache whose content is not the one of its name; None if it is, or is gone."""
    with suppress(FileNotFoundError):
        return path.stat().st_size if _digest(path) != _name(path) else None
    return None


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.md5(usedforsecurity=False)).hexdigest()


def _name(path: Path) -> str:
    return path.parent.name + path.name.removesuffix(".dir")


def _leftovers(root: Path) -> Iterator[str]:
    for path in _results(root):
        if ON_ITS_WAY.fullmatch(path.name) and remove_abandoned(path):
            yield f"{path}: was left by a run that was killed and is removed"


def main() -> int:
    """Mend the working directory; return the exit code."""
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
