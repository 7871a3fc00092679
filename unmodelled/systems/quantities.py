"""Units of parts of an expression, as far as they are known.

Plain numbers are ambiguous: the 9.81 of `F/m - 9.81` has a unit that is not written, the 2 of `2*zeta*w*v`
has none. A number that is added takes the unit of the sum. A small integer or fraction that multiplies a term
with a parameter has no unit. Any other number may stand for a parameter, so the unit of its product is
unknown. Time counts as such a number, because sin(t) is a common expression.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from unmodelled.systems import units
from unmodelled.systems.units import ONE, SECOND, Dimension


class UnitsDiffer(Exception):
    """Conflict of two arguments, given by their indices, that must have the same unit."""

    def __init__(self, first: int, second: int, dimensions: tuple[Dimension, Dimension]) -> None:
        super().__init__(first, second)
        self.first, self.second = first, second
        self.units = units.describe(dimensions[0]), units.describe(dimensions[1])


class NotDimensionless(Exception):
    """Argument with a unit where none is allowed."""

    def __init__(self, dimension: Dimension) -> None:
        super().__init__(dimension)
        self.unit = units.describe(dimension)


@dataclass(frozen=True)
class Quantity:
    """Dimension of a part of an expression."""

    dimension: Dimension | None  # None if unknown
    number: bool = False  # whether the part is a plain number
    scaled: bool = False  # whether a plain number multiplies the part
    constant: bool = False  # whether the part contains a parameter or a constant

    @property
    def settled(self) -> Dimension | None:
        """Dimension if plain numbers leave no doubt about it, otherwise None."""
        return None if self.number or (self.scaled and not self.constant) else self.dimension


UNKNOWN = Quantity(None)
RATIO = Quantity(ONE)
CLOCK = Quantity(SECOND, scaled=True)


def literal(value: int | float) -> Quantity:
    """Return the quantity of a written number: 2.0 can have a unit, 2 and 0.5 are counts and fractions."""
    simple = abs(value) <= 100 if isinstance(value, int) else value in (0.25, 0.5, 0.75, 1.5)
    return Quantity(ONE if simple else None, number=True)


def number_with_unit(value: float) -> str:
    """Return a number as text that an expression takes for a quantity of any unit, see `literal`.

    Examples:
        >>> number_with_unit(-20.0), number_with_unit(0.5)
        ('-20.0', '0.5*1.0')
    """
    text = repr(value)
    return text if literal(abs(value)).dimension is None else f"{text}*1.0"


def product(a: Quantity, b: Quantity) -> Quantity:
    """Return the quantity of a product."""
    known = None if a.dimension is None or b.dimension is None else units.times(a.dimension, b.dimension)
    return Quantity(
        known,
        number=a.number and b.number,
        scaled=a.scaled or b.scaled or a.number != b.number,
        constant=a.constant or b.constant,
    )


def raised(a: Quantity, exponent: Fraction | None) -> Quantity:
    """Return the quantity of a power."""
    if a.dimension is None or a.dimension == ONE:
        return a
    return replace(a, dimension=None if exponent is None else units.power(a.dimension, exponent))


def quotient(a: Quantity, b: Quantity) -> Quantity:
    """Return the quantity of a quotient."""
    return product(a, raised(b, Fraction(-1)))


def same(parts: Sequence[Quantity]) -> Quantity:
    """Return the common quantity of the arguments of a sum, a minimum or a maximum."""
    known = [(i, q.settled) for i, q in enumerate(parts) if q.settled is not None]
    for i, dimension in known[1:]:
        if dimension != known[0][1]:
            raise UnitsDiffer(known[0][0], i, (known[0][1], dimension))
    constant = any(q.constant for q in parts)
    if all(q.number for q in parts):
        return Quantity(ONE if all(q.dimension == ONE for q in parts) else None, number=True)
    return Quantity(known[0][1] if known else None, constant=constant)


def ratio(parts: Sequence[Quantity]) -> Quantity:
    """Return the quantity of a comparison or of atan2: dimensionless, from arguments of one dimension."""
    return replace(RATIO, number=same(parts).number)


def pure(parts: Sequence[Quantity]) -> Quantity:
    """Return the quantity of a function that needs a dimensionless argument, such as a sine."""
    (argument,) = parts
    dimension = argument.settled
    if dimension is not None and dimension != ONE:
        raise NotDimensionless(dimension)
    return Quantity(ONE, number=argument.number, scaled=argument.scaled and not argument.constant)


def flag(parts: Sequence[Quantity]) -> Quantity:
    """Return the quantity of a sign or a unit step: dimensionless."""
    return replace(RATIO, number=parts[0].number)


def root(parts: Sequence[Quantity]) -> Quantity:
    """Return the quantity of a square root."""
    return raised(parts[0], Fraction(1, 2))


def branch(parts: Sequence[Quantity]) -> Quantity:
    """Return the quantity of where(condition, a, b)."""
    try:
        return same(parts[1:])
    except UnitsDiffer as differ:
        differ.first, differ.second = differ.first + 1, differ.second + 1
        raise
