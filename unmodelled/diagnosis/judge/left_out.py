"""Every experiment left out once: the numbers of the others by one Newton step, and how they predict it.

Products are sums over experiments, so that one is left out by a subtraction, exact where the model is linear.
The experiment that is left out keeps its starts and its own deviations, as a prediction of a new one does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.judge.linear import Linearised

#: Draws of the weights of experiments for the probabilities of laws.
DRAWS, SEED = 4000, 0


@dataclass(frozen=True, eq=False)
class LeftOutRuns:
    """Predictions of experiments by fits to the others."""

    square: Array  # weighted squared residual of each when it is left out, (experiments,)
    fitted: Array  # the same when it is not, (experiments,)
    samples: Array  # independent samples, (experiments,)
    steps: Array  # of the open numbers in fits to the others, (experiments, open), in plausible sizes

    @classmethod
    def of(cls, around: Linearised) -> LeftOutRuns:
        """Leave out every experiment of a fit once, at the likeliest size of deviations."""
        none = np.empty((*around.columns.path.error.shape, 0))
        products = around.products(none)
        each = products[around.sigma].each
        total, prior, q = each.sum(axis=0), around.prior, around.opened
        others = [total - own if len(each) > 1 else own for own in each]
        steps, whole = [_step(one + prior, q) for one in others], _step(total + prior, q)
        square = [_after(own, step) for own, step in zip(each, steps, strict=True)]
        fitted = [_after(own, whole) for own in each]
        root, owner = around.weights.root, around.columns.path.owner
        weight = (root**2).sum(axis=(1, 2)) / (root**2).sum()
        samples = np.array([weight[owner == run].sum() for run in around.runs]) * around.weights.samples
        return cls(np.array(square), np.array(fitted), samples, np.array(steps))

    @property
    def log_scores(self) -> Array:
        """Return the log densities, shape (experiments,), of experiments left out, in nats.

        The variance is that of the other experiments, so that a law that fails in one of them pays for it.
        """
        others = (self.fitted.sum() - self.fitted) / np.maximum(self.samples.sum() - self.samples, 1e-300)
        variance = np.maximum(others if len(self.fitted) > 1 else self.fitted / self.samples, 1e-300)
        return np.asarray(-0.5 * self.samples * np.log(variance) - 0.5 * self.square / variance)


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


def _step(products: Array, q: int) -> Array:
    """Step (q,) of the open numbers by products [open | residual]."""
    return np.asarray(np.linalg.solve(products[:q, :q], products[:q, q]))


def _after(own: Array, step: Array) -> float:
    """Squared residual of an experiment after a step of the open numbers."""
    q = len(step)
    return float(own[q, q] - 2.0 * step @ own[:q, q] + step @ own[:q, :q] @ step)
