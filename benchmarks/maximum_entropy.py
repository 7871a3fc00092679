"""Densities from four moments: Newton in compiled code against BFGS of scipy on the same dual problem."""

from __future__ import annotations

from functools import partial

import numpy as np
import scipy
from numpy.polynomial.hermite_e import hermeval
from scipy.optimize import minimize
from scipy.special import factorial, roots_legendre
from scipy.stats import beta

from benchmarks.timing import side_by_side
from unmodelled.base.arrays import Array
from unmodelled.uncertainty.density import REACH
from unmodelled.uncertainty.maximum_entropy import MaximumEntropy

PEER = f"scipy {scipy.__version__}, optimize.minimize, BFGS"
OUTPUTS, MOMENTS = 108, 4
NODES, WEIGHTS = (REACH * a for a in roots_legendre(64))  # as many as ours begins with
#: Hermite polynomials that are orthonormal under the start, which spares BFGS most of its iterations.
ORTHONORMAL = np.diag(factorial(np.arange(MOMENTS + 1)) ** -0.5)
BASIS = hermeval(NODES, ORTHONORMAL)[1:].T
LOG_WEIGHTS = np.log(WEIGHTS) - 0.5 * NODES**2


def run() -> dict[str, float]:
    """108 fits with four moments of beta distributions, 8 standard deviations to either side, one thread."""
    moments = problem()
    mean, std = np.zeros(OUTPUTS), np.ones(OUTPUTS)
    check_same_work(MaximumEntropy.fit(mean, std, moments), moments)
    ours = partial(MaximumEntropy.fit, mean, std, moments)
    return {**side_by_side(ours, lambda: [bfgs(m) for m in moments.T]), "threads": 1}


def problem() -> Array:
    """(4, 108) standardised moments, from nearly Gaussian to skewed and flat-topped."""
    a, b = np.random.default_rng(0).uniform(1.5, 10.0, (2, OUTPUTS))
    skewness, excess = beta.stats(a, b, moments="sk")
    return np.stack([np.zeros(OUTPUTS), np.ones(OUTPUTS), skewness, 3.0 + excess])


def masses(c: Array) -> tuple[float, Array]:
    """Of the nodes, over exp(top), not normalised."""
    exponent = LOG_WEIGHTS + BASIS @ c
    top = float(exponent.max())
    return top, np.exp(exponent - top)


def bfgs(moments: Array) -> Array:
    """The dual's solution in the Hermite basis, times the standard normal density that it starts from."""
    m3, m4 = moments[2:]
    target = np.array([0.0, 0.0, m3, m4 - 3.0]) * np.diag(ORTHONORMAL)[1:]

    def dual(c: Array) -> tuple[float, Array]:
        top, q = masses(c)
        return top + float(np.log(q.sum()) - c @ target), q @ BASIS / q.sum() - target

    solution: Array = minimize(dual, np.zeros(MOMENTS), jac=True, method="BFGS", options={"gtol": 1e-8}).x
    return solution


def check_same_work(ours: MaximumEntropy, moments: Array) -> None:
    """Both find the same densities."""
    assert not ours.fallback.any()
    for l, c in enumerate(np.stack([bfgs(m) for m in moments.T])):
        _, q = masses(c)
        own = np.exp(np.polynomial.polynomial.polyval(NODES, ours.coefficients[:, l]))
        np.testing.assert_allclose(own, q / q.sum() / WEIGHTS, atol=1e-5)
