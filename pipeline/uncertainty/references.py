"""Exact densities of functions of one parameter, and the distance of a density from another one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.uncertainty.density import Density
from unmodelled.uncertainty.families import Family
from unmodelled.uncertainty.push_forward import TAIL, PushForward
from unmodelled.uncertainty.response import Formula
from unmodelled.uncertainty.surface import ResponseSurface

#: Nodes of a function of one parameter.
FINE = 1001
#: Points in the window of each of the two densities.
POINTS = 1000


def monotone_density(function: Callable[[Array], Array], family: Family, alpha: Array) -> PushForward:
    """Compute the exact densities of monotone functions (S, L) of one parameter (footnote 4)."""
    ends = np.clip(family.quantile(np.array([TAIL, 1.0 - TAIL]), alpha[0]), *family.support(alpha[0]))
    formula = Formula(("theta",), ends[None], function)
    return PushForward(ResponseSurface.of(formula, (FINE,)), (family,), alpha)


def earth_mover_distance(p: Density, q: Density) -> Array:
    """Compute the earth mover's distances (L,) between two densities (appendix 3.7).

    It is the smallest mean distance by which the mass of one density must move to become the other one. For a
    single variable this is the area between the cumulative probabilities (Wasserstein distance of order 1),
    computed by the trapezoidal rule to about 1e-5 of the wider window.
    """
    ends = (p.window(), q.window())
    y = np.sort(np.concatenate([np.linspace(low, high, POINTS) for low, high in (e.T for e in ends)]), axis=0)
    return np.asarray(np.trapezoid(np.abs(p.cumulative(y) - q.cumulative(y)), y, axis=0))
