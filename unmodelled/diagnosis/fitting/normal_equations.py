"""Normal equations of a fit in which the initial state of every window is unknown too.

An initial state affects its own window only, and is eliminated there (Schur complement).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array, Indices

#: Relative curvature below which the data do not determine an unknown: a few thousand roundings.
LEAST_CURVATURE = 1e-12
#: Relative singular value below which a direction is not moved along, for the same reason.
RANK = 1e-12


@dataclass(frozen=True)
class NormalEquations:
    """Products of derivatives and residuals."""

    #: Products of q = unknowns + states + 1 columns: derivatives by the unknowns and by the initial states in
    #: units of their noise, and the residual; with the prior of the initial states.
    gram: Array  # (windows, q, q)
    entry: Indices  # entry of an unknown in the vector, (windows, unknowns)
    precision: Array  # inverse variance of the vector's prior around zero, (size,)

    @classmethod
    def of(
        cls, r: Array, slopes: Array, weights: Array, moved: Array, entry: Indices, precision: Array
    ) -> NormalEquations:
        """Return the products of residuals and derivatives; `moved` (windows, states) in units of noise."""
        rows = np.concatenate([slopes, r[:, None]], axis=1).reshape(len(r), slopes.shape[1] + 1, -1)
        gram = (rows * weights.reshape(len(r), 1, -1)) @ rows.swapaxes(1, 2)
        first, states = entry.shape[1], moved.shape[1]
        inner = np.arange(first, first + states)
        gram[:, inner, inner] += 1.0
        gram[:, inner, -1] += moved
        gram[:, -1, inner] += moved
        return cls(gram, entry, precision)

    def reduced(self, damping: float = 0.0) -> tuple[Array, Array, Array]:
        """Eliminate initial states: curvature (windows, unknowns, unknowns), gradient, how states follow."""
        n = self.entry.shape[1]
        inner = self.gram[:, n:-1, n:-1]
        damped = inner + damping * np.eye(inner.shape[1]) * inner
        across = self.gram[:, n:-1, [*range(n), -1]]
        follow = np.asarray(-np.linalg.solve(damped, across), np.float64)
        outer = self.gram[:, :n, [*range(n), -1]] + across[:, :, :n].swapaxes(1, 2) @ follow
        return outer[:, :, :n], outer[:, :, n], follow

    def summed(self, curvature: Array, gradient: Array) -> tuple[Array, Array]:
        """Sum curvature (windows, unknowns, unknowns) and gradient over windows: (size, size) and (size,)."""
        size, entry = len(self.precision), self.entry
        pairs = entry[:, :, None] * size + entry[:, None, :]
        H: Array = np.bincount(pairs.ravel(), curvature.ravel(), size * size).astype(np.float64)
        g: Array = np.bincount(entry.ravel(), gradient.ravel(), size).astype(np.float64)
        return H.reshape(size, size), g

    def step(self, damping: float, z: Array, bounds: tuple[Array, Array]) -> tuple[Array, Array]:
        """Return the vector (size,) after a damped step within bounds, and steps (windows, states)."""
        curvature, gradient, follow = self.reduced(damping)
        H, g = self.summed(curvature, gradient)
        H, g = H + np.diag(self.precision), g + self.precision * z
        diagonal = np.diag(H)
        low, high = bounds
        free = diagonal > LEAST_CURVATURE * diagonal.max(initial=0.0)
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
        """Estimate the covariance (size, size) of the vector; inf where the data do not determine an unknown.

        It comes from the scatter of the windows' gradients (sandwich estimator): errors of one window depend
        on each other, those of two windows do not.
        """
        curvature, gradient, _ = self.reduced()
        H = self.summed(curvature, gradient)[0] + np.diag(self.precision)
        scatter = np.zeros((len(gradient), len(H)))
        np.add.at(scatter, (np.arange(len(gradient))[:, None], self.entry), gradient)
        diagonal = np.diag(H)
        seen = diagonal > LEAST_CURVATURE * diagonal.max(initial=0.0)
        result = np.diag(np.where(seen, 0.0, np.inf))
        if seen.any():
            unit = 1.0 / np.sqrt(diagonal[seen])
            unit = unit * unit[:, None]
            inverse = unit * np.linalg.pinv(H[np.ix_(seen, seen)] * unit, rcond=RANK, hermitian=True)
            # a square, so that rounding makes no variance negative
            half = scatter[:, seen] @ inverse
            result[np.ix_(seen, seen)] = half.T @ half
        return result
