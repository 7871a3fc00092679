"""Compiled loops that follow the level curves of bicubic surfaces."""

from __future__ import annotations

import numpy as np

from unmodelled.base.arrays import Array, Indices
from unmodelled.base.compiling import compiled

Four = tuple[float, float, float, float]


#: Along what a surface rises: one of the axes 0 and 1, or both.
DIAGONAL = 2
#: Step of Newton's method, in the interval searched, that is the last: the error is its square.
CLOSE = 1e-6


@compiled
def _cubics(s: float) -> Four:
    """Return the Hermite polynomials of value and slope at one node and at the next."""
    r = 1.0 - s
    return (1.0 + 2.0 * s) * r * r, s * r * r, (1.0 + 2.0 * r) * s * s, -r * s * s


@compiled
def _steeps(s: float) -> Four:
    """Return the derivatives of the Hermite polynomials."""
    r = 1.0 - s
    return -6.0 * s * r, r * (1.0 - 3.0 * s), 6.0 * s * r, s * (1.0 - 3.0 * r)


@compiled
def _surface(table: Array, x: float, y: float) -> tuple[float, float, float]:
    """Return value and slopes along x and y of one surface, `table` (2 m_1, 2 m_2), in the unit square."""
    m, n = table.shape[0] // 2 - 1, table.shape[1] // 2 - 1
    i, j = min(max(int(x * m), 0), m - 1), min(max(int(y * n), 0), n - 1)
    a, b = _cubics(x * m - i), _cubics(y * n - j)
    da, db = _steeps(x * m - i), _steeps(y * n - j)
    value, dx, dy = 0.0, 0.0, 0.0
    for k in range(4):
        row, slope = 0.0, 0.0
        for l in range(4):
            node = table[2 * i + k, 2 * j + l]
            row += b[l] * node
            slope += db[l] * node
        value += a[k] * row
        dx += da[k] * row
        dy += a[k] * slope
    return value, dx * m, dy * n


@compiled
def _place(direction: int, line: float, q: float) -> tuple[float, float]:
    """Return the point `q` of a line; lines are numbered by the other axis, diagonals by x - y."""
    if direction == DIAGONAL:
        return line + q, q
    return (q, line) if direction == 0 else (line, q)


@compiled
def _look(table: Array, part: Array, direction: int, line: float, q: float) -> tuple[float, float, float]:
    """Return value, slope along the line and slope along x at a point of a line in `part` of the square."""
    x, y = _place(direction, line, q)
    value, dx, dy = _surface(table, part[0, 0] + x * part[0, 1], part[1, 0] + y * part[1, 1])
    dx, dy = dx * part[0, 1], dy * part[1, 1]
    if direction == DIAGONAL:
        return value, dx + dy, dx
    return value, dx if direction == 0 else dy, dx


@compiled
def _meet(
    table: Array, part: Array, direction: int, line: float, level: float, low: float, high: float, q: float
) -> tuple[float, float, float]:
    """Return the point of a line between `low` and `high` at the level, and its slopes: Newton from `q`."""
    close = CLOSE * (high - low)
    slope, dx = 0.0, 0.0
    for _ in range(60):
        value, slope, dx = _look(table, part, direction, line, q)
        if value > level:
            high = q
        else:
            low = q
        following = q - (value - level) / slope if slope > 0.0 else low - 1.0
        if not low <= following <= high:
            following = 0.5 * (low + high)
        step, q = abs(following - q), following
        if step <= close:
            break
    return q, slope, dx


@compiled
def _cross(
    table: Array, part: Array, axis: int, line: float, level: float, q: float
) -> tuple[float, float, float]:
    """Return `_meet` along an axis; if the line does not meet the level, its end and slopes of zero."""
    if level <= _look(table, part, axis, line, 0.0)[0]:
        return 0.0, 0.0, 0.0
    if level >= _look(table, part, axis, line, 1.0)[0]:
        return 1.0, 0.0, 0.0
    found: tuple[float, float, float] = _meet(table, part, axis, line, level, 0.0, 1.0, q)
    return found


@compiled
def _ends(table: Array, part: Array, level: float) -> tuple[float, float, float]:
    """Return the first and last diagonal that meet the level, and the y at which the last one does.

    The curve falls from the left or upper edge to the lower or right one, each a line along an axis.
    """
    last, end = _cross(table, part, 0, 0.0, level, 0.5)[0], 0.0
    if last == 1.0:
        end = _cross(table, part, 1, 1.0, level, 0.5)[0]
        last = 1.0 - end
    first = -_cross(table, part, 1, 0.0, level, 0.5)[0]
    if first == -1.0:
        first = _cross(table, part, 0, 1.0, level, 0.5)[0] - 1.0
    return first, last, end


@compiled
def _diagonal(
    table: Array, part: Array, level: float, points: Array, weights: Array, share: Array, along: Array
) -> float:
    """Follow one curve by diagonals and return its end."""
    if level <= _look(table, part, 0, 0.0, 0.0)[0]:
        return 0.0
    if level >= _look(table, part, 0, 1.0, 1.0)[0]:
        return 1.0
    first, last, end = _ends(table, part, level)
    line, q, bend = first, max(0.0, -first), 0.0
    for k in range(len(points)):
        before, line = line, first + (last - first) * points[k]
        low, high = max(0.0, -line), min(1.0, 1.0 - line)
        guess = min(max(q + bend * (line - before), low), high)
        q, slope, dx = _meet(table, part, DIAGONAL, line, level, low, high, guess)
        bend = -dx / slope
        share[k, 0], share[k, 1] = _place(DIAGONAL, line, q)
        along[k, 0] = weights[k] * (last - first) / slope
        along[k, 1] = along[k, 0] * dx
    return float(end)


@compiled
def _straight(
    table: Array,
    part: Array,
    axis: int,
    level: float,
    points: Array,
    weights: Array,
    share: Array,
    along: Array,
) -> float:
    """Follow one curve by lines along an axis and return its end."""
    q = 0.5
    for k in range(len(points)):
        q, slope, dx = _cross(table, part, axis, points[k], level, q)
        share[k, 0], share[k, 1] = _place(axis, points[k], q)
        if slope > 0.0:
            along[k, 0], along[k, 1] = weights[k] / slope, weights[k] * dx / slope
        elif axis == 0:
            along[k, 1] = weights[k]
    return float(_cross(table, part, 1, 1.0, level, 0.5)[0]) if axis == 1 else 0.0


@compiled
def follow(
    tables: Array,
    direction: Indices,
    part: Array,
    levels: Array,
    points: Array,
    weights: Array,
    share: Array,
    along: Array,
    end: Array,
) -> None:
    """Fill arrays with the nodes along the level curves of L surfaces that rise along their directions.

    The curve is the border of the region below a level. With densities f_1, f_2 over x and y and their
    integrals F_1, F_2, the probability of the region is by Green's theorem the integral of F_1 f_2 dy along
    the curve, plus F_2 at the end of the curve on the right edge. The density of the level is the integral of
    f_1 f_2 over the lines that meet the curve, divided by the slopes along them.

    Takes tables (L, 2 m_1, 2 m_2), direction (L,), part (L, 2, 2), levels (P, L), points (K,), weights (K,),
    share (P, L, K, 2), along (P, L, K, 2), end (P, L).
    """
    share[:], along[:] = 0.5, 0.0
    for p in range(len(levels)):
        for l in range(len(tables)):
            level, nodes, sums = levels[p, l], share[p, l], along[p, l]
            if direction[l] == DIAGONAL:
                y = _diagonal(tables[l], part[l], level, points, weights, nodes, sums)
            else:
                y = _straight(tables[l], part[l], direction[l], level, points, weights, nodes, sums)
            end[p, l] = part[l, 1, 0] + y * part[l, 1, 1]
            for k in range(len(points)):
                for axis in range(2):
                    nodes[k, axis] = part[l, axis, 0] + nodes[k, axis] * part[l, axis, 1]
                    sums[k, axis] *= part[l, 1, 1]
                sums[k, 0] *= part[l, 0, 1]


@compiled
def steepness(tables: Array, refinement: int) -> Array:
    """Return the smallest slopes (L, 3) of surfaces (L, 2 m_1, 2 m_2) along x, y and the diagonal."""
    least = np.full((len(tables), 3), np.inf)
    m, n = refinement * (tables.shape[1] // 2 - 1), refinement * (tables.shape[2] // 2 - 1)
    for l in range(len(tables)):
        for i in range(m + 1):
            for j in range(n + 1):
                _, dx, dy = _surface(tables[l], i / m, j / n)
                least[l, 0] = min(least[l, 0], dx)
                least[l, 1] = min(least[l, 1], dy)
                least[l, 2] = min(least[l, 2], dx + dy)
    return least
