"""Compiled functions that are cached on disk until a file of their room changes.

By default numba invalidates the cache of a compiled function only when the file of that function changes. The
code of a called function is compiled into its caller, however, and can stand in another file of the same room
(the folder below the package). Cached code is executed when it is loaded, so a folder that other users may
write to is never used as a cache, and a file in it that they may write to is removed. Without a usable cache
folder, functions are compiled at every start.
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
from unmodelled.base.limits import check_address_space

F = TypeVar("F", bound=Callable[..., Any])

#: Address space that LLVM takes, at most, to compile the functions of a simulation (measured: 50 MB), bytes.
COMPILER = 1e8
#: Advice for a folder that cannot be the cache.
_ADVICE = "choose another with NUMBA_CACHE_DIR and HYBRID_DYNAMICS_CACHE"


def check_private(folder: Path, within: Path | None = None) -> None:
    """Refuse a cache folder that belongs to another user, or that other users may write to."""
    about = folder.stat()
    owners, writers = {os.getuid()}, about.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    if within is not None:
        around = within.stat()
        # of each three bits 2 is to write and 1 to enter
        owners, writers = {*owners, around.st_uid}, writers & (around.st_mode << 1) & ~around.st_mode
    if about.st_uid not in owners:
        raise BadInput(
            f"{folder}: compiled functions are not cached there, because the folder belongs to "
            f"another user: {_ADVICE}"
        )
    if writers:
        raise BadInput(
            f"{folder}: compiled functions are not cached there, because other users may write to it: "
            f"chmod go-w, or {_ADVICE}"
        )


@cache  # once: afterwards this process alone writes there
def remove_doubtful(folder: Path, endings: tuple[str, ...]) -> None:
    """Remove files of a cache folder that another user owns or may write to, and links."""
    around = folder.stat()
    for entry in [entry for entry in os.scandir(folder) if entry.name.endswith(endings)]:
        try:
            about = entry.stat(follow_symlinks=False)
        except FileNotFoundError:  # another process was faster
            continue
        writers = about.st_mode & (stat.S_IWGRP | stat.S_IWOTH) & ~around.st_mode
        own = about.st_uid in (os.getuid(), around.st_uid)
        if stat.S_ISREG(about.st_mode) and own and not writers:
            continue
        tell(f"{folder}: compiled functions that others could have changed are removed and made again")
        try:
            Path(entry.path).unlink(missing_ok=True)
        except OSError as error:
            raise BadInput(f"{entry.path}: cannot be removed: {error.strerror}: {_ADVICE}") from None


@cache
def tell(line: str) -> None:
    """Print a note once on standard error; worker processes print nothing."""
    if parent_process() is None:
        print(f"note: {line}", file=sys.stderr)


class _AsItsRoom:
    """Numba cache locator that follows all files of a room, and refuses folders that are not private."""

    _py_file: str
    _cache_path: str

    def ensure_cache_path(self) -> None:
        folder = Path(self._cache_path)
        for missing in reversed([p for p in (folder, *folder.parents) if not p.exists()]):
            missing.mkdir(mode=0o700, exist_ok=True)
        super().ensure_cache_path()  # type: ignore[misc]
        try:
            self.check()
            remove_doubtful(folder, (".nbi", ".nbc"))
        except BadInput as refused:
            tell(str(refused))
            raise PermissionError(str(refused)) from None  # numba asks the next locator

    def check(self) -> None:
        """Refuse the cache folder if it is not private."""
        check_private(Path(self._cache_path).parent)
        check_private(Path(self._cache_path), within=Path(self._cache_path).parent)

    def get_source_stamp(self) -> tuple[object, bytes]:
        own = super().get_source_stamp()  # type: ignore[misc]
        room = _room(Path(self._py_file).parent)
        return own, _digest(room) if room is not None else b""


class Chosen(_AsItsRoom, caching.UserProvidedCacheLocator):  # type: ignore[misc]
    """Cache in the folder that the environment variable NUMBA_CACHE_DIR names."""


class InTree(_AsItsRoom, caching.InTreeCacheLocator):  # type: ignore[misc]
    """Cache beside the source file, in `__pycache__`."""

    def check(self) -> None:
        check_private(Path(self._cache_path), within=Path(self._cache_path).parent)


class UserWide(_AsItsRoom, caching.UserWideCacheLocator):  # type: ignore[misc]
    """Cache in the user's cache folder, for a package whose folder is read-only."""


class _Kept(caching.FunctionCache):  # type: ignore[misc]
    """Numba cache that prints a note if a function cannot be saved, instead of failing."""

    def load_overload(self, *asked: Any) -> Any:
        """Load a function; numba asks before it compiles one."""
        check_address_space(COMPILER)
        return super().load_overload(*asked)

    def save_overload(self, *compiled: Any) -> None:
        before = os.umask(0o077)
        os.umask(before | 0o022)  # the file would be removed at the next start
        try:
            super().save_overload(*compiled)
        except OSError as error:
            where = Path(self.cache_path).parent
            tell(
                f"{where}: compiled functions cannot be cached ({error.strerror}), so that every start "
                f"compiles them: free some space, or {_ADVICE}"
            )
        finally:
            os.umask(before)


_OURS = (f"{__name__}.{kind.__name__}" for kind in (Chosen, InTree, UserWide))
#: Numba's own ones for the functions of a notebook, and of a zip.
LOCATORS = ",".join([*_OURS, "IPythonCacheLocator", "ZipCacheLocator"])

# Numba also takes settings, such as the cache folder, from a file of this name in the working folder
numba.config._config_fname = os.devnull
numba.config.reload_config()
# LLVM by itself uses half of such a register
if (_here := binding.get_host_cpu_features()).get("avx512f") and not numba.config.CPU_FEATURES:
    numba.config.CPU_FEATURES = f"{_here.flatten()},-prefer-256-bit"


def _room(folder: Path) -> Path | None:
    """Return the folder of a package that holds `folder`, or the package itself; None outside of packages."""
    inside = [*takewhile(lambda p: (p / "__init__.py").exists(), (folder, *folder.parents))]
    return inside[-2:][0] if inside else None


@cache
def _digest(room: Path) -> bytes:
    """Return the SHA-256 digest of all Python files in and below a folder."""
    return hashlib.sha256(b"\0".join(path.read_bytes() for path in sorted(room.rglob("*.py")))).digest()


def kept(*signature: Any, **options: Any) -> Callable[[F], F]:
    """Return a decorator that compiles a function like `numba.njit` and caches the result on disk."""
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
    """Compile a function at its first call, without Python's global lock, and cache it on disk.

    The compiler may not reorder floating-point sums: a compiled function is copied into each of its callers,
    and the copies must round alike, in a process that compiles and in one that loads from the cache.
    """
    return kept(nogil=True, error_model="numpy")(function)
