"""Functions that numba compiles, kept on disk until a file of their room changes.

By itself numba keeps a compiled function until its own file changes. What it calls is compiled into it,
though, and may stand in another file of its room, the folder below the package that holds it. What is kept is
run when it is loaded, so that no folder is used that others may write to. Where nothing can be kept,
functions are compiled at every start.
"""

from __future__ import annotations

import hashlib
import os
import stat
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from itertools import takewhile
from multiprocessing import parent_process
from pathlib import Path
from typing import Any, TypeVar

import numba
from llvmlite import binding  # type: ignore[import-untyped]
from numba.core import caching

from unmodelled.base.errors import BadInput

F = TypeVar("F", bound=Callable[..., Any])

#: What a user can do about a folder in which nothing is kept.
_ADVICE = "choose another with NUMBA_CACHE_DIR and HYBRID_DYNAMICS_CACHE"


def check_private(folder: Path, within: Path | None = None) -> None:
    """Refuse a folder of another user, or one that others may write to, to keep code in.

    Args:
        folder: exists. within: the folder around it, where that one is trusted: its owner and those who may
            write to it are, and those who may not enter it cannot write below.

    Raises:
        BadInput: one line with what to do.
    """
    about = folder.stat()
    owners, writers = {os.getuid()}, about.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    if within is not None:
        around = within.stat()
        # of each three bits 2 is to write and 1 to enter
        owners, writers = {*owners, around.st_uid}, writers & (around.st_mode << 1) & ~around.st_mode
    if about.st_uid not in owners:
        raise BadInput(
            f"{folder}: compiled functions are not kept there, it belongs to another user: {_ADVICE}"
        )
    if writers:
        raise BadInput(
            f"{folder}: compiled functions are not kept there, others may write to it: chmod go-w, "
            f"or {_ADVICE}"
        )


@cache
def tell(line: str) -> None:
    """Say a line once, on standard error; a process that works for another one leaves it to that one."""
    if parent_process() is None:
        print(f"note: {line}", file=sys.stderr)


class _AsItsRoom:
    """What is compiled of a package is as new as the room of its file, and kept where it is private."""

    _py_file: str
    _cache_path: str

    def ensure_cache_path(self) -> None:
        folder = Path(self._cache_path)
        for missing in reversed([p for p in (folder, *folder.parents) if not p.exists()]):
            missing.mkdir(mode=0o700, exist_ok=True)
        super().ensure_cache_path()  # type: ignore[misc]
        try:
            self.check()
        except BadInput as refused:
            tell(str(refused))
            raise PermissionError(str(refused)) from None  # numba asks the next locator

    def check(self) -> None:
        """Refuse to keep anything here."""
        check_private(Path(self._cache_path).parent)
        check_private(Path(self._cache_path), within=Path(self._cache_path).parent)

    def get_source_stamp(self) -> tuple[object, bytes]:
        own = super().get_source_stamp()  # type: ignore[misc]
        room = _room(Path(self._py_file).parent)
        return own, _digest(room) if room is not None else b""


class Chosen(_AsItsRoom, caching.UserProvidedCacheLocator):  # type: ignore[misc]
    """Kept where NUMBA_CACHE_DIR says."""


class InTree(_AsItsRoom, caching.InTreeCacheLocator):  # type: ignore[misc]
    """Kept beside the file, in __pycache__."""

    def check(self) -> None:
        check_private(Path(self._cache_path), within=Path(self._cache_path).parent)


class UserWide(_AsItsRoom, caching.UserWideCacheLocator):  # type: ignore[misc]
    """Kept in the user's cache folder, where the package cannot be written to."""


class _Kept(caching.FunctionCache):  # type: ignore[misc]
    """What cannot be written is compiled again at the next start."""

    def save_overload(self, *compiled: Any) -> None:
        try:
            super().save_overload(*compiled)
        except OSError as error:
            where = Path(self.cache_path).parent
            tell(
                f"{where}: compiled functions cannot be kept ({error.strerror}), every start compiles them: "
                f"free some space, or {_ADVICE}"
            )


_OURS = (f"{__name__}.{kind.__name__}" for kind in (Chosen, InTree, UserWide))
#: Numba's own ones for the functions of a notebook, and of a zip.
LOCATORS = ",".join([*_OURS, "IPythonCacheLocator", "ZipCacheLocator"])

# LLVM by itself uses half of such a register
if (_here := binding.get_host_cpu_features()).get("avx512f") and not numba.config.CPU_FEATURES:
    numba.config.CPU_FEATURES = f"{_here.flatten()},-prefer-256-bit"


def _room(folder: Path) -> Path | None:
    """The folder of a package that holds `folder`, or the package itself; None outside of packages."""
    inside = [*takewhile(lambda p: (p / "__init__.py").exists(), (folder, *folder.parents))]
    return inside[-2:][0] if inside else None


@cache
def _digest(room: Path) -> bytes:
    """Of the Python files in a folder and below it."""
    return hashlib.sha256(b"\0".join(path.read_bytes() for path in sorted(room.rglob("*.py")))).digest()


def kept(*signature: Any, **options: Any) -> Callable[[F], F]:
    """A decorator that compiles, as `numba.njit` does, and keeps what it has compiled."""
    # here, for numba forgets it when it compiles after a change of its variables of the environment
    numba.config.CACHE_LOCATOR_CLASSES = LOCATORS

    def compile_and_keep(function: F) -> F:
        compiled: Any = numba.njit(**options)(function)
        # as numba's option cache does, with a cache of ours
        with suppress(RuntimeError):  # there is no folder for it
            compiled._cache = _Kept(function)
        if signature:
            compiled.compile(*signature)
            compiled.disable_compile()
        return compiled  # type: ignore[no-any-return]

    return compile_and_keep


def compiled(function: F) -> F:
    """`function`, compiled when it is first called and kept; other threads run meanwhile.

    Sums keep their order: a function that is called by another has a copy in it, which runs where the other
    was loaded from disk. Were the compiler free to reorder, the two would round differently, and a training
    that compiles would give other digits than one that does not.
    """
    return kept(nogil=True, error_model="numpy")(function)
