"""What is known of the unit of a part of an expression.

Plain numbers are ambiguous: the 9.81 of `F/m - 9.81` has a unit that nobody wrote down, the 2 of `2*zeta*w*v`
has none. A number that is added takes the unit of the sum. A small whole number or fraction that multiplies a
term with a parameter has no unit. Any other number may stand for a parameter, and so the unit of its product
is not known; time counts as such a number, because people write sin(t).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from unmodelled.systems import units
from unmodelled.systems.units import ONE, SECOND, Dimension


class UnitsDiffer(Exception):
    """Arguments numbered `first` and `second` have the units `units`, but must have the same."""

    def __init__(self, first: int, second: int, dimensions: tuple[Dimension, Dimension]) -> None:
        super().__init__(first, second)
        self.first, self.second = first, second
        self.units = units.describe(dimensions[0]), units.describe(dimensions[1])


class NotDimensionless(Exception):
    """An argument has the unit `unit`, but must have none."""

    def __init__(self, dimension: Dimension) -> None:
        super().__init__(dimension)
        self.unit = units.describe(dimension)


@dataclass(frozen=True)
class Quantity:
    """Dimension of a part of an expression, None where it is not known.

    Attributes:
        number: it is a number. scaled: a number multiplies it. constant: it contains a parameter.
    """

    dimension: Dimension | None
    number: bool = False
    scaled: bool = False
    constant: bool = False

    @property
    def settled(self) -> Dimension | None:
        """The dimension, where numbers leave no doubt about it."""
        return None if self.number or (self.scaled and not self.constant) else self.dimension


UNKNOWN = Quantity(None)
RATIO = Quantity(ONE)
CLOCK = Quantity(SECOND, scaled=True)


def number(value: int | float) -> Quantity:
    """The quantity of a number as it is written: 2.0 is a measured value, 2 and 0.5 are counts and shares."""
    simple = abs(value) <= 100 if isinstance(value, int) else value in (0.25, 0.5, 0.75, 1.5)
    return Quantity(ONE if simple else None, number=True)


def product(a: Quantity, b: Quantity) -> Quantity:
    """The quantity a*b."""
    known = None if a.dimension is None or b.dimension is None else units.times(a.dimension, b.dimension)
    return Quantity(
        known,
        number=a.number and b.number,
        scaled=a.scaled or b.scaled or a.number != b.number,
        constant=a.constant or b.constant,
    )


def raised(a: Quantity, exponent: Fraction | None) -> Quantity:
    """The quantity a**exponent; None is an exponent that is not a number."""
    if a.dimension is None or a.dimension == ONE:
        return a
    return replace(a, dimension=None if exponent is None else units.power(a.dimension, exponent))


def quotient(a: Quantity, b: Quantity) -> Quantity:
    """The quantity a/b."""
    return product(a, raised(b, Fraction(-1)))


def same(parts: Sequence[Quantity]) -> Quantity:
    """The quantity of a sum, a minimum and the like.

    Raises:
        UnitsDiffer: when two parts are known and differ.
    """
    known = [(i, q.settled) for i, q in enumerate(parts) if q.settled is not None]
    for i, dimension in known[1:]:
        if dimension != known[0][1]:
            raise UnitsDiffer(known[0][0], i, (known[0][1], dimension))
    constant = any(q.constant for q in parts)
    if all(q.number for q in parts):
        return Quantity(ONE if all(q.dimension == ONE for q in parts) else None, number=True)
    return Quantity(known[0][1] if known else None, constant=constant)


def ratio(parts: Sequence[Quantity]) -> Quantity:
    """The quantity of a comparison or an angle: no dimension, made of parts of one dimension."""
    return replace(RATIO, number=same(parts).number)


def pure(parts: Sequence[Quantity]) -> Quantity:
    """The quantity of a sine, an exponential and the like.

    Raises:
        NotDimensionless: when the argument has a dimension.
    """
    (argument,) = parts
    dimension = argument.settled
    if dimension is not None and dimension != ONE:
        raise NotDimensionless(dimension)
    return Quantity(ONE, number=argument.number, scaled=argument.scaled and not argument.constant)


def flag(parts: Sequence[Quantity]) -> Quantity:
    """The quantity of a sign or a step of anything."""
    return replace(RATIO, number=parts[0].number)


def root(parts: Sequence[Quantity]) -> Quantity:
    """The quantity of a square root."""
    return raised(parts[0], Fraction(1, 2))


def branch(parts: Sequence[Quantity]) -> Quantity:
    """The quantity of where(condition, a, b)."""
    try:
        return same(parts[1:])
    except UnitsDiffer as differ:
        differ.first, differ.second = differ.first + 1, differ.second + 1
        raise
