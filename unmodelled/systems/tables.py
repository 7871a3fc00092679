"""Measured characteristics as piecewise cubic polynomials."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np

from unmodelled.base.arrays import Array


@dataclass(frozen=True)
class Table:
    """Characteristic y(x) through measured points, constant beyond its ends."""

    name: str
    x: tuple[float, ...]  # increasing, at least two
    y: tuple[float, ...]  # one per abscissa
    kind: Literal["cubic", "linear"] = "cubic"  # spline with not-a-knot ends, or straight lines

    @cache  # noqa: B019 - a table is immutable and lives as long as its system
    def pieces(self, order: int = 0) -> tuple[Array, Array]:
        """Return knots (n,) and polynomial coefficients (4, n - 1) of a derivative."""
        from scipy.interpolate import CubicSpline, PPoly

        knots, values = np.asarray(self.x, np.float64), np.asarray(self.y, np.float64)
        linear = PPoly(np.stack([np.diff(values) / np.diff(knots), values[:-1]]), knots)
        spline = linear if self.kind == "linear" else CubicSpline(knots, values)
        curve = spline.derivative(order) if order else spline
        c = np.zeros((4, len(knots) - 1))
        c[4 - len(curve.c) :] = curve.c
        return knots, c

    def __call__(self, x: Array, order: int = 0) -> Array:
        """Value, or derivative of `order`, at `x` (any shape)."""
        knots, c = self.pieces(order)
        held = np.clip(x, knots[0], knots[-1])
        k = np.clip(np.searchsorted(knots, held, "right") - 1, 0, len(knots) - 2)
        d = held - knots[k]
        value = ((c[0, k] * d + c[1, k]) * d + c[2, k]) * d + c[3, k]
        inside = (x >= knots[0]) & (x <= knots[-1])
        return np.where(inside, value, 0.0) if order else np.asarray(value)
