"""Units of a system file, and the dimensions by which expressions are checked."""

from __future__ import annotations

import math
import re
import tokenize
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import product

import pint

from unmodelled.base.arrays import Array

#: Exponents of kg, m, s, A, K, mol and cd.
Dimension = tuple[Fraction, ...]

_BASE = ("kg", "m", "s", "A", "K", "mol", "cd")
_NAMES = ("mass", "length", "time", "current", "temperature", "substance", "luminosity")
_NAMED = ("N", "N m", "W", "Pa", "V", "C", "ohm", "F", "H", "Wb", "T", "N m s", "N s/m", "N/m")
#: Named units that people divide and multiply by others.
_COMPOSED = ("N", "W", "V", "ohm")

ONE: Dimension = (Fraction(0),) * len(_BASE)
SECOND: Dimension = tuple(Fraction(int(name == "s")) for name in _BASE)

_LONGEST = 60
# A power follows a name only and is small, so that nothing large is ever computed.
_SHAPE = re.compile(r"(?:[A-Za-zµμΩ°%]+(?:(?:\^|\*\*)-?\d(?:\.5)?)?|1|[ */()·])*")
# pint would read Nm as "number of metres" and Ns as several newtons.
_RUN_TOGETHER = re.compile(r"\b([kMmµ]?(?:N|V|W|J|C|Pa)|A)(m?)(s?)\b")
# What pint and the tokeniser that it uses raise, besides, on units such as "m /" and "(m".
_MALFORMED = (
    pint.PintError,
    tokenize.TokenError,
    ArithmeticError,
    AssertionError,
    LookupError,
    SyntaxError,
    TypeError,
    ValueError,
)
_SPELLED = str.maketrans({"²": "^2", "³": "^3", "·": " ", "⋅": " ", "Ω": "Ω"})
#: A power without a sign for it: rad s-1, kg m2; not one that runs into another unit, as in W/m2K.
_POWER = re.compile(r"(?<![\w.])([A-Za-zµμΩ]+)(-?\d)(?![A-Za-z\d])")
_PREFIXED = re.compile(r"(?<![A-Za-z])[kMmµμcGnd](?=[A-Za-zΩ])")


@dataclass(frozen=True)
class Unit:
    """Coherent SI unit, as written, with its dimension."""

    text: str
    dimension: Dimension


@dataclass(frozen=True)
class LoggedUnit:
    """Unit of a column of a log, as written, that is no coherent SI unit."""

    text: str
    factor: float  # SI value of one unit, less that of zero units
    offset: float  # SI value of zero units

    def to_si(self, values: Array) -> Array:
        """Convert values (...) of the column to SI units."""
        return self.offset + self.factor * values

    def from_si(self, values: Array) -> Array:
        """Convert values (...) in SI units to those of the column."""
        return (values - self.offset) / self.factor

    @property
    def of_differences(self) -> LoggedUnit:
        """Return the unit of differences, rates and standard deviations: 1 degC more is 1 K more."""
        return LoggedUnit(self.text, self.factor, 0.0)


#: Of values between which a unit must be in proportion: decibels, octaves and the like are not.
_LINEAR_AT = 3.0


def parse_logged(text: str) -> tuple[Unit, LoggedUnit | None]:
    """Parse the unit of a column of a log, which may be any unit."""
    one, zero, far = (_in_si(text, value) for value in (1.0, 0.0, _LINEAR_AT))
    logged = LoggedUnit(text, one.value - zero.value, zero.value)
    if not math.isclose(far.value, logged.offset + logged.factor * _LINEAR_AT, rel_tol=1e-9):
        raise ValueError(f"{text!r} is a logarithmic unit: log the quantity in {one.name}")
    return (Unit(text, one.dimension), None) if _is_coherent(one) else (Unit(one.name, one.dimension), logged)


def parse_unit(text: str) -> Unit:
    """Parse a unit, which must be a coherent SI unit."""
    return Unit(text, _dimension(text))


@dataclass(frozen=True)
class _Quantity:
    """A number in SI units; `angle` is the name of its unit if it contains the radian."""

    value: float
    dimension: Dimension
    angle: str = ""

    @property
    def name(self) -> str:
        """Name of the SI unit."""
        return self.angle or describe(self.dimension)


def _is_coherent(one: _Quantity) -> bool:
    return math.isclose(one.value, 1.0, rel_tol=1e-9)


@cache
def _dimension(text: str) -> Dimension:
    one = _in_si(text, 1.0)
    if not _is_coherent(one):
        name = _without_prefixes(text) or one.name
        offset = _in_si(text, 0.0).value
        told = "" if offset else f": 1 {text} = {one.value:.6g} {name if name != '1' else ''}".rstrip()
        raise ValueError(f"{text!r} must be in SI units, e.g. {name} instead of {text}{told}")
    return one.dimension


def _without_prefixes(text: str) -> str:
    """Return the unit without its prefixes if that is the SI unit (J/K for kJ/K); otherwise empty."""
    plain = _PREFIXED.sub("", _apart(text))
    try:
        return plain if plain != text and _is_coherent(_in_si(plain, 1.0)) else ""
    except ValueError:
        return ""


@cache
def _in_si(text: str, value: float) -> _Quantity:
    spelled = _POWER.sub(r"\1^\2", text.strip().translate(_SPELLED).replace("Ohm", "ohm"))
    if spelled in ("", "-", "1"):
        return _Quantity(value, ONE)
    if len(text) > _LONGEST or not _SHAPE.fullmatch(spelled):
        raise ValueError(f"{text[:_LONGEST]!r} is not a unit; write for instance N s/m or kg m^2")
    spelled = _apart(spelled)
    try:
        base = _registry().Quantity(value, _registry().parse_units(spelled)).to_base_units()
    except pint.UndefinedUnitError as error:
        raise ValueError(f"unknown unit {str(error.args[0])!r} in {text!r}") from None
    except _MALFORMED:
        raise ValueError(f"{text!r} is not a unit; write for instance N s/m or kg m^2") from None
    exponents = {name: str(e) for name, e in base.dimensionality.items()}
    dimension = tuple(Fraction(exponents.get(f"[{name}]", "0")) for name in _NAMES)
    angle = f"{base.units:~C}".replace("**", "^") if "radian" in dict(base.unit_items()) else ""
    return _Quantity(float(base.magnitude), dimension, angle)


def _apart(text: str) -> str:
    return _RUN_TOGETHER.sub(lambda found: " ".join(filter(None, found.groups())), text)


@cache
def _registry() -> pint.UnitRegistry[float]:
    registry: pint.UnitRegistry[float] = pint.UnitRegistry()
    registry.define("@alias turn = rev = revs")
    return registry


def times(a: Dimension, b: Dimension) -> Dimension:
    """Return the dimension of a product."""
    return tuple(x + y for x, y in zip(a, b, strict=True))


def power(a: Dimension, exponent: Fraction) -> Dimension:
    """Return the dimension of a power."""
    return tuple(x * exponent for x in a)


@cache
def describe(dimension: Dimension) -> str:
    """Return a unit of a dimension.

    Examples:
        >>> units = "kg m/s^2", "m^0.5/s", "kg m^2/(s^3 K)", "m^4 s/kg"
        >>> [describe(parse_unit(text).dimension) for text in units]
        ['N', 'm^0.5/s', 'W/K', 'm^3/(Pa s)']
    """
    if dimension == ONE:
        return "1"
    exact = {_dimension(name): name for name in reversed(_NAMED)}
    if dimension in exact:
        return exact[dimension]
    spelled = [dict(zip(_BASE, dimension, strict=True))]
    for names, most in ((_COMPOSED, 1), ((*_COMPOSED, "Pa"), 2)):
        if len(spelled) == 1 and sum(e != 0 for e in dimension) > 2:
            spelled += _composed(dimension, names, most)
    return _written(min(spelled, key=lambda exponents: sum(1 + abs(e) for e in exponents.values() if e)))


def _composed(dimension: Dimension, names: Sequence[str], most: int) -> Iterator[dict[str, Fraction]]:
    """Exponents of a named unit and of so many base units that give a dimension."""
    for name, e in product(names, (1, -1, 2, -2)):
        rest = times(dimension, power(_dimension(name), Fraction(-e)))
        if sum(exponent != 0 for exponent in rest) <= most:
            yield {name: Fraction(e), **dict(zip(_BASE, rest, strict=True))}


def _written(exponents: Mapping[str, Fraction]) -> str:
    above = [_raised(name, e) for name, e in exponents.items() if e > 0]
    below = [_raised(name, -e) for name, e in exponents.items() if e < 0]
    bottom = f"({' '.join(below)})" if len(below) > 1 else "".join(below)
    return (" ".join(above) or "1") + (f"/{bottom}" if below else "")


def _raised(name: str, exponent: Fraction) -> str:
    if exponent == 1:
        return name
    exact = Fraction(f"{float(exponent):g}") == exponent
    return f"{name}^{float(exponent):g}" if exact else f"{name}^({exponent})"
