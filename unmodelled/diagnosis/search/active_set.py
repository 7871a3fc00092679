"""Compiled least squares within bounds."""

# mypy: ignore-errors

import numpy as np

from unmodelled.engine.compiled.layout import jit

#: Relative ridge that keeps equal columns apart, and relative curvature below which a column is zero.
RELATIVE_RIDGE, ZERO_CURVATURE = 1e-9, 1e-12
#: Largest number of times per column that a bound is met or left.
MOVES_PER_COLUMN = 4


@jit()
def bounded(H, g, low, high):
    """Minimise half the square form of `H` plus the linear form of `g` by a primal active-set method.

    It starts from zero, which the bounds must admit.

    Args:
        H: curvature, shape (columns, columns), positive semidefinite.
        g: gradient at zero, shape (columns,).
        low: lower bounds, shape (columns,).
        high: upper bounds, shape (columns,).

    Returns:
        Coefficients, shape (columns,).
    """
    n, d = len(g), np.zeros(len(g))
    diagonal = np.diag(H)
    largest = diagonal.max() if n else 0.0
    seen = diagonal > ZERO_CURVATURE * max(largest, 1e-300)
    unit = 1.0 / np.sqrt(np.where(seen, diagonal, 1.0))
    tiny = RELATIVE_RIDGE * np.abs(unit * g).max() if n else 0.0
    free = seen.copy()
    for _ in range(MOVES_PER_COLUMN * n):
        k = np.flatnonzero(free)
        step, room, first = towards(H, g, unit, d, k), 1.0, -1
        for i in range(len(k)):
            bound = high[k[i]] if step[i] > 0.0 else low[k[i]]
            share = (bound - d[k[i]]) / step[i] if step[i] != 0.0 else 1.0
            if share < room:
                room, first = share, i
        d[k] += max(room, 0.0) * step
        if first >= 0:
            d[k[first]] = high[k[first]] if step[first] > 0.0 else low[k[first]]
            free[k[first]] = False
            continue
        slope, strongest, leaves = unit * (g + H @ d), tiny, -1
        for i in range(n):
            pulled = -slope[i] if d[i] <= low[i] else slope[i]
            if seen[i] and not free[i] and low[i] < high[i] and pulled > strongest:
                strongest, leaves = pulled, i
        if leaves < 0:
            break
        free[leaves] = True
    return d


@jit()
def towards(H, g, unit, d, free):
    """Return the step, shape (free,), of the free coefficients to their best values; the others stay."""
    count = len(free)
    scaled, rest = np.empty((count, count)), np.empty(count)
    held = d.copy()
    held[free] = 0.0
    slope = g + H @ held
    for i in range(count):
        rest[i] = unit[free[i]] * slope[free[i]]
        for j in range(count):
            scaled[i, j] = H[free[i], free[j]] * unit[free[i]] * unit[free[j]]
        scaled[i, i] += RELATIVE_RIDGE
    return -unit[free] * np.linalg.solve(scaled, rest) - d[free]
