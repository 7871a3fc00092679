"""Writing results so that a killed run never leaves half a file behind."""

from __future__ import annotations

import json
import math
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from typing import Any

from unmodelled.base.errors import BadInput
from unmodelled.base.limits import OBJECTS, check_file
from unmodelled.base.ownership import ON_ITS_WAY, RECORD, check_named, check_replaceable, mark, missing_marker


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary file name beside `path`; rename it to `path` if the block succeeds.

    Raises:
        BadInput: when the disk is full or the folder cannot be written; `path` keeps its old content.
    """
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


def claim(path: Path) -> None:
    """Mark the folder of the running verb as its own, before the file `path` in it is written.

    Needed where processes that work for the verb write the files; `replacing` does it in the verb's process.
    """
    if (claimed := missing_marker(path)) is not None:
        marker, text = claimed
        with replacing(marker) as temporary:
            temporary.write_text(text)


@contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """Yield an empty temporary folder beside `path`; it takes the place of `path` if the block succeeds.

    What is removed was made by the same verb (`check_replaceable`). A `RECORD` in `path` stays.

    Raises:
        BadInput: when the disk is full, the folder cannot be written, or holds what another verb or none
            wrote; `path` keeps its old content.
    """
    temporary = _temporary(path)
    try:
        check_replaceable(path)
        temporary.mkdir(parents=True)
        yield temporary
        put_folder(temporary, path)
    except OSError as error:
        raise BadInput(_explained(error, path, temporary)) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def put_folder(new: Path, path: Path) -> None:
    """Give the folder `new`, which lies beside it, the name `path`; a `RECORD` in what was there stays.

    An interruption or a kill at any moment leaves under `path` all of the old folder, or all of the new one,
    or, after a kill, nothing.

    Raises:
        BadInput: when `path` may not be replaced (`check_replaceable`).
        OSError: when it cannot be renamed; it then keeps its old content.
    """
    check_replaceable(path)
    mark(new, path)
    old = _temporary(path)
    try:
        with suppress(FileNotFoundError):
            path.replace(old)
        new.replace(path)
        if (old / RECORD).exists():
            (old / RECORD).replace(path / RECORD)
    except BaseException:  # an interruption, too
        with suppress(OSError):
            old.replace(path)
        raise
    finally:
        if path.exists():
            shutil.rmtree(old, ignore_errors=True)


def hidden(path: Path, mark: str) -> Path:
    """A name beside `path` that git, DVC and searches for results pass over.

    Raises:
        BadInput: when `path` is no name that a file or a folder could have.
    """
    check_named(path)
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
        BadInput: when the file is missing, too large or is not JSON, or a number in it is not finite.
    """
    check_file(path, OBJECTS)
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
