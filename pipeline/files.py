"""Writing results so that a killed run never leaves half a file behind."""

from __future__ import annotations

import errno
import json
import math
import os
import re
import shutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from fnmatch import fnmatchcase
from pathlib import Path
from secrets import token_hex
from typing import Any

from pipeline.errors import BadInput

#: Name of a result, and of the process that is writing it, in what `hidden` calls it until it is whole.
ON_ITS_WAY = re.compile(r"\.([^/]+)\.(\d+)\.[0-9a-f]{8}\.tmp")
#: What Hydra writes about a run of a sweep into the run's folder.
RECORD = ".hydra"


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary file name beside `path`; rename it to `path` if the block succeeds.

    Raises:
        BadInput: when the disk is full or the folder cannot be written; `path` keeps its old content.
    """
    temporary = _temporary(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise BadInput(_explained(error, path, temporary)) from error
    finally:
        with suppress(OSError):
            temporary.unlink()


@contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """Yield an empty temporary folder beside `path`; it takes the place of `path` if the block succeeds.

    A `RECORD` in `path` stays.

    Raises:
        BadInput: when the disk is full or the folder cannot be written; `path` keeps its old content.
    """
    temporary = _temporary(path)
    try:
        temporary.mkdir(parents=True)
        yield temporary
        put_folder(temporary, path)
    except OSError as error:
        raise BadInput(_explained(error, path, temporary)) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def put_folder(new: Path, path: Path) -> None:
    """Give the folder `new`, which lies beside it, the name `path`; a `RECORD` in what was there stays.

    A kill at any moment leaves under `path` all of the old folder, or all of the new one, or nothing.

    Raises:
        OSError: when `path` is a file or a link, or cannot be renamed; it then keeps its old content.
    """
    if path.is_symlink() or (path.exists() and not path.is_dir()):
        raise NotADirectoryError(errno.ENOTDIR, "is not a folder", str(path))
    old = _temporary(path)
    with suppress(FileNotFoundError):
        path.replace(old)
    try:
        new.replace(path)
        if (old / RECORD).exists():
            (old / RECORD).replace(path / RECORD)
    except OSError:
        with suppress(OSError):
            old.replace(path)
        raise
    finally:
        shutil.rmtree(old, ignore_errors=True)


def hidden(path: Path, mark: str) -> Path:
    """A name beside `path` that git, DVC and searches for results pass over.

    Raises:
        BadInput: when `path` is no name that a file or a folder could have.
    """
    if path.name in ("", "..") or "\0" in str(path):
        raise BadInput(f"{str(path)!r}: is no name for a file or a folder to be written")
    return path.with_name(f".{path.name}.{mark}.tmp")


def _temporary(path: Path) -> Path:
    """A name that no other run takes, not even one in another container with the same process id."""
    return hidden(path, f"{os.getpid()}.{token_hex(4)}")


def check_name(key: str, path: Path) -> None:
    """Refuse what no file can be called, and what lies where nobody may look.

    Raises:
        BadInput: one line that names the key.
    """
    try:
        path.exists()
    except OSError as error:
        raise BadInput(f"{key}: {error.strerror}: {str(path)[:60]!r}") from None


def check_writable(path: Path) -> None:
    """Refuse, before any work is done, what cannot be written in the end.

    Raises:
        BadInput: when `path` would lie below a file, or where nobody may write.
    """
    try:
        there = next(p for p in (path, *path.absolute().parents) if p.exists())
    except OSError as error:
        raise BadInput(f"{path}: cannot be written: {error.strerror}") from None
    if there != path and not there.is_dir():
        raise BadInput(f"{there}: is a file, so that the folder {path} cannot be written")
    if not os.access(there, os.W_OK):
        raise BadInput(f"{there}: cannot be written: no permission")


def check_replaceable(path: Path, ours: Collection[str]) -> None:
    """Refuse to replace a folder in which something else lies: naming the wrong one loses nobody's logs.

    Args:
        ours: names of files and folders that may be replaced, * for any characters.

    Raises:
        BadInput: when `path` holds anything else, or cannot be a folder.
    """
    if path.name in ("", "..") or path.is_symlink():
        raise BadInput(f"{path}: is replaced as a whole: give a folder its own name, and no link")
    check_writable(path)
    if path.is_file():
        raise BadInput(f"{path}: is a file, so that the folder {path} cannot be written")
    try:
        names = sorted(p.name for p in path.iterdir()) if path.is_dir() else []
    except OSError as error:
        raise BadInput(f"{path}: cannot be written: {error.strerror}") from None
    for name in names:
        if not any(fnmatchcase(name, pattern) for pattern in (*ours, RECORD)):
            raise BadInput(f"{path}: is replaced as a whole, but holds {name!r}: choose another folder")


def _explained(error: OSError, path: Path, temporary: Path) -> str:
    """One line on what could not be written, or, if the block was reading, on what could not be read."""
    reason = error.strerror or str(error)
    own = (str(temporary), *map(str, path.parents), str(path))
    if error.filename and not str(error.filename).startswith(own[0]) and str(error.filename) not in own:
        return f"{error.filename}: {reason}"
    # a folder that is itself on its way has another name for a user
    shown = ON_ITS_WAY.sub(r"\1", str(path))
    return f"{shown}: cannot be written: {reason}"


def write_json(path: Path, content: Any) -> None:
    """Write `content` as indented JSON with sorted keys, so that two equal results are equal files."""
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1, sort_keys=True, allow_nan=False) + "\n")


def read_json(path: Path) -> Any:
    """Read a JSON file.

    Raises:
        BadInput: when the file is missing or is not JSON, or a number in it is not finite.
    """
    try:
        return json.loads(path.read_text(), parse_constant=_finite, parse_float=_finite)
    except FileNotFoundError:
        raise BadInput(f"{path}: no such file") from None
    except OSError as error:
        raise BadInput(f"{path}: cannot be read: {error.strerror}") from None
    except RecursionError:
        raise BadInput(f"{path}: not a JSON file (nested too deeply)") from None
    except ValueError as error:
        raise BadInput(f"{path}: not a JSON file ({error})") from None


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text[:30]} is not a finite number")
    return number
