"""Response: outputs as a deterministic function of uncertain parameters."""

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
    """Function from n uncertain parameters to L outputs, Y_l = M_l(theta) (section 3.2.1), evaluated in
    batches.
    """

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
    """Response given by a Python function.

    Attributes:
        names: names of the n parameters.
        bounds: lower and upper bounds, shape (n, 2).
        function: outputs of shape (S, L) as a function of parameters of shape (S, n).
    """

    names: tuple[str, ...]
    bounds: Array
    function: Callable[[Array], Array]

    def __call__(self, theta: Array) -> Array:
        return self.function(theta)


def evaluate_response(response: Response, theta: Array) -> Array:
    """Evaluate a response and refuse missing outputs.

    Takes theta (S, n); gives (S, L).

    Examples:
        >>> def positive(theta):
        ...     return np.where(theta < 0.0, np.nan, theta)
        >>> known = Formula(("theta",), np.array([[-1.0, 4.0]]), positive)
        >>> evaluate_response(known, np.array([[4.0]])).tolist()
        [[4.0]]
        >>> evaluate_response(known, np.array([[-0.5]]))
        Traceback (most recent call last):
            ...
        unmodelled.base.errors.BadInput: the event does not happen at theta = (-0.5) for output 1 of 1: ...
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
    """Refuse parameters outside the bounds of a response.

    Takes theta (S, n).
    """
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
