"""Covariance of a maximum likelihood estimate, from the curvature of the log-likelihood."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.uncertainty.ascent import DEEP, Objective
from unmodelled.uncertainty.box import Box

#: First step of the second differences and the largest, as a share of the width of the bounds; steps are
#: refined until the log-likelihood falls by `DROP`: far above its noise, near enough for a parabola.
FIRST_STEP, LARGEST_STEP = 1e-3, 0.1
DROP = 0.05
REFINEMENTS = 3
#: Sharpness, in standard errors over the width of the bounds, that the bounds give by themselves.
BLUNT = np.sqrt(12.0)
#: Eigenvalue of the scaled Hessian below which a direction counts as flat; noise of 1e-6 stays below it.
SINGULAR = 1e-3


@dataclass(frozen=True)
class Curvature:
    """Second derivatives of the log-likelihood at an estimate, and the resulting normal approximation."""

    hessian: Array  # (k, k), of minus the log-likelihood (observed information); zero for fixed parameters
    #: (k, k); flat directions get the smallest curvature that counts, where a pseudo-inverse would hide them.
    covariance: Array
    std: Array  # (k,), standard errors
    correlation: Array  # (k, k)
    flat: Array  # (directions, k), of length 1 in standard errors, that leave the log-likelihood unchanged


def curvature(objective: Objective, bounds: Array, alpha: Array) -> Curvature:
    """Compute the curvature of a log-likelihood at an estimate (k,) by second differences.

    Next to a bound (k, 2) the differences are taken around the nearest point with enough room.
    """
    box = Box(np.asarray(bounds, float))
    free = np.flatnonzero(box.free)
    hessian = np.zeros((box.size, box.size))
    hessian[np.ix_(free, free)] = _hessian(objective, box, np.asarray(alpha, float))
    inverse, flat = _inverse(hessian[np.ix_(free, free)], np.ptp(box.bounds[free], axis=1))
    covariance = np.zeros_like(hessian)
    covariance[np.ix_(free, free)] = inverse
    std = np.sqrt(np.diag(covariance))
    scale = np.where(std > 0.0, std, 1.0)
    correlation = covariance / np.outer(scale, scale)
    np.fill_diagonal(correlation, 1.0)
    directions = np.zeros((len(flat), box.size))
    directions[:, free] = flat
    return Curvature(hessian, covariance, std, correlation, directions)


def _hessian(objective: Objective, box: Box, alpha: Array) -> Array:
    """Return second differences of minus the log-likelihood, shape (free, free)."""
    low, high = box.bounds.T
    width = (high - low)[box.free]
    steps = FIRST_STEP * width
    for _ in range(REFINEMENTS):
        bend = _bend(objective, box, alpha, steps)
        wanted = np.sqrt(2.0 * DROP / np.maximum(bend, 1e-300))
        steps = np.clip(wanted, 0.1 * FIRST_STEP * width, LARGEST_STEP * width)
    centre = _inside(box, alpha, steps)
    n = len(steps)
    moves = np.zeros((n, box.size))
    moves[:, box.free] = np.diag(steps)
    pairs = list(combinations(range(n), 2))
    corners = [s * moves[i] + t * moves[j] for i, j in pairs for s in (1, -1) for t in (1, -1)]
    points = centre + np.vstack([np.zeros((1, box.size)), moves, -moves, *(c[None] for c in corners)])
    values = _falls(objective, box, points)
    ahead, behind = values[1 : 2 * n + 1].reshape(2, n)
    hessian = np.diag((ahead + behind) / steps**2)
    for (i, j), (both, first, second, neither) in zip(pairs, values[2 * n + 1 :].reshape(-1, 4), strict=True):
        hessian[i, j] = hessian[j, i] = (both - first - second + neither) / (4.0 * steps[i] * steps[j])
    return hessian


def _bend(objective: Objective, box: Box, alpha: Array, steps: Array) -> Array:
    """Return second differences of minus the log-likelihood along each parameter, shape (free,)."""
    centre, moves = _inside(box, alpha, steps), np.zeros((len(steps), box.size))
    moves[:, box.free] = np.diag(steps)
    values = _falls(objective, box, np.vstack([centre[None], centre + moves, centre - moves]))
    ahead, behind = values[1:].reshape(2, -1)
    return np.asarray((ahead + behind) / steps**2)


def _falls(objective: Objective, box: Box, points: Array) -> Array:
    """Return how far the log-likelihood lies below that of the first point."""
    values = objective(box.clip(points))
    falls = np.full(len(values), DEEP)
    np.subtract(values[0], values, out=falls, where=np.isfinite(values))
    return falls


def _inside(box: Box, alpha: Array, steps: Array) -> Array:
    """Return the point nearest to `alpha` with the room of one step on every side."""
    room = np.zeros(box.size)
    room[box.free] = steps
    return np.asarray(np.clip(alpha, box.bounds[:, 0] + room, box.bounds[:, 1] - room))


def _inverse(hessian: Array, widths: Array) -> tuple[Array, Array]:
    """Return the inverse of a Hessian with its flat directions raised to `SINGULAR`, and these directions."""
    sharpness = np.maximum(np.sqrt(np.abs(np.diag(hessian))), BLUNT / widths)
    values, vectors = np.linalg.eigh(hessian / np.outer(sharpness, sharpness))
    inverse = (vectors / np.maximum(values, SINGULAR)) @ vectors.T
    return inverse / np.outer(sharpness, sharpness), vectors[:, values < SINGULAR].T
