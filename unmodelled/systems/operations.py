"""Functions and operators of expressions: in SymPy, for plain numbers, and for units."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import sympy as sp

from unmodelled.systems import functions as f
from unmodelled.systems import quantities as q
from unmodelled.systems.quantities import Quantity


@dataclass(frozen=True)
class Operation:
    """Function or operator that expressions can use."""

    least: int  # smallest number of arguments
    most: int  # largest number of arguments
    symbolic: Callable[..., Any]  # SymPy expression of the result
    numeric: Callable[..., float]  # result for floating-point arguments
    unit: Callable[[Sequence[Quantity]], Quantity]  # unit of the result from those of the arguments


def _clip(x: sp.Expr, low: sp.Expr, high: sp.Expr) -> sp.Expr:
    return f.minimum(f.maximum(x, low), high)


def _mod(a: sp.Expr, b: sp.Expr) -> sp.Expr:
    if b == 0:
        raise ZeroDivisionError
    return a - b * f.whole(a / b)


def _sign(x: float) -> float:
    return float((x > 0) - (x < 0))


_MANY = 100

#: What SymPy and Python call alike.
_PURE = ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log")

FUNCTIONS = {
    **{name: Operation(1, 1, getattr(sp, name), getattr(math, name), q.pure) for name in _PURE},
    "atan2": Operation(2, 2, sp.atan2, math.atan2, q.ratio),
    "sqrt": Operation(1, 1, sp.sqrt, math.sqrt, q.root),
    "abs": Operation(1, 1, f.absolute, abs, q.same),
    "sign": Operation(1, 1, f.sgn, _sign, q.flag),
    "min": Operation(2, _MANY, lambda *parts: reduce(f.minimum, parts), min, q.same),
    "max": Operation(2, _MANY, lambda *parts: reduce(f.maximum, parts), max, q.same),
    "floor": Operation(1, 1, f.whole, math.floor, q.same),
    "mod": Operation(2, 2, _mod, lambda a, b: a - b * math.floor(a / b), q.same),
    "clip": Operation(3, 3, _clip, lambda x, low, high: min(max(x, low), high), q.same),
    "heaviside": Operation(1, 1, f.step, lambda x: (_sign(x) + 1) / 2, q.flag),
    "where": Operation(3, 3, f.select, lambda c, a, b: a if c else b, q.branch),
}

COMPARISONS: dict[type[ast.cmpop], Operation] = {
    ast.Gt: Operation(2, 2, f.greater, lambda a, b: a > b, q.ratio),
    ast.Lt: Operation(2, 2, lambda a, b: f.greater(b, a), lambda a, b: a < b, q.ratio),
    ast.GtE: Operation(2, 2, f.at_least, lambda a, b: a >= b, q.ratio),
    ast.LtE: Operation(2, 2, lambda a, b: f.at_least(b, a), lambda a, b: a <= b, q.ratio),
    ast.Eq: Operation(2, 2, f.equal, lambda a, b: a == b, q.ratio),
    ast.NotEq: Operation(2, 2, lambda a, b: 1 - f.equal(a, b), lambda a, b: a != b, q.ratio),
}

#: Of any number of terms or factors.
OPERATORS: dict[type[ast.operator], Operation] = {
    ast.Add: Operation(2, _MANY, sp.Add, lambda *terms: math.fsum(terms), q.same),
    ast.Mult: Operation(2, _MANY, sp.Mul, lambda *parts: math.prod(parts), lambda p: reduce(q.product, p)),
}
#: A difference is a sum and a quotient a product.
RANKS: dict[type[ast.operator], type[ast.operator]] = {
    **{ast.Add: ast.Add, ast.Sub: ast.Add, ast.Mult: ast.Mult, ast.Div: ast.Mult},
    ast.Pow: ast.Pow,
}

#: Words that name nothing of the user's own.
RESERVED = frozenset({*FUNCTIONS, "diff", "pi", "t"})
