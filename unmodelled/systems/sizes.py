"""How large expressions are, and would become, so that a small file cannot ask for a huge one."""

from __future__ import annotations

import sympy as sp

LARGEST = 20_000
DEEPEST = 150
LARGEST_DERIVATIVE = 4 * LARGEST


def measured(expression: sp.Expr) -> tuple[int, int]:
    """The number of parts of the tree, and its depth."""
    parts, depth, level = 0, 0, [expression]
    while level:
        parts, depth = parts + len(level), depth + 1
        level = [argument for part in level for argument in part.args]
    return parts, depth


def derivative_size(expression: sp.Expr) -> int:
    """A bound on the parts of a derivative before it is taken: each factor of a product makes a product."""
    return _sizes(expression)[1]


def _sizes(expression: sp.Expr) -> tuple[int, int]:
    parts = [_sizes(a) for a in expression.args]
    own = 1 + sum(own for own, _ in parts)
    return own, 1 + sum(derived for _, derived in parts) + len(parts) * own
