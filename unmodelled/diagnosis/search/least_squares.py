"""Bounded least squares over experiments, for many selections of the same columns."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

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


@dataclass(frozen=True)
class Columns:
    """Weighted columns of windows, with the initial states eliminated, that candidates share.

    Attributes:
        rows: columns and the errors, the last row, shape (windows, columns + 1, samples).
        basis: orthonormal changes by the initial states, shape (windows, states, samples), with their prior.
        along: components of `rows` along `basis`, shape (windows, columns + 1, states).
        moved: sum of squares, shape (windows,), of the corrections of the initial states.
        mine: 1 where a window is of an experiment, shape (experiments, windows), else 0.
        bounds: lowest and highest coefficients, shape (2, columns).
    """

    rows: Array
    basis: Array
    along: Array
    moved: Array
    mine: Array
    bounds: Array

    @classmethod
    def of(
        cls, columns: Array, r: Array, starts: Array, moved: Array, owner: Indices, bounds: Array
    ) -> Columns:
        """Eliminate the initial states of windows.

        Args:
            columns: change of the errors per unit of the coefficients, shape (windows, columns, samples).
            r: errors, shape (windows, samples).
            starts: change by the initial states, shape (windows, states, samples), in units of their noise.
            moved: corrections of the initial states, shape (windows, states).
            owner: number of the experiment, shape (windows,).
            bounds: lowest and highest coefficients, shape (2, columns).
        """
        half = np.linalg.inv(np.linalg.cholesky(starts @ starts.swapaxes(1, 2) + np.eye(starts.shape[1])))
        rows, basis = np.concatenate([columns, r[:, None]], axis=1), half @ starts
        along = rows @ basis.swapaxes(1, 2)
        along[:, -1] += (half @ moved[:, :, None])[:, :, 0]
        mine = np.equal.outer(np.unique(owner), owner).astype(np.float64)
        return cls(rows, basis, along, np.sum(moved**2, axis=1), mine, bounds)

    @cached_property
    def alone(self) -> Products:
        """Return the products of the columns alone."""
        own = self.rows @ self.rows.swapaxes(1, 2) - self.along @ self.along.swapaxes(1, 2)
        own[:, -1, -1] += self.moved
        return Products(self._summed(own), *self.bounds)

    def beside(self, further: Array, bounds: Array) -> Iterator[Products]:
        """Yield the products of these columns and of further ones, for every set of further ones.

        Args:
            further: change of the errors per unit, shape (windows, sets, n, samples).
            bounds: lowest and highest coefficients, shape (2, sets, n).
        """
        count, sets, n, samples = further.shape
        flat = further.reshape(count, sets * n, samples)
        along = flat @ self.basis.swapaxes(1, 2)
        across = self._summed(self.rows @ flat.swapaxes(1, 2) - self.along @ along.swapaxes(1, 2))
        along = along.reshape(count, sets, n, along.shape[2])
        own = self._summed(further @ further.swapaxes(2, 3) - along @ along.swapaxes(2, 3))
        shared, whole = self.alone.gram, len(self.rows[0]) - 1
        at, new = np.array([*range(whole), whole + n]), np.arange(whole, whole + n)
        for k in range(sets):
            gram = np.empty((len(shared), whole + n + 1, whole + n + 1))
            gram[:, at[:, None], at] = shared
            gram[:, new[:, None], new] = own[:, k]
            gram[:, at[:, None], new] = across[:, :, k * n : (k + 1) * n]
            gram[:, new[:, None], at] = across[:, :, k * n : (k + 1) * n].swapaxes(1, 2)
            yield Products(gram, *np.concatenate([self.bounds, bounds[:, k]], axis=1))

    def _summed(self, each: Array) -> Array:
        """Sum (experiments, ...) over the windows of every experiment."""
        return np.asarray((self.mine @ each.reshape(len(each), -1)).reshape(-1, *each.shape[1:]))
