"""Share of a parameter's effect that networks in the ports of a system can absorb."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import BSpline

from unmodelled.base.arrays import Array

#: Knots per input of the cubic splines that stand for a network of one or two inputs.
KNOTS = 8
#: Degree of these splines.
DEGREE = 3
#: Random hidden units that stand for a network of more inputs.
UNITS = 300
#: Of the mean eigenvalue of the normal equations.
RIDGE = 1e-4


def beside_networks(matrix: Array, gains: Sequence[Array], inputs: Sequence[Array]) -> Array:
    """Remove from sensitivity columns the part that networks in the ports can reproduce.

    A network with inputs q can represent any function of q, so its effect on the rows is its gain times a
    rich basis of functions of q. The least squares fit of these effects to the columns is removed. It uses
    all rows, as the training of a network does: a fit judged on held-out experiments fails where these leave
    the range of the others, and then reports parameters as identifiable that the network absorbs. The
    remainder is scaled by the degrees of freedom of the fit, so that white noise keeps its mean size. The
    operation is linear in the columns.

    Takes matrix (rows, columns), gains (rows,), inputs (rows, q); gives (rows, columns).
    """
    if not gains:
        return matrix
    effects = np.hstack([g[:, None] * _basis(q) for g, q in zip(gains, inputs, strict=True)])
    values, vectors = np.linalg.eigh(effects.T @ effects)
    values = np.maximum(values, 0.0)
    kept = values + max(RIDGE * float(np.mean(values)), np.finfo(float).tiny)
    left = matrix - effects @ (vectors @ ((vectors.T @ (effects.T @ matrix)) / kept[:, None]))
    freedom = len(matrix) - float(np.sum(values / kept))
    return np.asarray(left * np.sqrt(len(matrix) / max(freedom, 1.0)))


def _basis(q: Array) -> Array:
    """Return functions (rows, functions) of the inputs (rows, q) that include or span a constant."""
    q = q[:, np.ptp(q, axis=0) > 0.0]
    if q.shape[1] == 0:
        return np.ones((len(q), 1))
    z = (q - q.mean(0)) / q.std(0)
    if z.shape[1] > 2:
        return _random_units(z)
    first, *others = (_splines(column) for column in z.T)
    return (first[:, :, None] * others[0][:, None]).reshape(len(z), -1) if others else first


def _splines(z: Array) -> Array:
    """Return cubic B-splines (rows, knots + 2) of one input (rows,), on knots at its quantiles."""
    knots = np.unique(np.quantile(z, np.linspace(0.0, 1.0, KNOTS)).round(6))
    knots[[0, -1]] = z.min(), z.max()
    beyond = np.arange(1.0, DEGREE + 1.0)
    before = knots[0] - beyond[::-1] * (knots[1] - knots[0])
    after = knots[-1] + beyond * (knots[-1] - knots[-2])
    padded = np.concatenate([before, knots, after])
    return np.asarray(BSpline.design_matrix(z, padded, DEGREE).toarray())


def _random_units(z: Array) -> Array:
    """Return ReLU units in random directions, each with its corner at a random sample."""
    generator = np.random.default_rng(0)
    direction = generator.standard_normal((z.shape[1], UNITS))
    direction /= np.linalg.norm(direction, axis=0)
    corner = np.einsum("hq,qh->h", z[generator.integers(len(z), size=UNITS)], direction)
    return np.hstack([np.ones((len(z), 1)), z, np.maximum(z @ direction - corner, 0.0)])
