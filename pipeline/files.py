"""Writing results so that a killed run never leaves half a file behind."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from pipeline.errors import BadInput

#: What Hydra writes about a run of a sweep into the run's folder.
RECORD = ".hydra"


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary file name beside `path`; rename it to `path` if the block succeeds.

    Raises:
        BadInput: when the disk is full or the folder cannot be written; `path` keeps its old content.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise BadInput(_explained(error, path, temporary)) from error
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """Yield an empty temporary folder beside `path`; it takes the place of `path` if the block succeeds.

    A `RECORD` in `path` stays.

    Raises:
        BadInput: when the disk is full or the folder cannot be written; `path` keeps its old content.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        temporary.mkdir(parents=True)
        yield temporary
        if path.exists():
            if (path / RECORD).exists():
                (path / RECORD).replace(temporary / RECORD)
            shutil.rmtree(path)
        temporary.replace(path)
    except OSError as error:
        raise BadInput(_explained(error, path, temporary)) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def check_replaceable(path: Path, ours: Collection[str]) -> None:
    """Refuse to replace a folder in which something else lies: naming the wrong one loses nobody's logs.

    Args:
        ours: names of files and folders that may be replaced, * for any characters.

    Raises:
        BadInput: when `path` holds anything else, or cannot be a folder.
    """
    try:
        if path.name in ("", "..") or path.is_symlink():
            raise BadInput(f"{path}: is replaced as a whole: give a folder its own name, and no link")
        there = next(p for p in (path, *path.absolute().parents) if p.exists())
        names = sorted(p.name for p in path.iterdir()) if path.is_dir() else []
    except OSError as error:
        raise BadInput(f"{path}: cannot be written: {error.strerror}") from None
    if not there.is_dir():
        raise BadInput(f"{there}: is a file, so that the folder {path} cannot be written")
    if not os.access(there, os.W_OK):
        raise BadInput(f"{there}: cannot be written: no permission")
    for name in names:
        if not any(fnmatchcase(name, pattern) for pattern in (*ours, RECORD)):
            raise BadInput(f"{path}: is replaced as a whole, but holds {name!r}: choose another folder")


def _explained(error: OSError, path: Path, temporary: Path) -> str:
    """One line on what could not be written, or, if the block was reading, on what could not be read."""
    reason = error.strerror or str(error)
    if error.filename and not str(error.filename).startswith(str(temporary)):
        return f"{error.filename}: {reason}"
    return f"{path}: cannot be written: {reason}"


def write_json(path: Path, content: Any) -> None:
    """Write `content` as indented JSON with sorted keys, so that two equal results are equal files."""
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1, sort_keys=True, allow_nan=False) + "\n")


def read_json(path: Path) -> Any:
    """Read a JSON file.

    Raises:
        BadInput: when the file is missing or is not JSON.
    """
    try:
        return json.loads(path.read_text())
    except FileNotFoundError:
        raise BadInput(f"{path}: no such file") from None
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise BadInput(f"{path}: not a JSON file ({error})") from None
