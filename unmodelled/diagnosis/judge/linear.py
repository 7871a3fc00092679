"""The evidence of a fit, and of columns that are added.

A residual counts as 1 / (its correlation time) samples. What is open around a fit is integrated out: the
determinant of its precision is a price (Laplace's approximation), so that freedom which the logs do not need
costs nothing and gains nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.columns.columns import Columns
from unmodelled.diagnosis.columns.path import Path
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.judge.elimination import SIGMAS, Elimination, Products, Reduced, newton_step
from unmodelled.diagnosis.judge.tails import log_densities, scale
from unmodelled.diagnosis.judge.weights import Weights

#: Standard errors up to which the mean of deviations is chance.
CHANCE = 2.0


@dataclass(frozen=True, eq=False)
class Linearised(Elimination):
    """A fit with everything that is open around it."""

    @classmethod
    def of(cls, fitted: FittedHypothesis, tau: float, weights: Weights | None = None) -> Linearised:
        """Linearise a fit around the path of its windows; the weights are its own unless some are given."""
        path = Path.of_windows(fitted, fitted.recording)
        return cls(fitted, Columns(path), weights or Weights.of(path), tau)

    def differing(self, column: Array, size: float) -> float:
        """Return the pooled evidence, nats, with a number that differs between experiments.

        Its column is (windows, K, outputs, 1), and `size` its plausible deviation in units of the column; the
        likeliest of some sizes counts.
        """
        return max(
            self.pooled(one, float(one.products[-1, -1]))
            for sigma, products in self.products(column).items()
            for one in (self._apart(sigma, products, size * share) for share in SIGMAS)
        )

    def _apart(self, sigma: float, products: Products, size: float) -> Reduced:
        """Products without their first column, which every experiment has for itself, and open numbers."""
        own, rest = products.each[:, 0], products.each[:, 1:, 1:]
        without = rest - own[:, 1:, None] * own[:, None, 1:] / (own[:, :1, None] + size**-2.0)
        price = products.price + 0.5 * np.log1p(size**2 * own[:, 0])
        return self.reduced({sigma: Products(without, price)})[sigma]

    @cached_property
    def _pooled(self) -> Mapping[float, float]:
        """Evidence of the fit by sigma, nats, all outputs alike."""
        return {s: self.pooled(one, one.products[-1, -1]) for s, one in self.reduced(self.bare).items()}

    @cached_property
    def bare(self) -> Mapping[float, Products]:
        """Return products of [open | residual] by sigma."""
        return self.products(np.empty((*self.columns.path.error.shape, 0)))

    @cached_property
    def normal(self) -> Array:
        """Return products (open + 1, open + 1) of [open | residual] with priors, of all experiments."""
        return np.asarray(self.bare[self.sigma].each.sum(axis=0) + self.prior)

    @cached_property
    def settled(self) -> tuple[Array, Array]:
        """Return squares (windows, outputs) and penalties after a step of the open numbers: `after`."""
        return self.after(np.tile(newton_step(self.normal), (len(self.runs), 1)), self.sigma)

    @cached_property
    def squares(self) -> Array:
        """Return weighted mean squares (3, outputs): with deviations of experiments, without; usual ones.

        What all experiments share is no deviation: a gain that is wrong in all of them is not explained by
        each having its own, and deviations have no mean beyond chance. A new experiment has deviations that
        nobody knows: a law that says which ones, such as a drift, makes the second row smaller. The third is
        that of the usual window: few windows that nothing predicts hide from it, and laws that act in few.
        """
        shared = np.tile(np.append(-newton_step(self.normal), 1.0), (len(self.runs), 1))
        own, (_, at, scaled) = self._moved(shared, self.sigma), self._own
        known = own - np.where(scaled, beyond_chance(at + own), 0.0)
        ours, new = self._without(known), self._without(np.where(scaled, -at, own))
        return np.stack([self._mean(ours), self._mean(new), scale(ours, self.weights.each)])

    def _without(self, own: Array) -> Array:
        """Weighted squares (windows, outputs) with some deviations (experiments, N); open numbers follow."""
        many = self.opened + 1
        chosen = np.zeros((len(own), self._by_run.shape[1], many))
        chosen[:, :many] = np.eye(many)
        chosen[:, many:, -1] = -own
        normal = np.einsum("rni,rnm,rmj->ij", chosen, self._by_run, chosen) + self.prior
        shared = np.tile(np.append(-newton_step(normal), 1.0), (len(self.runs), 1))
        return self._left(shared, own)[0]

    @property
    def pooled_of_fit(self) -> float:
        """Return the evidence of the fit, nats, if all outputs are explained alike."""
        return self._pooled[self.sigma]

    def pooled(self, reduced: Reduced, square: float) -> float:
        """Return the evidence, nats, if all outputs are explained alike: it chooses shapes and sizes."""
        least = max(square, 1e-12 * float(reduced.products[-1, -1]))
        return self.likelihood(least, reduced.price)

    @property
    def sigma(self) -> float:
        """Return the likeliest size of the deviations of experiments, in their plausible size."""
        return max(self._pooled, key=lambda sigma: self._pooled[sigma])

    @property
    def varies(self) -> bool:
        """Return whether experiments deviate: the likeliest size pays for itself beside the smallest."""
        return self._pooled[self.sigma] - self._pooled[SIGMAS[0]] > self.weights.price(1)

    @cached_property
    def evidence(self) -> float:
        """Return the evidence of the fit, nats, up to a constant of the weights."""
        return self._evidence(newton_step(self.normal), self.settled, self.sigma)

    def evidence_with(self, added: Array, step: Array, sigma: float) -> float:
        """Return the evidence, nats, with a change `added` (windows, K, outputs) of outputs, in sensor noise.

        It is there beside a step (open,) of the open numbers.
        """
        change = self._flat(-added[..., None])[..., 0]
        return self._evidence(step, self.after(np.tile(step, (len(self.runs), 1)), sigma, change), sigma)

    def _evidence(self, step: Array, after: tuple[Array, Array], sigma: float) -> float:
        """Evidence after a step of the open numbers; the noise of every output is unknown.

        Pooled, an output of which a law explains all would be hidden behind another one, of which there is
        nothing to explain.
        """
        squares, penalty = after
        moved = np.append(-step, 1.0)
        off = float(moved @ self.prior @ moved) + float(penalty.sum())
        price = float(self.bare[sigma].price.sum())
        each = self.weights.each
        return float(log_densities(squares, each, scale(squares, each)).sum() - 0.5 * off - price)

    def _mean(self, squares: Array) -> Array:
        """Weighted mean squares (outputs,) of (windows, outputs)."""
        each = self.weights.each.sum(axis=0)
        return np.asarray(np.maximum(squares.sum(axis=0), 1e-300) / np.maximum(each, 1e-300))

    def likelihood(self, square: float, price: float) -> float:
        """Return the log likelihood of a squared residual whose variance is unknown, less a price."""
        return -0.5 * self.weights.samples * float(np.log(max(square, 1e-300))) - price


def beyond_chance(deviations: Array) -> Array:
    """Return what of the means of deviations (experiments, N) is beyond `CHANCE` standard errors, (N,)."""
    mean, count = deviations.mean(axis=0), len(deviations)
    error = deviations.std(axis=0, ddof=1) / np.sqrt(count) if count > 1 else np.zeros_like(mean)
    return np.asarray(np.sign(mean) * np.maximum(np.abs(mean) - CHANCE * error, 0.0))
