"""Densities exp(polynomial) of largest entropy: compiled Newton's method and integrals, output by output.

A density is exp(c_0 + c_1 z + ... + c_K z^K) on an interval of the standardised variable z. The dual problem
of maximum entropy (appendix 3.6, with c = -lambda),

    Gamma(c) = log of the integral of exp(sum c_k z^k) - sum c_k m_k

is convex; its gradient is the error of the moments and its Hessian the covariance of the powers of z. In the
polynomials p_1 ... p_K that are orthonormal under the current density the Hessian is the identity, so that
Newton's direction is sum E_target[p_j] p_j(z), for any degree and any width of the density.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.base.compiling import compiled
from unmodelled.uncertainty.families.orthogonal import gauss_legendre

#: Gauss-Legendre nodes; a density counts once a rule finds its moments right that it was not made with.
RULES = (64, 128, 256, 512, 1024)
#: Newton steps on one rule: four moments take about ten, eight up to a hundred.
STEPS = 200
#: Squared Newton decrement from which a last step leaves rounding errors only.
SOLVED = 1e-18
#: Fraction of a Newton step at which the line search gives up.
SHORTEST = 1e-9
#: Squared Newton decrement below which rounding hides the decrease of the dual, and full steps are safe.
CLOSE = 1e-9
#: Panels of an interval, and Gauss-Legendre nodes in each or in the part of it that is asked for.
PANELS, NODES = 128, 12


def maximise_entropy(moments: Array, support: Array) -> tuple[Array, Indices, Mask]:
    """Return coefficients (L, K + 1), Newton steps (L,) and success (L,) for moments (L, K + 1)."""
    start = np.zeros_like(moments)
    start[:, 2] = -0.5
    coefficients = start.copy()
    steps, solved = np.zeros(len(moments), np.int64), np.zeros(len(moments), np.bool_)
    left = np.arange(len(moments))
    for nodes in RULES:
        c = coefficients[left]
        taken = _solve(c, moments[left], support[left], *gauss_legendre(nodes))
        found = taken >= 0
        coefficients[left] = np.where(found[:, None], c, start[left])
        steps[left] += np.where(found, taken + 1, -taken)
        solved[left] = taken == 0
        left = left[~solved[left]]
        if not left.size:
            break
    return coefficients, steps, solved


@compiled
def _solve(coefficients: Array, moments: Array, support: Array, nodes: Array, weights: Array) -> Any:
    """Improve the coefficients (L, K + 1) in place on one quadrature rule, and return the steps (L,)."""
    steps = np.empty(len(moments), np.int64)
    for l in range(len(moments)):
        half = 0.5 * (support[l, 1] - support[l, 0])
        z, w = support[l, 0] + half * (nodes + 1.0), half * weights
        steps[l] = _newton(coefficients[l], moments[l], z, w)
    return steps


@compiled
def _newton(c: Array, m: Array, z: Array, w: Array) -> int:
    """Improve the coefficients (K + 1,) of one output in place by damped Newton steps."""
    exponent, direction = np.empty_like(z), np.zeros_like(z)
    q, step = np.empty_like(z), np.zeros_like(c)
    for i in range(z.size):
        exponent[i] = polynomial(c, z[i])
    _move(c, exponent, q, step, direction, 0.0, _grow(q, w, exponent, direction, 0.0))
    for taken in range(STEPS):
        decrement = _newton_direction(direction, step, q, z, m)
        if not decrement < np.inf:  # the density has shrunk to fewer nodes than it has moments
            return -1 - taken
        length = 1.0
        growth = _grow(q, w, exponent, direction, length)
        while decrement > CLOSE and not growth <= 0.9 * length * decrement:
            length *= 0.5
            if length < SHORTEST:
                return -1 - taken
            growth = _grow(q, w, exponent, direction, length)
        _move(c, exponent, q, step, direction, length, growth)
        if decrement < SOLVED:
            return taken
    return -1 - STEPS


@compiled
def _grow(q: Array, w: Array, exponent: Array, direction: Array, length: float) -> float:
    """Compute the masses `q` (n,) after a step, not normalised, and return the logarithm of their sum."""
    total = 0.0
    for i in range(q.size):
        q[i] = w[i] * np.exp(exponent[i] + length * direction[i])
        total += q[i]
    return float(np.log(total))


@compiled
def _move(
    c: Array, exponent: Array, q: Array, step: Array, direction: Array, length: float, growth: float
) -> None:
    """Take a step and normalise the density."""
    share = np.exp(-growth)
    for i in range(q.size):
        exponent[i] += length * direction[i] - growth
        q[i] *= share
    for k in range(c.size):
        c[k] += length * step[k]
    c[0] -= growth


@compiled
def _newton_direction(direction: Array, step: Array, q: Array, z: Array, m: Array) -> float:
    """Compute Newton's direction at nodes (n,) and as coefficients (K + 1,), and return its squared length.

    The orthonormal polynomials follow from their three-term recurrence (Stieltjes), with values at the nodes
    in `p` and coefficients in `a`.
    """
    p, before = np.ones_like(z), np.zeros_like(z)
    a, a_before = np.zeros_like(m), np.zeros_like(m)
    a[0], direction[:], step[:] = 1.0, 0.0, 0.0
    norm = decrement = 0.0
    for _ in range(1, m.size):
        centre = square = mismatch = 0.0
        for i in range(z.size):
            centre += q[i] * z[i] * p[i] * p[i]
        for i in range(z.size):
            p[i], before[i] = (z[i] - centre) * p[i] - norm * before[i], p[i]
            square += q[i] * p[i] * p[i]
        for k in range(m.size - 1, 0, -1):
            a[k], a_before[k] = a[k - 1] - centre * a[k] - norm * a_before[k], a[k]
        a[0], a_before[0] = -centre * a[0] - norm * a_before[0], a[0]
        norm = np.sqrt(square)
        for k in range(m.size):
            a[k] /= norm
            mismatch += a[k] * m[k]
        for i in range(z.size):
            p[i] /= norm
            direction[i] += mismatch * p[i]
        for k in range(m.size):
            step[k] += mismatch * a[k]
        decrement += mismatch * mismatch
    return float(decrement)


def panel_integrals(coefficients: Array, support: Array) -> Array:
    """Compute the integrals (L, PANELS + 1) of the densities from their lower ends to those of all panels."""
    panels: Array = _panels(coefficients, support, *gauss_legendre(NODES))
    return np.asarray(np.cumsum(panels, -1))


def integral(coefficients: Array, support: Array, sums: Array, z: Array) -> Array:
    """Compute the integrals (points, L) of the densities from their lower ends to points (points, L)."""
    return np.asarray(_integral(coefficients, support, sums, np.ascontiguousarray(z), *gauss_legendre(NODES)))


@compiled
def polynomial(c: Array, z: float) -> float:
    """Evaluate the polynomial sum c_k z^k with coefficients (K + 1,)."""
    value = 0.0
    for k in range(c.size - 1, -1, -1):
        value = value * z + c[k]
    return value


@compiled
def _between(c: Array, low: float, high: float, nodes: Array, weights: Array) -> float:
    half, total = 0.5 * (high - low), 0.0
    for i in range(nodes.size):
        total += weights[i] * np.exp(polynomial(c, low + half * (nodes[i] + 1.0)))
    return half * total


@compiled
def _panels(coefficients: Array, support: Array, nodes: Array, weights: Array) -> Any:
    values = np.zeros((len(coefficients), PANELS + 1))
    for l in range(len(coefficients)):
        low, width = support[l, 0], (support[l, 1] - support[l, 0]) / PANELS
        for k in range(PANELS):
            start = low + k * width
            values[l, k + 1] = _between(coefficients[l], start, start + width, nodes, weights)
    return values


@compiled
def _integral(
    coefficients: Array, support: Array, sums: Array, z: Array, nodes: Array, weights: Array
) -> Any:
    values = np.full_like(z, np.nan)
    for i in range(z.shape[0]):
        for l in range(z.shape[1]):
            if np.isnan(z[i, l]):
                continue
            low, high = support[l]
            width = (high - low) / PANELS
            place = min(max(z[i, l], low), high)
            k = min(int((place - low) / width), PANELS - 1)
            part = _between(coefficients[l], low + k * width, place, nodes, weights)
            values[i, l] = sums[l, k] + part
    return values
