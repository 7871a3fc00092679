"""Translation of a law from local names to the names, units and expressions of a system."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

from unmodelled.effects.law import Fixed, Law, Memory, Shape
from unmodelled.effects.naming import fresh, renamed
from unmodelled.effects.place import Site
from unmodelled.systems import grammar, units
from unmodelled.systems.model import symbol
from unmodelled.systems.quantities import Quantity
from unmodelled.systems.scope import Scope, Value
from unmodelled.systems.units import Dimension


@dataclass(frozen=True)
class Translation:
    """Translation of a law from local names to those of a system."""

    site: Site
    law: Law
    more: tuple[str, ...] = ()  # other new names that the insertion of the law needs

    @cached_property
    def names(self) -> dict[str, str]:
        """New name in the system by name that the law declares, or that `more` lists."""
        return fresh(self.site.system, (*self.law.names, *self.more), self.site.place.name)

    def text(self, local: str, **others: str) -> str:
        """Return an expression in the names of the system."""
        known = {name: quantity.text for name, quantity in self.site.quantities.items()}
        return renamed(local, {**known, **self.names, **others})

    @cached_property
    def adds(self) -> dict[str, Value]:
        """Contribution of one unit of every amplitude and slope, by name."""
        return {name: self.value(number.adds) for name, number in self.law.terms.items()}

    @cached_property
    def rates(self) -> dict[str, Value]:
        """Contribution of one unit of every amplitude to the output that shows a rate, by name."""
        return {name: self.value(a.rate) for name, a in self.law.amplitudes.items() if a.rate}

    def value(self, local: str) -> Value:
        """Return an expression in the symbols of the system."""
        return grammar.evaluate(local, self._scope, f"the law {self.law.text}")

    @cached_property
    def units(self) -> dict[str, str]:
        """SI unit of every name that the law declares."""
        site, known = self.site, self.site.quantities
        found = {name: self._described(dimension) for name, dimension in self._dimensions.items()}
        found |= {n: known[number.like].unit for n, number in self._numbers.items() if number.like in known}
        for name, value in self.adds.items():
            own = value.expression == 1 or value.quantity.dimension == units.ONE != site.dimension
            quotient = _quotient(site.dimension, value.quantity.dimension)
            angular = self._angular(self.law.terms[name].adds)
            found[name] = angular or (site.unit if own else self._described(quotient))
        return found

    def _angular(self, adds: str) -> str:
        """Unit of a stiffness or a damping of rotation, which the radian tells from a torque; else ""."""
        known, torque = self.site.quantities, self.site.unit
        if torque != "N m" or adds not in known:
            return ""
        return {"rad": "N m/rad", "rad/s": "N m s/rad"}.get(known[adds].unit, "")

    def _described(self, dimension: Dimension | None) -> str:
        """Unit of a dimension; the rate of a torque has that of a power, but is none."""
        text = "1" if dimension is None else units.describe(dimension)
        torque = self.site.dimension == units.parse_unit("N m").dimension
        return "N m/s" if torque and text == "W" else text

    @property
    def signals(self) -> dict[str, str]:
        """Text of the quantity that a fitted number is a value of, by name of the number."""
        own = {"actuator": "u", "sensor": "y"}.get(self.site.place.kind, "")
        like = {name: shape.like for name, shape in self.law.shapes.items()}
        like |= {name: own for name, number in self.law.amplitudes.items() if number.adds == "1"}
        known = {local: quantity.text for local, quantity in self.site.quantities.items()}
        known |= {own: self.site.place.name} if own else {}  # not what the output shows
        return {self.names[name]: known[local] for name, local in like.items() if local in known}

    @property
    def _numbers(self) -> Mapping[str, Shape | Fixed | Memory]:
        return {**self.law.shapes, **self.law.fixed, **self.law.memory}

    @cached_property
    def _dimensions(self) -> dict[str, Dimension | None]:
        if self.site.dimension is None:
            return dict.fromkeys((*self._numbers, *self.law.columns))
        scope = Scope(self._coordinates)
        likes = {name: grammar.evaluate(number.like, scope, name) for name, number in self._numbers.items()}
        known = {name: value.quantity.dimension for name, value in likes.items()}
        return {**known, **dict.fromkeys(self.law.columns, units.ONE)}

    @property
    def _coordinates(self) -> dict[str, Value]:
        known = self.site.quantities
        return {local: Value(q.expression, Quantity(q.dimension)) for local, q in known.items()}

    @cached_property
    def _scope(self) -> Scope:
        declared = {
            name: Value(symbol(self.names[name]), Quantity(dimension, constant=True))
            for name, dimension in self._dimensions.items()
        }
        return Scope({**self._coordinates, **declared})


def _quotient(a: Dimension | None, b: Dimension | None) -> Dimension | None:
    return a if a is None or b is None else units.times(a, units.power(b, Fraction(-1)))
