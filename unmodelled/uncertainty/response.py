"""Response: outputs as a deterministic function of uncertain parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, final

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput

#: Share of a bound's width by which rounding may carry a parameter past it.
ROUNDING = 1e-9


class Response(Protocol):
    """Function from n uncertain parameters to L outputs, Y_l = M_l(theta) (section 3.2.1), in batches."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the n parameters."""

    @property
    def bounds(self) -> Array:
        """Lower and upper bounds within which every output exists, shape (n, 2)."""

    def __call__(self, theta: Array) -> Array:
        """Return outputs (S, L) at parameters (S, n); NaN where an output does not exist."""


@final
@dataclass(frozen=True, eq=False)
class Formula:
    """Response given by a Python function."""

    names: tuple[str, ...]
    bounds: Array  # (n, 2)
    function: Callable[[Array], Array]  # (S, n) to (S, L)

    def __call__(self, theta: Array) -> Array:
        return self.function(theta)


def evaluate_response(response: Response, theta: Array) -> Array:
    """Evaluate a response (S, L) at parameters (S, n) and refuse missing outputs."""
    check_inside(response, theta)
    y = np.asarray(response(theta), dtype=float)
    missing = ~np.isfinite(y)
    if missing.any():
        sample, output = np.argwhere(missing)[0]
        raise BadInput(
            f"the event does not happen at theta = {_shown(theta[sample])} for output {output + 1} of "
            f"{y.shape[1]}: narrow the bounds"
        )
    return y


def check_inside(response: Response, theta: Array) -> None:
    """Refuse parameters (S, n) outside the bounds of a response."""
    low, high = response.bounds.T
    slack = ROUNDING * (high - low)
    outside = ~((theta >= low - slack) & (theta <= high + slack))
    if outside.any():
        sample, k = np.argwhere(outside)[0]
        raise BadInput(
            f"theta = {_shown(theta[sample])} lies outside the bounds of {response.names[k]}, "
            f"{low[k]:g} to {high[k]:g}: clip its distribution or widen the bounds"
        )


def _shown(theta: Array) -> str:
    return f"({', '.join(f'{value:.6g}' for value in theta)})"
