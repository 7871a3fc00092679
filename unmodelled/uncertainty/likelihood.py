"""Log-likelihood of data (section 3.2.2), with a lower limit for improbable data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np

from unmodelled.base.arrays import Array, Mask
from unmodelled.uncertainty.density import Density

#: Log-densities (B, L) of the data under a batch of parameters (B, n, 2).
LogDensity = Callable[[Array], Array]

#: Density of the floor in ones over the range of the output, as if a hundredth of a percent of the data were
#: due to something else that is spread over it. A normal density falls to it at 4 to 5 standard deviations.
TAIL = 1e-4


def tail_floor(spans: Array, tail: float = TAIL) -> Array:
    """Return the smallest log-densities (L,) that count, log(tail / range), for ranges `spans` (L, 2).

    A clipped distribution gives outputs of a limited range: one datum outside of it would make the likelihood
    zero for every alpha, and one far in a tail, where moments and samples carry no information, would decide
    alone. The default lies below the resolution of the benchmark in the text: one of its 200 000 samples in
    one of 100 bins is a density of 5e-4 / range. The range is that of the response over its bounds, so that
    the limit does not depend on the identified parameters.
    """
    return np.asarray(np.log(tail / (spans[:, 1] - spans[:, 0])))


@final
@dataclass(frozen=True, eq=False)
class LogLikelihood:
    """Log-likelihoods of L data, under one distribution of the parameters or each of a batch."""

    each: Array  # (..., L), of densities in one over the unit of the outputs
    floored: Mask  # (..., L), whether the lower limit replaced them

    @property
    def total(self) -> Array:
        """Sums over the data, shape (...): log L of eq. (3.3)."""
        return np.asarray(self.each.sum(-1))


def log_likelihoods(density: Density, y: Array, floor: Array | float = -np.inf) -> LogLikelihood:
    """Compute the log-likelihoods of data (L,) under the densities of the outputs, with a floor (L,)."""
    return floored(density.log_density(y), floor)


def floored(log_density: Array, floor: Array | float) -> LogLikelihood:
    """Return log-densities (..., L) with a lower limit (L,)."""
    above = log_density >= floor
    return LogLikelihood(np.where(above, log_density, floor), ~above)


def at_data(propagation: Callable[[Array], Density], y: Array) -> LogDensity:
    """Return the log-densities (B, L) of data (L,) as a function of distributions (B, n, 2), one by one."""
    return lambda alphas: np.stack([propagation(alpha).log_density(y) for alpha in alphas])


def objective(log_density: LogDensity, floor: Array | float = -np.inf) -> Callable[[Array], Array]:
    """Return the log-likelihoods (B,) as a function of flat parameters (B, 2 n), in the order of the text."""

    def total(flat: Array) -> Array:
        alphas = flat.reshape(len(flat), 2, -1).swapaxes(1, 2)
        return floored(log_density(alphas), floor).total

    return total
