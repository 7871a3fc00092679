"""Reduced equations of every fold: fits of any set of laws, and their errors on left-out experiments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.diagnosis.core.left_out_kernels import left_out, solve

#: Plausible sizes by which the prior of an amplitude spreads.
PRIOR = 3.0


@dataclass(frozen=True, eq=False)
class Folds:
    """Reduced equations of every fold; the last row and column are the measured error."""

    fit: Array  # products over the other experiments, (folds, columns + 1, columns + 1)
    score: Array  # products over the experiment that is left out, same shape (folds, ...)
    whole: Array  # products over all experiments, (columns + 1, columns + 1)
    first: Indices  # first column of every atom, (atoms,)
    count: Indices  # columns of every atom, (atoms,)
    positive: Mask  # (columns,): cannot be negative
    price: Array  # logarithm of the volume of the deviations of every experiment, (experiments,)

    def errors(self, sets: Indices) -> Array:
        """Return squared errors (sets, experiments) of left-out experiments with sets (sets, most)."""
        found: Array = left_out(self.fit, self.score, sets, self.first, self.count, self.positive)
        return found

    def with_all(self, prior: float) -> float:
        """Return the squared error of left-out experiments with all columns."""
        total, ridge = 0.0, (prior**-2.0 - PRIOR**-2.0) * np.eye(self.fit.shape[1] - 1)
        for fit, score in zip(self.fit, self.score, strict=True):
            found = np.append(-np.linalg.solve(fit[:-1, :-1] + ridge, fit[:-1, -1]), 1.0)
            total += float(found @ score @ found)
        return total

    def amounts(self, atoms: Sequence[int]) -> list[Array]:
        """Return the amplitudes (amplitudes,) of every atom of a set from all experiments."""
        each = [np.arange(self.first[a], self.first[a] + self.count[a]) for a in atoms]
        index = np.concatenate([np.empty(0, np.int64), *each])
        found = np.zeros(len(index))
        solve(self.whole, index, len(index), self.positive, found)
        return np.split(found, np.cumsum(self.count[list(atoms)])[:-1]) if len(each) else []


def without_open(train: Array, score: Array, n: int, prior: Array) -> tuple[Array, Array]:
    """Eliminate the first n columns, with a prior (n,): they are fitted to `train`, whatever the others are.

    Both matrices have n + columns + 1 rows and columns, and keep columns + 1.
    """
    inner = np.linalg.solve(train[:n, :n] + np.diag(prior**-2.0), train[:n, n:])
    fit = train[n:, n:] - train[n:, :n] @ inner
    fit[np.arange(len(fit) - 1), np.arange(len(fit) - 1)] += PRIOR**-2.0
    both = score[n:, :n] @ inner
    return fit, score[n:, n:] - both - both.T + inner.T @ (score[:n, :n] @ inner)
