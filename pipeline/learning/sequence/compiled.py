"""How the loops of this package are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

F = TypeVar("F", bound=Callable[..., Any])

#: Sums may be taken in another order, so that they use vectors; what is not a number stays visible.
RELAXED = {"reassoc", "contract", "arcp", "nsz"}


def compiled(function: F) -> F:
    """`function`, compiled when it is first called and kept on disk; other threads run meanwhile."""
    result: F = numba.njit(function, cache=True, nogil=True, fastmath=RELAXED, error_model="numpy")
    return result
