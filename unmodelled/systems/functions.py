"""Real functions with corners, as SymPy functions whose derivatives can be turned into code.

SymPy's own `sign`, `Abs`, `Min` and `Heaviside` differentiate into delta functions and nested conditions.
These functions have a derivative almost everywhere, and zero at their corners, as in PyTorch.
"""

from __future__ import annotations

from typing import Any

import sympy as sp


class Corner(sp.Function):  # type: ignore[misc]
    """Real function whose derivative is zero wherever it exists."""

    is_real = True

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        return sp.S.Zero


class sgn(Corner):
    """Sign of the argument: -1, 0 or 1."""

    nargs = 1

    @classmethod
    def eval(cls, x: sp.Expr) -> Any:
        return sp.sign(x) if x.is_number else None


class step(Corner):
    """Unit step: 0 for a negative argument, 1 for a positive one, 1/2 at zero."""

    nargs = 1

    @classmethod
    def eval(cls, x: sp.Expr) -> Any:
        return (sp.sign(x) + 1) / 2 if x.is_number else None


class whole(Corner):
    """Floor: the largest integer that does not exceed the argument."""

    nargs = 1

    @classmethod
    def eval(cls, x: sp.Expr) -> Any:
        return sp.floor(x) if x.is_number else None


class greater(Corner):
    """Comparison a > b: 1 if the first argument is larger, otherwise 0."""

    nargs = 2


class at_least(Corner):
    """Comparison a >= b: 1 if the first argument is larger or equal, otherwise 0."""

    nargs = 2


class equal(Corner):
    """Comparison a == b: 1 if both arguments are equal, otherwise 0."""

    nargs = 2


class absolute(sp.Function):  # type: ignore[misc]
    """Absolute value; its derivative is `sgn`."""

    nargs = 1
    is_real = True

    @classmethod
    def eval(cls, x: sp.Expr) -> Any:
        return sp.Abs(x) if x.is_number else None

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        return sgn(self.args[0])


class minimum(sp.Function):  # type: ignore[misc]
    """Smaller one of two arguments."""

    nargs = 2
    is_real = True

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        a, b = self.args
        return step(b - a) if argindex == 1 else step(a - b)


class maximum(sp.Function):  # type: ignore[misc]
    """Larger one of two arguments."""

    nargs = 2
    is_real = True

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        a, b = self.args
        return step(a - b) if argindex == 1 else step(b - a)


class select(sp.Function):  # type: ignore[misc]
    """Second argument if the first one is not zero, otherwise the third one."""

    nargs = 3
    is_real = True

    def _eval_derivative(self, s: sp.Symbol) -> sp.Expr:
        # branch by branch: a product with 0 would let the NaN of the branch that is not taken through
        condition, a, b = self.args
        return select(condition, sp.diff(a, s), sp.diff(b, s))


class lookup(sp.Function):  # type: ignore[misc]
    """Characteristic number k (first argument) at x (second), differentiated n times (third, 0 to 3)."""

    nargs = 3
    is_real = True

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        table, x, order = self.args
        if argindex != 2:
            raise ValueError(f"a table must be differentiated by its argument 2, got {argindex}")
        return lookup(table, x, order + 1) if order < 3 else sp.S.Zero


#: SymPy builds these by itself, from sqrt(x**2) for instance.
_OWN = {
    **{sp.Abs: absolute, sp.sign: sgn, sp.Heaviside: step, sp.floor: whole},
    sp.DiracDelta: lambda _: sp.S.Zero,
}


def sanitised(expression: sp.Expr) -> sp.Expr:
    """Return an expression with SymPy's own functions with corners replaced and delta functions removed."""
    for theirs, ours in _OWN.items():
        if expression.has(theirs):
            expression = expression.replace(theirs, lambda x, *_, ours=ours: ours(x))
    return expression


def gradient(expression: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> tuple[sp.Expr, ...]:
    """Return the derivatives of an expression by several symbols, ready for code generation."""
    return tuple(sanitised(sp.diff(expression, s)) for s in symbols)
