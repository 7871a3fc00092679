"""The log-likelihood of data (section 3.2.2), with a floor under improbable ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from unmodelled.uncertainty.density import Density

Array = NDArray[np.float64]
#: Log-densities (B, L) of the data under a batch of parameters (B, n, 2).
LogDensity = Callable[[Array], Array]

#: Density of the floor in ones over the range of the output, as if a hundredth of a percent of the data were
#: due to something else that is spread over it. A normal density falls to it at 4 to 5 standard deviations.
TAIL = 1e-4


def tail_floor(spans: Array, tail: float = TAIL) -> Array:
    """(L,) least log-densities that count, log(tail / range).

    A clipped distribution makes outputs of a range only: one datum outside of it would have the likelihood
    zero under every alpha, and one far in a tail, where moments and samples tell nothing, would decide alone.
    The default is below what the benchmark of the text resolves: a bin with one of its 200 000 samples, where
    100 bins make up the range, stands for a density of 5e-4 / range. The range is that of the response over
    its bounds, so that the floor does not depend on what is identified.

    Args:
        spans: (L, 2) smallest and largest value of the outputs.
    """
    return np.asarray(np.log(tail / (spans[:, 1] - spans[:, 0])))


@final
@dataclass(frozen=True, eq=False)
class LogLikelihood:
    """Of L data, under one distribution of the parameters or each of a batch.

    Attributes:
        each: (..., L) log-likelihoods, natural, of densities in one over the unit of the outputs.
        floored: (..., L) whether the floor replaced them.
    """

    each: Array
    floored: NDArray[np.bool_]

    @property
    def total(self) -> Array:
        """(...) their sums, log L of equation (3.3)."""
        return np.asarray(self.each.sum(-1))

    @property
    def hits(self) -> NDArray[np.int64]:
        """(...) how many data are at the floor; it is to be shown with the total."""
        return np.asarray(self.floored.sum(-1))


def log_likelihoods(density: Density, y: Array, floor: Array | float = -np.inf) -> LogLikelihood:
    """Of data y (L,) under the densities of the outputs.

    Args:
        floor: least log-density that counts, (L,) as of `tail_floor` or one for all.
    """
    return floored(density.log_density(y), floor)


def floored(log_density: Array, floor: Array | float) -> LogLikelihood:
    """Log-densities (..., L) with a floor, (L,) or one for all; what is not a number counts as below it."""
    above = log_density >= floor
    return LogLikelihood(np.where(above, log_density, floor), ~above)


def at_data(propagation: Callable[[Array], Density], y: Array) -> LogDensity:
    """Log-densities (B, L) of data y (L,) by a propagation, one alpha (n, 2) of the batch after the other."""

    def each(alphas: Array) -> Array:
        return np.stack([propagation(alpha).log_density(y) for alpha in alphas])

    return each


def objective(log_density: LogDensity, floor: Array | float = -np.inf) -> Callable[[Array], Array]:
    """Total log-likelihoods (B,) as a function of parameters (B, 2 n) in the order of the text.

    That order is (mu_1, ..., mu_n, sigma_1, ..., sigma_n).
    """

    def total(flat: Array) -> Array:
        alphas = flat.reshape(len(flat), 2, -1).swapaxes(1, 2)
        return floored(log_density(alphas), floor).total

    return total
