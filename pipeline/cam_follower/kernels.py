"""Generate functions from symbolic equations: torch for gradients, numpy for tables, numba for loops."""

from collections.abc import Callable, Sequence
from typing import Any

import sympy as sp

Function = Callable[..., Any]


def numpy_function(expression: sp.Expr, arguments: Sequence[sp.Symbol]) -> Function:
    """Generate a vectorised numpy function, with common sub-expressions computed once."""
    function: Function = sp.lambdify(arguments, expression, modules="numpy", cse=True)
    return function


def torch_function(expression: sp.Expr, arguments: Sequence[sp.Symbol]) -> Function:
    """Generate a torch function; symbols inside nonlinear functions must be tensors."""
    function: Function = sp.lambdify(arguments, expression, modules="torch", cse=True)
    return function


def compiled_function(expression: sp.Expr, arguments: Sequence[sp.Symbol]) -> Function:
    """Generate a scalar function compiled by numba, for use in other compiled loops.

    A loop that is kept on disk is compiled again when its room changes (`unmodelled.base.compiling`), so that
    the expression must be written in the same room.
    """
    import numba

    plain = sp.lambdify(arguments, expression, modules="math", cse=True)
    plain.__module__ = __name__  # without one it would count as a builtin
    function: Function = numba.njit(plain, error_model="numpy", inline="always")
    return function
