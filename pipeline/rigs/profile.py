"""Cam of the virtual bench: path of the roller's centre as a spline over the true angle of the cam."""

from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from unmodelled.base.arrays import Array
from unmodelled.base.compiling import kept

TURN = 2.0 * np.pi


@lru_cache(maxsize=64)
def cam_spline(
    H: float, beta: float, base: float, roller: float, rounding: float
) -> tuple[Array, list[float]]:
    """Return a spline of the pitch curve, and the moments of the cam's area.

    The roller centre has the distance `roller` from a cycloidal cam without dwell, along the outward normal.
    On a sharply concave cam this curve folds back; the roller then rests on the outermost branch, and the
    kink is smoothed.

    Takes H in m, beta in rad, base in m, roller in m, rounding in rad; gives (4, cells).
    """
    cells = 1440
    phi = np.linspace(-1.0, TURN + 1.0, 40 * cells)
    turn = np.mod(phi, TURN)
    u = np.where(turn <= beta, turn / beta, (TURN - turn) / (TURN - beta))
    radius = base + H * (u - np.sin(TURN * u) / TURN)
    slope = H / np.where(turn <= beta, beta, beta - TURN) * (1.0 - np.cos(TURN * u))
    radial, tangential = np.array([radius, -slope]) * roller / np.hypot(radius, slope)
    psi, distance = phi + np.arctan2(tangential, radius + radial), np.hypot(radius + radial, tangential)
    grid, outer = np.arange(cells) * (TURN / cells), np.zeros(cells)
    folds = np.flatnonzero(np.diff(np.sign(np.diff(psi)))) + 1
    for i, j in zip([0, *folds], [*folds, psi.size - 1], strict=True):
        rows = np.argsort(psi[i : j + 1]) + i  # one monotonic branch
        outer = np.maximum(outer, np.interp(grid, psi[rows], distance[rows], left=0.0, right=0.0))
    lift = gaussian_filter1d(outer - base - roller, rounding / (TURN / cells), mode="wrap")
    spline = CubicSpline(np.append(grid, TURN), np.append(lift, lift[0]), bc_type="periodic")
    r, angle = (a[(phi >= 0.0) & (phi < TURN)] for a in (radius, phi))
    parts = r**4 / 4, r**3 / 3 * np.sin(angle), r**3 / 3 * np.cos(angle)
    return np.ascontiguousarray(spline.c), [float(np.sum(part) * (phi[1] - phi[0])) for part in parts]


@kept()
def profile(theta: float, spline: Array) -> tuple[float, float, float]:
    """Return lift (m), first (m/rad) and second derivative (m/rad^2) from a spline (4, cells)."""
    width = 2.0 * np.pi / spline.shape[1]
    k = int((theta % (2.0 * np.pi)) / width) % spline.shape[1]
    u = theta % (2.0 * np.pi) - k * width
    a, b, c, d = spline[0, k], spline[1, k], spline[2, k], spline[3, k]
    return ((a * u + b) * u + c) * u + d, (3 * a * u + 2 * b) * u + c, 6 * a * u + 2 * b
