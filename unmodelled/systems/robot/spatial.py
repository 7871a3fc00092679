"""Vectors and matrices of expressions whose intermediate results are steps of a procedure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import sympy as sp

from unmodelled.systems.procedure import is_simple

Vector = tuple[sp.Expr, sp.Expr, sp.Expr]
Matrix = tuple[Vector, Vector, Vector]  # rows
ZERO: Vector = (sp.S.Zero, sp.S.Zero, sp.S.Zero)


def number(value: float) -> sp.Expr:
    """Return a number as an expression; whole ones are exact, so that SymPy leaves out what they do."""
    return sp.Integer(int(value)) if float(value).is_integer() else sp.Float(float(value))


def numbers(values: Iterable[float]) -> Vector:
    """Return three numbers (3,) as a vector of expressions."""
    x, y, z = map(number, values)
    return x, y, z


class Steps:
    """Recorder of the steps of a procedure."""

    def __init__(self) -> None:
        self.found: list[tuple[sp.Symbol, sp.Expr]] = []
        self._names: dict[sp.Expr, sp.Symbol] = {}

    def __call__(self, e: sp.Expr) -> sp.Expr:
        """Return a name for an expression; numbers, symbols and their products need none."""
        if e.is_Number:
            return number(float(e))
        if is_simple(e):
            return e
        if e.could_extract_minus_sign():
            return -self(-e)
        if e not in self._names:
            # no name of a system file has a dot
            self._names[e] = sp.Symbol(f"robot.{len(self.found)}", real=True)
            self.found.append((self._names[e], e))
        return self._names[e]

    def vector(self, e: Sequence[sp.Expr]) -> Vector:
        """Return names for three expressions."""
        x, y, z = map(self, e)
        return x, y, z

    def cross(self, a: Vector, b: Vector) -> Vector:
        """Return the vector product a x b."""
        return self.vector((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))

    def plus(self, *vectors: Vector) -> Vector:
        """Return the sum of vectors."""
        return self.vector([sp.Add(*parts) for parts in zip(*vectors, strict=True)])

    def times(self, m: Matrix, v: Vector) -> Vector:
        """Return the product of a matrix and a vector."""
        return self.vector([sp.Add(*(a * b for a, b in zip(row, v, strict=True))) for row in m])


def transposed(m: Matrix) -> Matrix:
    """Return the transposed matrix."""
    a, b, c = zip(*m, strict=True)
    return a, b, c
