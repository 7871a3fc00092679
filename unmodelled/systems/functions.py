"""Functions with corners, as SymPy sees them: real, and with derivatives that code can be made from.

SymPy's own `sign`, `Abs`, `Min` and `Heaviside` differentiate into delta functions and nested conditions.
These differentiate almost everywhere and are zero at their corners, like the derivatives of torch.
"""

from __future__ import annotations

from typing import Any

import sympy as sp


class Corner(sp.Function):  # type: ignore[misc]
    """A real function whose derivative is zero where it has one."""

    is_real = True

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        return sp.S.Zero


class sgn(Corner):
    """-1, 0 or 1.

    >>> sgn(sp.Integer(-3))
    -1
    """

    nargs = 1

    @classmethod
    def eval(cls, x: sp.Expr) -> Any:
        return sp.sign(x) if x.is_number else None


class step(Corner):
    """0 below zero, 1 above, 1/2 at zero."""

    nargs = 1

    @classmethod
    def eval(cls, x: sp.Expr) -> Any:
        return (sp.sign(x) + 1) / 2 if x.is_number else None


class whole(Corner):
    """The largest whole number that is not larger."""

    nargs = 1

    @classmethod
    def eval(cls, x: sp.Expr) -> Any:
        return sp.floor(x) if x.is_number else None


class greater(Corner):
    """1 where the first argument is larger, else 0."""

    nargs = 2


class at_least(Corner):
    """1 where the first argument is not smaller, else 0."""

    nargs = 2


class equal(Corner):
    """1 where both arguments are the same, else 0."""

    nargs = 2


class absolute(sp.Function):  # type: ignore[misc]
    """The magnitude."""

    nargs = 1
    is_real = True

    @classmethod
    def eval(cls, x: sp.Expr) -> Any:
        return sp.Abs(x) if x.is_number else None

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        return sgn(self.args[0])


class minimum(sp.Function):  # type: ignore[misc]
    """The smaller of two."""

    nargs = 2
    is_real = True

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        a, b = self.args
        return step(b - a) if argindex == 1 else step(a - b)


class maximum(sp.Function):  # type: ignore[misc]
    """The larger of two."""

    nargs = 2
    is_real = True

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        a, b = self.args
        return step(a - b) if argindex == 1 else step(b - a)


class select(sp.Function):  # type: ignore[misc]
    """The second argument where the first is not zero, else the third."""

    nargs = 3
    is_real = True

    def _eval_derivative(self, s: sp.Symbol) -> sp.Expr:
        # branch by branch: a product with 0 would let the NaN of the branch that is not taken through
        condition, a, b = self.args
        return select(condition, sp.diff(a, s), sp.diff(b, s))


class lookup(sp.Function):  # type: ignore[misc]
    """Table number `k` (first argument) at `x` (second), differentiated as often as the third argument
    says.
    """

    nargs = 3
    is_real = True

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        table, x, order = self.args
        if argindex != 2:
            raise ValueError(f"a table must be differentiated by its argument 2, got {argindex}")
        return lookup(table, x, order + 1) if order < 3 else sp.S.Zero


#: SymPy builds these by itself, from sqrt(x**2) for instance.
_OWN = {sp.Abs: absolute, sp.sign: sgn, sp.Heaviside: step, sp.floor: whole}


def sanitised(expression: sp.Expr) -> sp.Expr:
    """`expression` with SymPy's functions with corners replaced by ours, and no delta functions."""
    for theirs, ours in _OWN.items():
        expression = expression.replace(theirs, lambda x, *_, ours=ours: ours(x))
    return expression.replace(sp.DiracDelta, lambda *_: sp.S.Zero)


def gradient(expression: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> tuple[sp.Expr, ...]:
    """Derivatives of `expression` by each of `symbols`, ready for code."""
    return tuple(sanitised(sp.diff(expression, s)) for s in symbols)
