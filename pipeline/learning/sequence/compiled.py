"""How the loops of this package are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """`function`, compiled when it is first called and kept on disk; other threads run meanwhile.

    Sums keep their order: a function that is called by another has a copy in it, which runs where the other
    was loaded from disk. Were the compiler free to reorder, the two would round differently, and a training
    that compiles would give other digits than one that does not.
    """
    result: F = numba.njit(function, cache=True, nogil=True, error_model="numpy")
    return result
