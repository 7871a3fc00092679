"""Expressions of a system as vectorised NumPy functions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.systems.model import TIME, System
from unmodelled.systems.procedure import common_parts
from unmodelled.systems.tables import Table

SystemFunction = Callable[[Any, Any, Any, Any, Any, Any], Array]

#: Random points at which an expression is compared with zero, and its rounding error in its largest terms.
POINTS, ROUNDING = 40, 1e-9
#: What the functions with corners mean in numpy; `lookup` needs the tables of a system.
NUMPY: dict[str, Callable[..., Any]] = {
    "sgn": np.sign,
    "step": lambda x: np.heaviside(x, 0.5),
    "whole": np.floor,
    "greater": lambda a, b: np.where(a > b, 1.0, 0.0),
    "at_least": lambda a, b: np.where(a >= b, 1.0, 0.0),
    "equal": lambda a, b: np.where(a == b, 1.0, 0.0),
    "absolute": np.abs,
    "minimum": np.minimum,
    "maximum": np.maximum,
    "select": lambda condition, a, b: np.where(condition != 0.0, a, b),
}


def numpy_system_function(
    system: System, expressions: Sequence[sp.Expr], efforts_zero: bool = False
) -> SystemFunction:
    """Return a NumPy function f(t, x, u, e, p, c) that evaluates k expressions of a system, shape (..., k).

    Its arguments broadcast in leading axes: t (...) in s, x (..., states), u (..., inputs), e (..., ports), p
    (..., parameters) and c (..., constants of the operating point), in SI units.
    """
    if efforts_zero:
        expressions = [f.xreplace(dict.fromkeys(system.e, sp.S.Zero)) for f in expressions]
    groups = [system.x, system.u, () if efforts_zero else system.e, system.p, system.c]
    symbols = TIME, *(s for group in groups for s in group)
    code = _code(tuple(expressions), symbols, tuple(system.tables))

    def function(t: Any, x: Any, u: Any, e: Any, p: Any, c: Any) -> Array:
        arrays = [np.asarray(a, np.float64) for a in (x, u, np.empty(0) if efforts_zero else e, p, c)]
        t = np.asarray(t, np.float64)
        shape = np.broadcast_shapes(t.shape, *(a.shape[:-1] for a in arrays))
        with np.errstate(all="ignore"):
            values = code(t, *(a[..., i] for a in arrays for i in range(a.shape[-1])))
        result = np.empty((*shape, len(values)))
        for i, value in enumerate(values):
            result[..., i] = value
        return result

    return function


def numpy_function(expression: sp.Expr, *symbols: sp.Symbol) -> Callable[..., Array]:
    """Return a NumPy function that evaluates an expression without tables; arguments (...) broadcast."""
    code = _code((expression,), symbols, ())

    def function(*values: Any) -> Array:
        (value,) = code(*values)
        return np.array(np.broadcast_arrays(value, *values)[0], np.float64)

    return function


def vanishes(expression: sp.Expr) -> bool:
    """Return whether an expression is zero, but for rounding, at random values of its symbols.

    Values of either sign and of 0.001 to 1000 are tried. To simplify an expression instead can take hours.
    """
    if expression.has(sp.zoo, sp.oo, sp.nan):
        return False
    symbols = tuple(sorted(expression.free_symbols, key=str))
    draw = np.random.default_rng(0).uniform
    at = draw(-1.0, 1.0, (len(symbols), POINTS)) * 10.0 ** draw(-3.0, 3.0, (len(symbols), POINTS))
    code = _code((expression, _size(expression)), symbols, ())
    with np.errstate(all="ignore"):
        value, size = (np.broadcast_to(found, POINTS) for found in code(*at))
    known = np.isfinite(value) & np.isfinite(size)
    return bool(known.any() and (np.abs(value) <= ROUNDING * np.abs(size))[known].all())


def _size(expression: sp.Expr) -> sp.Expr:
    """Size of the terms of an expression, which their sum can be far below: all of them positive."""
    if isinstance(expression, sp.Add | sp.Mul):
        return expression.func(*map(_size, expression.args))
    if isinstance(expression, sp.Pow) and expression.exp.is_Integer and expression.exp > 0:
        return _size(expression.base) ** expression.exp
    return sp.Abs(expression)


@lru_cache(maxsize=256)
def _code(
    expressions: tuple[sp.Expr, ...], symbols: tuple[sp.Symbol, ...], tables: tuple[Table, ...]
) -> Callable[..., Any]:
    """Code that SymPy writes for some expressions; a diagnosis asks for the same ones several times."""
    # a user's names are then never names in the code, and sums are always added up in the same order
    plain = {symbol: sp.Symbol(f"argument_{k:04}", real=True) for k, symbol in enumerate(symbols)}
    code: Callable[..., Any] = sp.lambdify(
        list(plain.values()),
        [f.xreplace(plain) for f in expressions],
        modules=[{**NUMPY, "lookup": lambda k, x, order: tables[int(k)](x, int(order))}, "numpy"],
        cse=common_parts,
    )
    return code
