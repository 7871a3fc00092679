"""Bounded least squares over experiments, for many selections of the same columns."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.search.active_set import bounded

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Products:
    """Products of columns with each other and with the errors, the last column.

    Attributes:
        gram: products, shape (experiments, columns + 1, columns + 1).
        low: lower bounds of the coefficients, shape (columns,).
        high: upper bounds of the coefficients, shape (columns,).
        precision: inverse variance of the coefficients' prior around zero, shape (columns,), or scalar 0.
    """

    gram: Array
    low: Array
    high: Array
    precision: Array | float = 0.0

    @classmethod
    def of(
        cls,
        columns: Array,
        r: Array,
        starts: Array,
        moved: Array,
        owner: Indices,
        bounds: tuple[Array, Array],
    ) -> Products:
        """Return the products of weighted errors of windows, with their initial states eliminated.

        Args:
            columns: change of the errors per unit of the coefficients, shape (windows, columns, samples).
            r: errors, shape (windows, samples).
            starts: change by the initial states, shape (windows, states, samples), in units of their noise.
            moved: corrections of the initial states, shape (windows, states).
            owner: number of the experiment, shape (windows,).
            bounds: lowest and highest coefficients, shape (columns,) each.
        """
        half = np.linalg.inv(np.linalg.cholesky(starts @ starts.swapaxes(1, 2) + np.eye(starts.shape[1])))
        rows = np.concatenate([columns, r[:, None]], axis=1)
        across = rows @ starts.swapaxes(1, 2)
        across[:, -1] += moved
        follow = across @ half.swapaxes(1, 2)
        each = rows @ rows.swapaxes(1, 2) - follow @ follow.swapaxes(1, 2)
        each[:, -1, -1] += np.sum(moved**2, axis=1)
        mine = np.equal.outer(np.unique(owner), owner).astype(np.float64)
        gram = (mine @ each.reshape(len(owner), -1)).reshape(-1, *each.shape[1:])
        return cls(gram, *bounds)

    def only(self, shared: int, members: Indices | None = None) -> Products:
        """Restrict the columns after the first `shared` to some experiments.

        Args:
            shared: number of columns of all experiments.
            members: numbers of the experiments, shape (members,), default all.
        """
        if members is None:
            return self
        gram = self.gram.copy()
        others = np.setdiff1d(np.arange(len(gram)), members)
        gram[others, shared:-1] = 0.0
        gram[others, :, shared:-1] = 0.0
        return replace(self, gram=gram)

    def split(self, shared: int) -> Products:
        """Return products with a coefficient per experiment for each column after the first `shared`.

        Args:
            shared: number of columns of all experiments.
        """
        count, k = len(self.gram), len(self.low) - shared
        size = shared + k * count
        gram = np.zeros((count, size + 1, size + 1))
        for i in range(count):
            at = np.array([*range(shared), *range(shared + i * k, shared + (i + 1) * k), size])
            gram[i][np.ix_(at, at)] = self.gram[i]
        low, high = (np.concatenate([b[:shared], np.tile(b[shared:], count)]) for b in (self.low, self.high))
        return Products(gram, low, high)

    def solved(self, leave_out: Indices | None = None) -> tuple[Array, float]:
        """Solve the least squares of some experiments by a primal active-set method.

        It starts from the coefficients zero, which the bounds must admit.

        Args:
            leave_out: numbers of the experiments to leave out, shape (left out,), default none.

        Returns:
            Coefficients, shape (columns,), and the fall of half the sum of squares.
        """
        gram = self.gram.sum(0)
        if leave_out is not None:
            gram = gram - self.gram[leave_out].sum(0)
        H, g = gram[:-1, :-1] + np.diag(np.broadcast_to(self.precision, len(self.low))), gram[:-1, -1].copy()
        d = bounded(H, g, self.low, self.high)
        return d, float(-(g @ d + 0.5 * d @ H @ d))

    def gain(self, folds: int) -> float:
        """Return the cross-validated fall of half the sum of squares, over experiments.

        A single experiment has no others; its own coefficients are used.

        Args:
            folds: largest number of folds.
        """
        # in no order, as levels of a factor often take turns
        experiments = np.random.default_rng(0).permutation(len(self.gram))
        if len(experiments) < 2:
            return self.solved()[1]
        total = 0.0
        for fold in range(min(folds, len(experiments))):
            mine = experiments[fold::folds]
            d, _ = self.solved(mine)
            gram = self.gram[mine].sum(0)
            total -= float(gram[:-1, -1] @ d + 0.5 * d @ gram[:-1, :-1] @ d)
        return total
