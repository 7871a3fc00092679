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
