"""Least squares with bounds over experiments, for very many selections of the same columns."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Relative to the curvature: keeps columns that are alike apart, and says which of them is not there at all.
RIDGE, UNSEEN = 1e-9, 1e-12
#: Times per column that a bound is met or left at most.
MOVES = 4


@dataclass(frozen=True)
class Products:
    """Of columns with each other and with the errors, which are the last column.

    Attributes:
        gram: (experiments, columns + 1, columns + 1). low, high: (columns,) bounds of the coefficients.
        precision: (columns,) inverse variance of a prior of the coefficients around zero, or 0.
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
        """Of weighted errors of windows whose starts go along with the columns.

        Args:
            columns: (windows, columns, samples) change of the errors per unit of the coefficients.
            r: (windows, samples) the errors.
            starts: (windows, states, samples) change by the starts, in units of their spread.
            moved: (windows, states) by how much they are moved so far.
            owner: (windows,) number of the experiment. bounds: of the coefficients, (columns,) each.
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
        """Columns after the first `shared` only count in the experiments `members`, all unless given."""
        if members is None:
            return self
        gram = self.gram.copy()
        others = np.setdiff1d(np.arange(len(gram)), members)
        gram[others, shared:-1] = 0.0
        gram[others, :, shared:-1] = 0.0
        return replace(self, gram=gram)

    def split(self, shared: int) -> Products:
        """With a coefficient for every experiment in place of each column after the first `shared`."""
        count, k = len(self.gram), len(self.low) - shared
        size = shared + k * count
        gram = np.zeros((count, size + 1, size + 1))
        for i in range(count):
            at = np.array([*range(shared), *range(shared + i * k, shared + (i + 1) * k), size])
            gram[i][np.ix_(at, at)] = self.gram[i]
        low, high = (np.concatenate([b[:shared], np.tile(b[shared:], count)]) for b in (self.low, self.high))
        return Products(gram, low, high)

    def solved(self, leave_out: Indices | None = None) -> tuple[Array, float]:
        """Coefficients (columns,) from some experiments, and by how much half their sum of squares falls.

        A primal active-set method, from the coefficients zero, which the bounds must admit.
        """
        gram = self.gram.sum(0)
        if leave_out is not None:
            gram = gram - self.gram[leave_out].sum(0)
        H, g = gram[:-1, :-1] + np.diag(np.broadcast_to(self.precision, len(self.low))), gram[:-1, -1]
        diagonal = np.diag(H)
        seen = diagonal > UNSEEN * max(diagonal.max(initial=0.0), 1e-300)
        unit = 1.0 / np.sqrt(np.where(seen, diagonal, 1.0))
        scaled = H * unit * unit[:, None] + RIDGE * np.eye(len(g))
        d, free = np.zeros(len(g)), seen.copy()
        for _ in range(MOVES * len(g)):
            k = np.flatnonzero(free)
            rest = unit[k] * (g[k] + H[k][:, ~free] @ d[~free])
            step = -unit[k] * np.linalg.solve(scaled[np.ix_(k, k)], rest) - d[k]
            with np.errstate(divide="ignore", invalid="ignore"):
                room = np.where(step > 0.0, self.high[k] - d[k], self.low[k] - d[k]) / step
            room = np.where(step == 0.0, 1.0, room)
            first = int(np.argmin(room)) if len(k) else 0
            if len(k) and room[first] < 1.0:
                d[k] += max(room[first], 0.0) * step
                d[k[first]] = self.high[k[first]] if step[first] > 0.0 else self.low[k[first]]
                free[k[first]] = False
                continue
            d[k] += step
            slope = unit * (g + H @ d)
            pulled = np.where(d <= self.low, -slope, slope) * (seen & ~free & (self.low < self.high))
            if pulled.max(initial=0.0) <= RIDGE * np.abs(unit * g).max(initial=0.0):
                break
            free[int(np.argmax(pulled))] = True
        return d, float(-(g @ d + 0.5 * d @ H @ d))

    def gain(self, folds: int) -> float:
        """By how much half the sum of squares falls where the coefficients come from other experiments.

        A single experiment has no others: its own coefficients have to do.
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
