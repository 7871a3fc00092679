"""Every experiment left out once: the numbers of the others by one Newton step, and how they predict it.

Products are sums over experiments, so that one is left out by a subtraction, exact where the model is linear.
The experiment that is left out keeps its starts and its own deviations, as a prediction of a new one does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.judge.elimination import newton_step
from unmodelled.diagnosis.judge.linear import Linearised

#: Draws of the weights of experiments for the probabilities of laws.
DRAWS, SEED = 4000, 0


@dataclass(frozen=True, eq=False)
class LeftOutRuns:
    """Predictions of experiments by fits to the others."""

    square: Array  # weighted squared residual when it is left out, (experiments, outputs)
    fitted: Array  # the same when it is not, (experiments, outputs)
    samples: Array  # independent samples, (experiments, outputs)
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
        root, owner = around.weights.root, around.columns.path.owner
        own = np.array([(root[owner == run] ** 2).sum(axis=(0, 1)) for run in around.runs])
        share = own / np.maximum(own.sum(axis=0), 1e-300)
        return cls(square, fitted, share * around.weights.each, 0.5 * penalty + products.price, steps)

    @property
    def worse(self) -> Array:
        """Return how many times larger each residual, (experiments,), is when it is left out; at least 1."""
        ratio = self.square.sum(axis=1) / np.maximum(self.fitted.sum(axis=1), 1e-300)
        return np.asarray(np.sqrt(np.maximum(ratio, 1.0)))

    @property
    def log_scores(self) -> Array:
        """Return the log densities, shape (experiments,), of experiments left out, in nats.

        The variance is that of the other experiments, so that a law that fails in one of them pays for it.
        """
        others = (self.fitted.sum(axis=0) - self.fitted) / np.maximum(
            self.samples.sum(axis=0) - self.samples, 1e-300
        )
        alone = self.fitted / np.maximum(self.samples, 1e-300)
        variance = np.maximum(others if len(self.fitted) > 1 else alone, 1e-300)
        each = -0.5 * self.samples * np.log(variance) - 0.5 * self.square / variance
        return np.asarray(each.sum(axis=1) - self.price)


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
