"""Numbers in expressions: small integers and fractions stay exact, others become floating point."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

import sympy as sp

from unmodelled.systems import functions as f

_LARGEST = 10**9
# Derivatives and tables leave these with numbers alone in them.
_UNEVALUATED = (f.lookup, f.select, f.greater, f.at_least, f.equal, f.minimum, f.maximum)
HIGHEST_POWER = 100


class NoValue(Exception):
    """Absence of a finite real value, or one that would take too long to compute."""


def exact_number(value: int | float) -> sp.Number:
    """Return a number as SymPy number."""
    if isinstance(value, int) and abs(value) <= _LARGEST:
        return sp.Integer(value)
    try:
        real = float(value)
    except OverflowError:
        raise NoValue from None
    if not math.isfinite(real):
        raise NoValue
    return sp.Float(real) if real else sp.S.Zero


def is_number(expression: sp.Expr) -> bool:
    """Return whether an expression has a numeric value that can be computed now."""
    return bool(expression.is_number) and not expression.has(*_UNEVALUATED)


def fraction(value: sp.Expr) -> Fraction:
    """Return a numeric expression as a fraction."""
    if isinstance(value, sp.Rational):
        return Fraction(int(value.p), int(value.q))
    return Fraction(float(value)).limit_denominator(10**6)


def folded(numeric: Callable[..., float], *parts: sp.Expr) -> sp.Number:
    """Return the value of a function of numbers, in floating point."""
    try:
        value = numeric(*(float(p) for p in parts))
    except (ArithmeticError, ValueError, TypeError):
        raise NoValue from None
    if isinstance(value, complex) or not math.isfinite(value):
        raise NoValue
    return exact_number(int(value) if isinstance(value, bool) else float(value))


def shortened(value: sp.Number) -> sp.Number:
    """Return a number, converted to floating point if its exact form has many digits."""
    exact = isinstance(value, sp.Rational) and max(abs(value.p), value.q) <= _LARGEST
    return value if exact else folded(lambda x: x, value)


def power(base: sp.Expr, exponent: sp.Expr) -> sp.Expr:
    """Return a power of two expressions."""
    if is_number(exponent):
        exponent = _simple(exponent)
        if is_number(base):
            return _power_of_number(base, exponent)
        result = base**exponent
        if any(is_number(p.exp) and abs(float(p.exp)) > HIGHEST_POWER for p in result.atoms(sp.Pow)):
            raise NoValue
        return result
    if is_number(base) and float(base) <= 0:
        raise NoValue
    return base**exponent


def _simple(exponent: sp.Expr) -> sp.Number:
    """Return an exponent such as 2.0 as 2 and 0.5 as 1/2, so that powers have simple derivatives."""
    value = folded(lambda x: x, exponent) if not isinstance(exponent, sp.Rational) else exponent
    if abs(float(value)) > HIGHEST_POWER:
        return value
    near = Fraction(float(value)).limit_denominator(8)
    return sp.Rational(near.numerator, near.denominator) if float(near) == float(value) else value


def _power_of_number(base: sp.Expr, exponent: sp.Number) -> sp.Expr:
    small = isinstance(base, sp.Rational) and max(abs(base.p), base.q) <= 1000
    if small and isinstance(exponent, sp.Integer) and abs(exponent) <= 20 and (base != 0 or exponent >= 0):
        return shortened(base**exponent)
    return folded(lambda a, b: a**b, base, exponent)


def checked_numbers(expression: sp.Expr) -> sp.Expr:
    """Return an expression after a check that every number in it is finite and real."""
    leaves = expression.atoms()
    if any(leaf in (sp.nan, sp.zoo, sp.oo, -sp.oo, sp.I) for leaf in leaves):
        raise NoValue
    exact = [leaf for leaf in leaves if isinstance(leaf, sp.Number)]
    short = {leaf: shortened(leaf) for leaf in exact}
    return expression.xreplace({k: v for k, v in short.items() if v is not k})
