"""Log-likelihoods whose shape is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from unmodelled.uncertainty.ascent import Objective

Array = NDArray[np.float64]
COUNT = 60
SAMPLE = np.random.default_rng(4).normal(0.9, 0.05, COUNT)
MEAN, STD = float(SAMPLE.mean()), float(SAMPLE.std())
BOX = np.array([[0.7, 1.3], [0.005, 0.3]])
UNIT_CUBE = np.array([[0.0, 1.0]] * 3)
COVARIANCE = np.array([[4.0, -2.4, 0.5], [-2.4, 2.5, 0.3], [0.5, 0.3, 1.0]]) * 1e-3
CENTRE = np.array([0.5, 0.45, 0.6])


def gaussian(alphas: Array) -> Array:
    """Log-likelihood of the sample under a mean and a standard deviation, without its constant."""
    mu, sigma = alphas.T
    return -COUNT * (np.log(sigma) + 0.5 * (STD**2 + (mu - MEAN) ** 2) / sigma**2)


def parabola(alphas: Array) -> Array:
    """Log-likelihood of a normal distribution around `CENTRE`."""
    away = alphas - CENTRE
    return -0.5 * np.einsum("bi,ij,bj->b", away, np.linalg.inv(COVARIANCE), away)


def ridge(alphas: Array) -> Array:
    """The first two parameters enter by their sum only; the last has no effect."""
    return -0.5 * ((alphas[:, 0] + alphas[:, 1] - 1.0) / 0.01) ** 2


def rough(objective: Objective) -> Objective:
    """The same with a ripple of 1e-6 that is finer than any step."""
    return lambda alphas: objective(alphas) + 1e-6 * np.sin(1e7 * alphas.sum(1))


def two_hills(alphas: Array) -> Array:
    """A lower maximum at 0.3, a shallow valley, a higher maximum at 0.7; the second parameter is plain."""
    x, y = alphas.T
    hills = np.exp(-0.5 * ((x - 0.3) / 0.1) ** 2) + 3.0 * np.exp(-0.5 * ((x - 0.7) / 0.1) ** 2)
    return np.log(hills) - 0.5 * ((y - 0.5) / 0.05) ** 2
