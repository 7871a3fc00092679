"""What is uncertain acts through a response: outputs as a deterministic function of uncertain parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, final

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput

Array = NDArray[np.float64]

#: Share of a bound's width by which rounding may carry a parameter past it.
ROUNDING = 1e-9


class Response(Protocol):
    """L outputs Y_l = M_l(theta) of n uncertain parameters (section 3.2.1), all in one call."""

    @property
    def names(self) -> tuple[str, ...]:
        """Of the n parameters."""

    @property
    def bounds(self) -> Array:
        """(n, 2) lower and upper ends of the box in which every output exists."""

    def __call__(self, theta: Array) -> Array:
        """(S, L) outputs at (S, n) parameters, NaN where an output does not exist."""


@final
@dataclass(frozen=True, eq=False)
class Formula:
    """A function of theta, (S, n) to (S, L), as a response."""

    names: tuple[str, ...]
    bounds: Array
    function: Callable[[Array], Array]

    def __call__(self, theta: Array) -> Array:
        return self.function(theta)


def checked(response: Response, theta: Array) -> Array:
    """(S, L) outputs of `response` at (S, n) parameters inside its bounds, none of them NaN.

    Raises BadInput where a parameter lies outside the bounds or an output does not exist (section 3.3.3: the
    bounds are to enclose the feasible area only); it names the first such theta.
    """
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
    """Raises BadInput where one of the (S, n) parameters lies outside the bounds or is NaN."""
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
