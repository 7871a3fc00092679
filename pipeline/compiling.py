"""Functions that numba compiles, kept on disk until a file in their folder changes.

By itself numba keeps a compiled function until its own file changes. What it calls is compiled into it,
though, and may stand in a file beside it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
from llvmlite import binding  # type: ignore[import-untyped]
from numba.core import caching

F = TypeVar("F", bound=Callable[..., Any])

PACKAGE = Path(__file__).parent


class _AsItsFolder:
    """What is compiled of this package is as new as the folder of its file."""

    _py_file: str

    def get_source_stamp(self) -> tuple[object, bytes]:
        own = super().get_source_stamp()  # type: ignore[misc]
        folder = Path(self._py_file).parent
        return own, _digest(folder) if PACKAGE in (folder, *folder.parents) else b""


class Chosen(_AsItsFolder, caching.UserProvidedCacheLocator):  # type: ignore[misc]
    """Kept where NUMBA_CACHE_DIR says."""


class InTree(_AsItsFolder, caching.InTreeCacheLocator):  # type: ignore[misc]
    """Kept beside the file, in __pycache__."""


class UserWide(_AsItsFolder, caching.UserWideCacheLocator):  # type: ignore[misc]
    """Kept in the user's cache folder, where the package cannot be written to."""


_OURS = (f"{__name__}.{kind.__name__}" for kind in (Chosen, InTree, UserWide))
#: Numba's own ones for the functions of a notebook, and of a zip.
LOCATORS = ",".join([*_OURS, "IPythonCacheLocator", "ZipCacheLocator"])

# LLVM by itself uses half of such a register
if (_here := binding.get_host_cpu_features()).get("avx512f") and not numba.config.CPU_FEATURES:
    numba.config.CPU_FEATURES = f"{_here.flatten()},-prefer-256-bit"


@cache
def _digest(folder: Path) -> bytes:
    """Of the Python files in a folder."""
    return hashlib.sha256(b"\0".join(path.read_bytes() for path in sorted(folder.glob("*.py")))).digest()


def kept(*signature: Any, **options: Any) -> Callable[[F], F]:
    """A decorator that compiles, as `numba.njit` does, and keeps what it has compiled."""
    # here, for numba forgets it when it compiles after a change of its variables of the environment
    numba.config.CACHE_LOCATOR_CLASSES = LOCATORS
    decorator: Callable[[F], F] = numba.njit(*signature, cache=True, **options)
    return decorator


def compiled(function: F) -> F:
    """`function`, compiled when it is first called and kept; other threads run meanwhile.

    Sums keep their order: a function that is called by another has a copy in it, which runs where the other
    was loaded from disk. Were the compiler free to reorder, the two would round differently, and a training
    that compiles would give other digits than one that does not.
    """
    return kept(nogil=True, error_model="numpy")(function)
