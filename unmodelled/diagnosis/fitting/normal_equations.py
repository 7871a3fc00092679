"""Normal equations of a fit in which the states at the start of every window are unknown too.

A start touches its own window only, so that the starts are eliminated window by window (Schur complement).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Curvature below this, relative to the largest, says that data do not know an unknown.
UNSEEN = 1e-12
#: Directions that are so much flatter than the steepest one are left alone.
RANK = 1e-12


@dataclass(frozen=True)
class NormalEquations:
    """Products of derivatives and residuals.

    Attributes:
        gram: (windows, q, q) of the q = unknowns + states + 1 columns: derivatives by the unknowns, by the
            states at the start in units of their noise, and the residual. The starts' own spread is in there.
        entry: (windows, unknowns) where an unknown stands in the vector.
        precision: (size,) inverse variance around zero of the vector's prior.
    """

    gram: Array
    entry: Indices
    precision: Array

    @classmethod
    def of(
        cls, r: Array, slopes: Array, weights: Array, moved: Array, entry: Indices, precision: Array
    ) -> NormalEquations:
        """From residuals and weights (windows, ...), slopes (windows, unknowns + states, ...), and how far
        the starts are moved (windows, states).
        """
        rows = np.concatenate([slopes, r[:, None]], axis=1).reshape(len(r), slopes.shape[1] + 1, -1)
        gram = (rows * weights.reshape(len(r), 1, -1)) @ rows.swapaxes(1, 2)
        first, states = entry.shape[1], moved.shape[1]
        inner = np.arange(first, first + states)
        gram[:, inner, inner] += 1.0
        gram[:, inner, -1] += moved
        gram[:, -1, inner] += moved
        return cls(gram, entry, precision)

    def reduced(self, damping: float = 0.0) -> tuple[Array, Array, Array]:
        """Without the starts: curvature (windows, unknowns, unknowns), gradient (windows, unknowns), and how
        the starts follow (windows, states, unknowns + 1) the unknowns and on their own."""
        n = self.entry.shape[1]
        inner = self.gram[:, n:-1, n:-1]
        damped = inner + damping * np.eye(inner.shape[1]) * inner
        across = self.gram[:, n:-1, [*range(n), -1]]
        follow = np.asarray(-np.linalg.solve(damped, across), np.float64)
        outer = self.gram[:, :n, [*range(n), -1]] + across[:, :, :n].swapaxes(1, 2) @ follow
        return outer[:, :, :n], outer[:, :, n], follow

    def summed(self, curvature: Array, gradient: Array) -> tuple[Array, Array]:
        """Curvature (size, size) and gradient (size,) of the whole vector, without its prior."""
        size = len(self.precision)
        H, g = np.zeros((size, size)), np.zeros(size)
        np.add.at(H, (self.entry[:, :, None], self.entry[:, None, :]), curvature)
        np.add.at(g, self.entry, gradient)
        return H, g

    def step(self, damping: float, z: Array, bounds: tuple[Array, Array]) -> tuple[Array, Array]:
        """Where the vector goes, within its bounds, and by how much the starts move (windows, states)."""
        curvature, gradient, follow = self.reduced(damping)
        H, g = self.summed(curvature, gradient)
        H, g = H + np.diag(self.precision), g + self.precision * z
        diagonal = np.diag(H)
        low, high = bounds
        free = diagonal > UNSEEN * diagonal.max(initial=0.0)
        while True:
            free &= ~((z <= low) & (g > 0.0)) & ~((z >= high) & (g < 0.0))
            step = np.zeros_like(z)
            if free.any():
                unit = 1.0 / np.sqrt(diagonal[free])
                A = H[np.ix_(free, free)] * unit * unit[:, None] + damping * np.eye(free.sum())
                step[free] = -unit * np.linalg.lstsq(A, unit * g[free], rcond=RANK)[0]
            out = free & (((z <= low) & (step < 0.0)) | ((z >= high) & (step > 0.0)))
            if not out.any():
                break
            free &= ~out
        there = np.clip(z + step, low, high)
        taken = (there - z)[self.entry]
        moves = (follow[:, :, :-1] @ taken[:, :, None])[:, :, 0] + follow[:, :, -1]
        return there, moves

    def covariance(self) -> Array:
        """(size, size) of the vector, from the scatter of the windows' gradients; inf where data do not tell.

        Errors of one window depend on each other, those of two windows do not (sandwich estimator).
        """
        curvature, gradient, _ = self.reduced()
        H = self.summed(curvature, gradient)[0] + np.diag(self.precision)
        scatter, _ = self.summed(gradient[:, :, None] * gradient[:, None, :], gradient)
        diagonal = np.diag(H)
        seen = diagonal > UNSEEN * diagonal.max(initial=0.0)
        result = np.diag(np.where(seen, 0.0, np.inf))
        if seen.any():
            unit = 1.0 / np.sqrt(diagonal[seen])
            unit = unit * unit[:, None]
            inverse = unit * np.linalg.pinv(H[np.ix_(seen, seen)] * unit, rcond=RANK, hermitian=True)
            result[np.ix_(seen, seen)] = inverse @ scatter[np.ix_(seen, seen)] @ inverse
        return result
