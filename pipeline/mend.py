"""Repair what a killed `dvc repro` left behind: python -m pipeline.mend

DVC writes its lock files in place, so that a kill can leave an incomplete file, and trusts the name of every
file in its cache without reading it. Only the layout that DVC documents is used here.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import psutil
import yaml

from unmodelled.base.ownership import ON_ITS_WAY
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

    Args:
        root: folder of the checkout.

    Raises:
        OSError: when a file cannot be read or removed.
    """
    if not (root / ".dvc" / "tmp").is_dir():
        return []
    return [*_files_of_dvc(root), *_cache(root), *_leftovers(root)]


def _files_of_dvc(root: Path) -> Iterator[str]:
    lock, used = root / "dvc.lock", root / ".dvc" / "tmp" / "rwlock"
    if _stays_partial(lock, _is_lock):
        aside = lock.with_name(f"{lock.name}.damaged.tmp")
        lock.replace(aside)
        yield f"{lock}: was not written to its end; kept as {aside.name}, a new one is made"
    if _stays_partial(used, lambda text: bool(json.loads(text) is not None)):
        used.unlink()
        yield f"{used}: was not written to its end and is removed"
    elif used.exists() and not any(map(_is_at_work, set(_PROCESS.findall(used.read_text())))):
        used.unlink()


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
    while path.exists():
        text = path.read_text(errors="replace")
        try:
            if is_whole(text):
                return False
        except (ValueError, yaml.YAMLError):
            pass
        if text == before:
            return True
        before = text
        time.sleep(PAUSE)
    return False


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
