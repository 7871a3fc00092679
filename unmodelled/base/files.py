"""Writing of results in one step, so that a killed run never leaves an incomplete file."""

from __future__ import annotations

import ctypes
import errno
import json
import math
import os
import re
import shutil
from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from typing import Any

from unmodelled.base.errors import BadInput
from unmodelled.base.leftovers import locked, remove_leftovers
from unmodelled.base.limits import OBJECTS, check_file
from unmodelled.base.markers import MARKER, ON_ITS_WAY, RECORD, results_in
from unmodelled.base.ownership import check_named, check_replaceable, mark, missing_marker

#: Bytes of results that are copied, at most: far more than an answer has; a sparse file can have any size.
LARGEST = 1e9
#: Files of results that are copied, at most: an answer has about thirty.
MOST = 10_000
#: Of Linux's renameat2: the working directory as the start of relative paths, and the exchange (linux/fs.h).
_AT_FDCWD, _RENAME_EXCHANGE = -100, 2
#: What a system or a file system says that cannot exchange two names.
_UNKNOWN = (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary file name beside `path`; rename the file to `path` if the block succeeds."""
    temporary = _temporary(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        claim(path)
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise BadInput(_explained(error, path, temporary)) from error
    finally:
        with suppress(OSError):
            temporary.unlink()


def write_texts(texts: Mapping[Path, str]) -> None:
    """Write texts by the paths of their files: all of them, or none if one cannot be written."""
    with ExitStack() as stack:
        for path, text in texts.items():
            stack.enter_context(replacing(path)).write_text(text, encoding="utf-8", newline="")


def claim(path: Path) -> None:
    """Mark the output folder of the running verb, as `replacing` does, before workers write files."""
    if (claimed := missing_marker(path)) is not None:
        marker, text = claimed
        with replacing(marker) as temporary:
            temporary.write_text(text)


@contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """Yield an empty temporary folder beside `path`; it replaces `path` if the block succeeds.

    Only a folder that the same verb made is replaced. A folder `.hydra` in `path` is kept.
    """
    temporary = _temporary(path)
    try:
        check_replaceable(path, whole=True)
        temporary.mkdir(parents=True)
        with ExitStack() as stack:
            with suppress(OSError):  # a file system without locks
                stack.enter_context(locked(temporary))
            yield temporary
            put_folder(temporary, path)
        remove_leftovers(path)
    except OSError as error:
        raise BadInput(_explained(error, path, temporary)) from error
    finally:
        _remove(temporary)


@contextmanager
def extending_folder(path: Path) -> Iterator[Path]:
    """Yield a copy of the folder `path`, to which the block adds files; it replaces `path` as a whole."""
    with replacing_folder(path) as new:
        if path.is_dir():
            ignored = shutil.ignore_patterns(MARKER, RECORD)
            shutil.copytree(path, new, symlinks=True, ignore=ignored, dirs_exist_ok=True)
        yield new


def copy_results(folder: Path, new: Path, but: Collection[str] = ()) -> None:
    """Copy the results below a folder, also of a stranger: no links, and no files whose name is in `but`."""
    size = 0
    for count, name in enumerate(results_in(folder), 1):
        source, copy = folder / name, new / name
        if source.name in but:
            continue
        if count > MOST:
            raise BadInput(f"{folder}: has too many results: up to {MOST} files are copied")
        size += source.lstat().st_size
        if size > LARGEST:
            raise BadInput(f"{source}: is too large: results of up to {LARGEST / 1e9:g} GB are copied")
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(source, copy, follow_symlinks=False)


def put_folder(new: Path, path: Path) -> None:
    """Rename a finished folder to `path`, replacing the folder of that name.

    If the process is interrupted or killed, `path` holds the complete old folder or the complete new one.
    Where the system cannot exchange two names in one step (other systems than Linux, some network drives),
    `path` can be missing after a kill; the old folder is then beside it under a hidden name until a later
    run succeeds. A folder `.hydra` in the old folder is kept.
    """
    check_replaceable(path, whole=True)
    mark(new, path)
    if (path / RECORD).is_dir():
        shutil.copytree(path / RECORD, new / RECORD, symlinks=True, dirs_exist_ok=True)
    old = _temporary(path)
    try:
        if not exchange(new, path):
            _put_in_two_steps(new, path, old)
            return
    except FileNotFoundError:  # nothing is replaced
        new.replace(path)
        return
    new.replace(old)  # a growing folder's name is free for another run
    _remove(old)


def exchange(one: Path, other: Path) -> bool:
    """Exchange the names of two folders of one file system, and return whether the system can do that."""
    rename = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if rename is None:
        return False
    if rename(_AT_FDCWD, os.fsencode(one), _AT_FDCWD, os.fsencode(other), _RENAME_EXCHANGE) == 0:
        return True
    if (code := ctypes.get_errno()) in _UNKNOWN:
        return False
    raise OSError(code, os.strerror(code), str(one), None, str(other))


def _put_in_two_steps(new: Path, path: Path, old: Path) -> None:
    superseded = False  # noted, not looked up: what took the old one's place may itself be on its way out
    try:
        with suppress(FileNotFoundError):
            path.replace(old)
        new.replace(path)
        superseded = True
    except BaseException:  # an interruption, too
        try:
            old.replace(path)
        except OSError as error:
            superseded = superseded or error.errno in (errno.ENOTEMPTY, errno.EEXIST)
        raise
    finally:
        if superseded or path.exists():
            _remove(old)


def _remove(folder: Path) -> None:
    try:
        shutil.rmtree(folder, ignore_errors=True)
    finally:  # an interruption cuts the first one off
        shutil.rmtree(folder, ignore_errors=True)


def hidden(path: Path, mark: str) -> Path:
    """Return a hidden name beside `path`, which git, DVC and searches for results ignore."""
    check_named(path)
    return path.with_name(f".{path.name}.{mark}.tmp")


def _temporary(path: Path) -> Path:
    """Return a temporary name that is unique among all runs, also among containers with equal process ids."""
    return hidden(path, f"{os.getpid()}.{token_hex(4)}")


def _explained(error: OSError, path: Path, temporary: Path) -> str:
    """Return one line that says which file could not be written, or could not be read by the block."""
    reason = error.strerror or str(error)
    if several := re.search(r"\[Errno \d+\] (.*?)(: ['\"]|$)", reason):  # shutil lists every file of a folder
        reason = several[1]
    own = (str(temporary), *map(str, path.parents), str(path))
    name = error.filename2 or error.filename  # of a copy, where to; shutil names its source first
    if name and not str(name).startswith(own[0]) and str(name) not in own:
        return f"{name}: {reason}"
    # a folder that is itself on its way has another name for a user
    shown = ON_ITS_WAY.sub(r"\1", str(path))
    return f"{shown}: cannot be written: {reason}"


def write_json(path: Path, content: Any) -> None:
    """Write an object as indented JSON with sorted keys, so that equal results are equal files."""
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1, sort_keys=True, allow_nan=False) + "\n")


def read_json(path: Path) -> Any:
    """Read a JSON file."""
    check_file(path, OBJECTS)
    try:
        return json.loads(path.read_text(), parse_constant=_finite, parse_float=_finite, parse_int=_whole)
    except FileNotFoundError:
        raise BadInput(f"{path}: no such file: check the path") from None
    except OSError as error:
        raise BadInput(f"{path}: cannot be read: {error.strerror}: check its permissions") from None
    except RecursionError:
        raise BadInput(f"{path}: not a JSON file (nested too deeply): write it again") from None
    except ValueError as error:
        raise BadInput(f"{path}: not a JSON file ({error}): write it again") from None


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text[:30]} is not a finite number")
    return number


def _whole(text: str) -> int:
    _finite(text)  # what no float holds fails wherever it meets one
    return int(text)
