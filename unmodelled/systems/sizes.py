"""Limits on the size of expressions, so that a small file cannot ask for a huge expression."""

from __future__ import annotations

import sympy as sp

LARGEST = 20_000
DEEPEST = 150
LARGEST_DERIVATIVE = 4 * LARGEST


def measured(expression: sp.Expr) -> tuple[int, int]:
    """Return the number of nodes and the depth of an expression tree.

    Args:
        expression: SymPy expression.

    Returns:
        Number of nodes and depth.

    Examples:
        >>> x = sp.Symbol("x")
        >>> measured(sp.sin(x) + 1)
        (4, 3)
    """
    parts, depth, level = 0, 0, [expression]
    while level:
        parts, depth = parts + len(level), depth + 1
        level = [argument for part in level for argument in part.args]
    return parts, depth


def derivative_size(expression: sp.Expr) -> int:
    """Return an upper bound of the number of nodes of a derivative, without differentiating.

    Args:
        expression: SymPy expression; each factor of a product gives one product in the derivative.

    Returns:
        Upper bound of the number of nodes.
    """
    return _sizes(expression)[1]


def _sizes(expression: sp.Expr) -> tuple[int, int]:
    parts = [_sizes(a) for a in expression.args]
    own = 1 + sum(own for own, _ in parts)
    return own, 1 + sum(derived for _, derived in parts) + len(parts) * own
