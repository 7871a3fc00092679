"""The Earth Mover's Distance between densities (appendix 3.7)."""

from __future__ import annotations

import numpy as np

from unmodelled.uncertainty.density import Array, Density

#: Points in the window of each of the two densities.
POINTS = 1000


def earth_mover(p: Density, q: Density) -> Array:
    """Least mean distance by which the mass of one density must move to become the other.

    On a line it is the area between the two cumulative probabilities (the Wasserstein distance of order 1),
    here by the trapezoidal rule, to about 1e-5 of the wider window.

    Returns:
        (L,) in the unit of the outputs.
    """
    ends = (p.window(), q.window())
    y = np.sort(np.concatenate([np.linspace(low, high, POINTS) for low, high in (e.T for e in ends)]), axis=0)
    return np.asarray(np.trapezoid(np.abs(p.cumulative(y) - q.cumulative(y)), y, axis=0))
