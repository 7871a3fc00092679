"""Every experiment left out once: the numbers of the others by one Newton step, and how they predict it.

Products are sums over experiments, so that one is left out by a subtraction, exact where the model is linear.
The experiment that is left out keeps its starts and its own deviations, as a prediction of a new one does.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from unmodelled.base.arrays import Array, Indices
from unmodelled.diagnosis.judge.elimination import newton_step
from unmodelled.diagnosis.judge.linear import Linearised
from unmodelled.diagnosis.judge.tails import log_densities, scale

#: Draws of the weights of experiments for the probabilities of laws.
DRAWS, SEED = 4000, 0


@dataclass(frozen=True, eq=False)
class LeftOutRuns:
    """Predictions of experiments by fits to the others."""

    square: Array  # weighted squared residual when its experiment is left out, (windows, outputs)
    fitted: Array  # the same when it is not, (windows, outputs)
    samples: Array  # independent samples, (windows, outputs)
    owner: Indices  # experiments of the windows, (windows,)
    price: Array  # nats that starts and deviations of an experiment that is left out cost, (experiments,)
    steps: Array  # of the open numbers in fits to the others, (experiments, open), in plausible sizes

    @classmethod
    def of(cls, around: Linearised) -> LeftOutRuns:
        """Leave out every experiment of a fit once, at the likeliest size of deviations."""
        products = around.bare[around.sigma]
        several = len(products.each) > 1
        steps = np.array([newton_step(around.normal - several * own) for own in products.each])
        square, penalty = around.after(steps, around.sigma)
        fitted, _ = around.settled
        price = 0.5 * penalty + products.price
        return cls(square, fitted, around.weights.each, around.of_windows, price, steps)

    def _sums(self, each: Array) -> Array:
        """Sums over the windows of every experiment."""
        return np.asarray(np.bincount(self.owner, each.sum(axis=1), len(self.price)), float)

    @property
    def by_run(self) -> Array:
        """Return weighted squared residuals of experiments that are left out, (experiments,)."""
        return self._sums(self.square)

    @property
    def worse(self) -> Array:
        """Return how many times larger each residual, (experiments,), is when it is left out; at least 1."""
        ratio = self.by_run / np.maximum(self._sums(self.fitted), 1e-300)
        return np.asarray(np.sqrt(np.maximum(ratio, 1.0)))

    @cached_property
    def log_scores(self) -> Array:
        """Return the log densities, shape (experiments,), of experiments left out, in nats.

        The scale is that of the other experiments, so that a law that fails in one of them pays for it.
        """
        found = np.zeros(len(self.price))
        for run in range(len(found)):
            mine = self.owner == run
            others = ~mine if len(found) > 1 else mine
            usual = scale(self.fitted[others], self.samples[others])
            found[run] = log_densities(self.square[mine], self.samples[mine], usual).sum()
        return found - self.price


def probabilities(scores: Array) -> Array:
    """Return the probabilities of hypotheses (hypotheses,) from log scores (hypotheses, experiments).

    Weights of the experiments are drawn (Bayesian bootstrap), so that what a few experiments say alone counts
    little: pseudo-Bayesian model averaging by Yao, Vehtari, Simpson and Gelman (2018).
    """
    count = scores.shape[1]
    drawn = np.random.default_rng(SEED).dirichlet(np.ones(count), DRAWS) * count
    total = drawn @ scores.T
    weight = np.exp(total - total.max(axis=1, keepdims=True))
    return np.asarray((weight / weight.sum(axis=1, keepdims=True)).mean(axis=0))
