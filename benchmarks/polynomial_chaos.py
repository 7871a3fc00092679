"""Coefficients and four raw moments of 108 outputs by polynomial chaos against chaospy."""

from __future__ import annotations

from types import ModuleType

import numpy as np

from benchmarks.timing import PeerMissing, seconds, side_by_side
from unmodelled.base.arrays import Array
from unmodelled.uncertainty.chaos import Chaos
from unmodelled.uncertainty.families import ClippedNormal, TruncatedNormal

PEER = "chaospy"
DEGREE, ORDER = 4, 5
BOX = ((0.7, 1.3), (0.4, 1.15))
ALPHA = np.array([[0.91, 0.081], [0.55, 0.046]])
REPEATS = 100


def run() -> dict[str, object]:
    """Two parameters, degree 4, 25 collocation points: eq. (3.12), (3.11) and (3.9) without the model's runs.

    Ours has another alpha every time and includes the transformation to theta. The peer, which has no such
    transformation, is given its basis and its rule. own_polynomials: our seconds where the germs, and with
    them basis and rules, change with alpha. difference: the largest between the moments, relative.
    """
    chaospy = _chaospy()
    clipped = Chaos(tuple(ClippedNormal(*ends) for ends in BOX), DEGREE, ORDER)
    truncated = Chaos(tuple(TruncatedNormal(*ends) for ends in BOX), DEGREE, ORDER)
    theta, l = clipped.nodes(ALPHA), np.linspace(0.5, 1.5, 108)
    values = np.exp(l * theta[:, :1]) + np.tanh(theta[:, 1:] / l)
    joint = chaospy.J(chaospy.Normal(0, 1), chaospy.Normal(0, 1))
    basis = chaospy.generate_expansion(DEGREE, joint, normed=True)
    nodes, weights = chaospy.generate_quadrature(ORDER - 1, joint, rule="gaussian")

    def peer() -> Array:
        polynomials = chaospy.fit_quadrature(basis, nodes, weights, values)
        return np.array([chaospy.E(polynomials**m, joint) for m in range(1, 5)])

    difference = float(np.max(np.abs(clipped.expand(ALPHA, values).moments(4) / peer() - 1.0)))
    times = side_by_side(lambda: _propagate(clipped, values), peer, steps=REPEATS)
    _propagate(truncated, values)  # reads the compiled recurrence
    own = seconds(lambda: _propagate(truncated, values)) / REPEATS
    version = f"chaospy {chaospy.__version__}"
    return {**times, "own_polynomials": own, "difference": difference, "peer_version": version, "threads": 1}


def _propagate(chaos: Chaos, values: Array) -> None:
    for k in range(REPEATS):
        alpha = ALPHA * (1.0 + 1e-4 * k)
        chaos.nodes(alpha)
        chaos.expand(alpha, values).moments(4)


def _chaospy() -> ModuleType:
    try:
        import chaospy
    except ImportError:
        raise PeerMissing("chaospy is not installed: pip install -e .[bench]") from None
    module: ModuleType = chaospy
    return module
