"""Compiled least squares within bounds.

Loops over single numbers: numba needs twenty seconds to compile NumPy's functions of arrays and its solvers.
"""

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

    Examples:
        >>> H, g = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-3.0, -3.0])
        >>> bounded(H, g, np.zeros(2), np.array([0.5, 9.0])).round(6).tolist()
        [0.5, 1.25]
    """
    n, largest, steepest = len(g), 1e-300, 0.0
    for i in range(n):
        largest = max(largest, H[i, i])
    d, unit, slope = np.zeros(n), np.ones(n), np.empty(n)
    seen, free = np.zeros(n, np.bool_), np.zeros(n, np.bool_)
    for i in range(n):
        if H[i, i] > ZERO_CURVATURE * largest:
            seen[i] = free[i] = True
            unit[i] = 1.0 / np.sqrt(H[i, i])
        steepest = max(steepest, abs(unit[i] * g[i]))
    scaled, there = np.empty((n, n)), np.empty(n)
    for _ in range(MOVES_PER_COLUMN * n):
        towards(H, g, unit, d, free, scaled, there)
        room, first = 1.0, -1
        for i in range(n):
            if free[i] and there[i] != d[i]:
                bound = high[i] if there[i] > d[i] else low[i]
                share = (bound - d[i]) / (there[i] - d[i])
                if share < room:
                    room, first = share, i
        for i in range(n):
            if free[i]:
                d[i] += max(room, 0.0) * (there[i] - d[i])
        if first >= 0:
            d[first] = high[first] if there[first] > d[first] else low[first]
            free[first] = False
            continue
        gradient(H, g, d, slope)
        strongest, leaves = RELATIVE_RIDGE * steepest, -1
        for i in range(n):
            pulled = -unit[i] * slope[i] if d[i] <= low[i] else unit[i] * slope[i]
            if seen[i] and not free[i] and low[i] < high[i] and pulled > strongest:
                strongest, leaves = pulled, i
        if leaves < 0:
            break
        free[leaves] = True
    return d


@jit()
def gradient(H, g, d, slope):
    """Write the gradient at `d` to `slope`."""
    for i in range(len(g)):
        slope[i] = g[i]
    for j in range(len(g)):
        for i in range(len(g)):
            slope[i] += H[j, i] * d[j]


@jit()
def towards(H, g, unit, d, free, scaled, there):
    """Write the best values of the free coefficients, while the others stay at `d`, to `there`.

    The equations, scaled by `unit` and with a ridge, are solved in `scaled`.
    """
    count = 0
    for i in range(len(g)):
        if free[i]:
            rest, column = g[i], 0
            for j in range(len(g)):
                if free[j]:
                    scaled[count, column] = H[i, j] * unit[i] * unit[j]
                    column += 1
                else:
                    rest += H[i, j] * d[j]
            scaled[count, count] += RELATIVE_RIDGE
            there[count] = -unit[i] * rest
            count += 1
    solve(scaled, there, count)
    for i in range(len(g) - 1, -1, -1):
        if free[i]:
            count -= 1
            there[i] = unit[i] * there[count]


@jit()
def solve(A, b, n):
    """Solve the first `n` equations of a symmetric `A` for the right side `b`, in place.

    Elimination without a choice of pivots, which a ridge keeps from zero; only the upper triangle is used.
    """
    for k in range(n):
        A[k, k] = max(A[k, k], RELATIVE_RIDGE)
        for i in range(k + 1, n):
            factor = A[k, i] / A[k, k]
            for j in range(i, n):
                A[i, j] -= factor * A[k, j]
            b[i] -= factor * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= A[k, j] * b[j]
        b[k] /= A[k, k]
