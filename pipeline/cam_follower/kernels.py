"""Functions generated from symbolic physics: torch for autograd, numpy for tables, numba for hot loops."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import sympy as sp

Function = Callable[..., Any]


def numpy_function(expression: sp.Expr, arguments: Sequence[sp.Symbol]) -> Function:
    """A vectorised numpy function of `arguments`, common sub-expressions computed once."""
    function: Function = sp.lambdify(arguments, expression, modules="numpy", cse=True)
    return function


def torch_function(expression: sp.Expr, arguments: Sequence[sp.Symbol]) -> Function:
    """A torch function of `arguments`; the symbols inside nonlinear functions must be tensors."""
    function: Function = sp.lambdify(arguments, expression, modules="torch", cse=True)
    return function


def compiled_function(expression: sp.Expr, arguments: Sequence[sp.Symbol]) -> Function:
    """A scalar function compiled by numba, to be called from other compiled loops."""
    import numba

    plain = sp.lambdify(arguments, expression, modules="math", cse=True)
    function: Function = numba.njit(plain, error_model="numpy", inline="always")
    return function
