"""Estimate the most likely parameter distribution by each method (section 3.4.2)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from unmodelled.base.arrays import Array
from unmodelled.learning.uncertainty.setup import Setup
from unmodelled.uncertainty.identify import Identification, identify
from unmodelled.uncertainty.likelihood import at_data, objective, tail_floor
from unmodelled.uncertainty.methods import PUSH_FORWARD
from unmodelled.uncertainty.replicate import replicate
from unmodelled.uncertainty.sampling import data_sets
from unmodelled.uncertainty.surface import ResponseSurface

Objective = Callable[[Array], Array]

#: Starts of the least squares along every parameter.
STARTS = 5


@dataclass(frozen=True)
class Estimator:
    """Likelihoods of data under an interpolated response of L outputs to n parameters."""

    setup: Setup
    surface: ResponseSurface

    @property
    def bounds(self) -> Array:
        """Bounds of the distribution parameters, shape (2 n, 2)."""
        return self.setup.bounds(self.surface)

    @property
    def floor(self) -> Array:
        """Smallest log-density per output, shape (L,); see `tail_floor`."""
        return tail_floor(self.surface.spans, self.setup.tail)

    def likelihood(self, method: str, y: Array) -> Objective:
        """Return the log-likelihoods (B,) of outputs y (L,) as a function of distributions (B, 2 n)."""
        if method == PUSH_FORWARD:
            observed, families = self.surface.at(y), self.setup.families(self.surface)
            return objective(lambda alphas: observed.log_density(families, alphas), self.floor)
        return objective(at_data(self.setup.propagations(self.surface)[method], y), self.floor)

    def identify(self, method: str, y: Array, seed: int, description: str | None = None) -> Identification:
        """Search the distribution parameters with the largest likelihood of outputs y (L,)."""
        return identify(self.likelihood(method, y), self.bounds, self.setup.search, seed, description)

    def draw(self, alpha: Array, count: int, seed: int) -> Array:
        """Draw data sets (count, L) from the model with distribution parameters (n, 2)."""
        families, outputs = self.setup.families(self.surface), len(self.surface.spans)
        generator = np.random.default_rng([seed, outputs])
        return data_sets(self.surface, families, alpha, outputs, count, generator)

    def identify_all(self, method: str, drawn: Array, seed: int, workers: int) -> list[Identification]:
        """Search the distribution parameters of data sets (B, L), several searches side by side."""
        description = f"{method.replace('_', ' ')}: {len(drawn)} data sets"
        return replicate([*drawn], lambda y, own: self.identify(method, y, own), seed, workers, description)


def least_squares(surface: ResponseSurface, y: Array) -> Array:
    """Return the constant parameters (n,) with the least squared error over all outputs (L,), eq. 3.1."""
    low, high = surface.bounds.T
    shares = (np.arange(STARTS) + 0.5) / STARTS
    grid = np.stack(np.meshgrid(*[shares] * len(low), indexing="ij"), axis=-1).reshape(-1, len(low))

    def squares(share: Array) -> float:
        inside = np.clip(share, 0.0, 1.0)
        return float(np.mean((surface((low + inside * (high - low))[None])[0] - y) ** 2))

    start = min(grid, key=squares)
    found = minimize(squares, start, method="Nelder-Mead", bounds=[(0.0, 1.0)] * len(low))
    return np.asarray(low + np.clip(found.x, 0.0, 1.0) * (high - low))
