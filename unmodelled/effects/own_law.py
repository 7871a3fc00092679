"""Laws that a user brings: a formula, its numbers with units and plausible sizes, and where it acts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf
from typing import Any, get_args

import numpy as np
import sympy as sp

from unmodelled.base.answers import check_content
from unmodelled.base.errors import BadInput, closest
from unmodelled.effects import law as laws
from unmodelled.effects.contract import check_effect
from unmodelled.effects.effect import PLACE_KINDS, LawEffect, LawKind
from unmodelled.effects.grids import stopping
from unmodelled.effects.load import carries
from unmodelled.effects.place import Kind, Place, Site
from unmodelled.effects.scales import Scales
from unmodelled.systems import grammar
from unmodelled.systems.model import Input, Output, Parameter, System, symbol
from unmodelled.systems.numeric import vanishes
from unmodelled.systems.printing import printed
from unmodelled.systems.scope import Scope, Value
from unmodelled.systems.units import parse_logged

#: Local names of a formula by kind of place, and the formula of a law of size zero.
LOCAL: Mapping[Kind, tuple[str, ...]] = {
    "port": ("x", "v", "l"),
    "actuator": ("u",),
    "sensor": ("y",),
    "parameter": ("p",),
}
ABSENT: Mapping[Kind, str] = {"port": "0", "actuator": "u", "sensor": "y", "parameter": "p"}
#: Coordinate of a port by its local name.
COORDINATES = {"x": "position", "v": "velocity"}
#: A corner of dry friction in a formula, and what a simulation can pass.
CORNER, SMOOTH, CREEP = "sign(v)", "tanh(v/v_c)", "v_c"
#: Starting values and bounds of a number in which a law is not linear, in its plausible size.
GRID, BOUNDS = (1.0 / 3.0, 1.0, 3.0), (1e-3, 1e3)
#: Complexity of a number in which the law is linear, and of another one.
LINEAR, OTHER = 1.0, 0.5


@dataclass(frozen=True)
class Number:
    """Number of a law."""

    unit: str
    plausible: float  # magnitude in this unit, positive
    #: In this unit; default: -1000 times the plausible size, or a thousandth of it with `like`.
    low: float | None = None
    high: float | None = None  # in this unit; default: 1000 times the plausible size
    like: str = ""  # local expression of its unit, such as "v", if the law is not linear in the number

    @property
    def bounds(self) -> tuple[float, float]:
        """Lowest and highest value, SI."""
        least = BOUNDS[0] * self.plausible if self.like else -BOUNDS[1] * self.plausible
        low = least if self.low is None else self.low
        high = BOUNDS[1] * self.plausible if self.high is None else self.high
        return self.si(low), self.si(high)

    def si(self, value: float) -> float:
        """Return a value of this unit in SI."""
        _, logged = parse_logged(self.unit)
        return value if logged is None else float(logged.of_differences.to_si(np.array(value)))


@dataclass(frozen=True)
class Law(LawEffect):
    """Law that a model can leave out, beside those of the library.

    The formula is in local names: x, v and l (position, velocity and load) at a port, where it is an effort
    that takes power out of the machine if it is positive; u at an input, y at an output and p at a parameter,
    where it is what acts or shows instead of them; t is the time. sign(v) is dry friction.

    Attributes:
        name: name of its family in the answer.
        formula: the law.
        numbers: numbers of the formula by name (see `Number`; a mapping with its entries will do).
        at: kind of places where it may act: port, actuator, sensor or parameter; default port.
        only: names of the ports, inputs, outputs or parameters where it may act; default: all that have what
            the formula needs.

    Raises:
        BadInput: when the formula cannot be read, or is no sum of numbers times what one unit of each adds.

    Examples:
        >>> import unmodelled as um
        >>> drag = um.Law(
        ...     "water_drag", "c*v*abs(v)", {"c": {"unit": "N m s^2/rad^2", "plausible": 0.01, "low": 0}}
        ... )
        >>> system, logs = um.example("pendulum")
        >>> um.check_law(drag, system, logs)
        ('joint',)
        >>> um.diagnose(system, logs, laws=[drag]).effects[0].family
        'coulomb_friction'
    """

    name: str
    formula: str
    numbers: Mapping[str, Number] = field(hash=False)
    at: Kind = "port"
    only: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_content(self._where, _plain(vars(self)), "law")
        made = {name: _number(self._where, name, given) for name, given in self.numbers.items()}
        object.__setattr__(self, "numbers", made)
        object.__setattr__(self, "only", tuple(self.only))
        if not self.name.isidentifier():
            raise BadInput(f"{self._where}: its name must be letters, digits and underscores")
        if not self._amplitudes:
            raise BadInput(f"{self._where}: numbers: needs one without `like`, at zero of which it is absent")
        rest = self._expression.xreplace(dict.fromkeys(map(symbol, self._amplitudes), sp.S.Zero))
        if not vanishes(rest - self._parsed(ABSENT[self.at])):
            zero = " = ".join(self._amplitudes)
            raise BadInput(
                f"{self._where}: formula: must be {ABSENT[self.at]} where {zero} = 0, not {rest}; give "
                "`like` to numbers that do not switch it off"
            )
        for name, adds in self._adds.items():
            if adds.free_symbols & set(map(symbol, self._amplitudes)):
                raise BadInput(
                    f"{self._where}: formula: must be linear in {name}; give it `like` if it is not"
                )

    @property
    def family(self) -> str:  # type: ignore[override]
        """Name of its family."""
        return self.name

    @property
    def kind(self) -> LawKind:  # type: ignore[override]
        """Subject of the law: that of laws at such places."""
        return PLACE_KINDS[self.at]

    @property
    def definition(self) -> dict[str, Any]:
        """Return what defines the law, as plain values."""
        numbers = {
            name: {k: v for k, v in vars(n).items() if v not in (None, "")}
            for name, n in self.numbers.items()
        }
        return {
            "name": self.name,
            "formula": self.formula,
            "numbers": numbers,
            "at": self.at,
            "only": [*self.only],
        }

    @property
    def _where(self) -> str:
        return f"law {self.name}"

    @cached_property
    def _amplitudes(self) -> tuple[str, ...]:
        return tuple(name for name, number in self.numbers.items() if not number.like)

    @property
    def _shapes(self) -> tuple[str, ...]:
        return tuple(name for name, number in self.numbers.items() if number.like)

    def _parsed(self, text: str) -> sp.Expr:
        names = (*LOCAL[self.at], *self.numbers, *((CREEP,) if SMOOTH in text else ()))
        known = {name: Value(symbol(name)) for name in names}
        return grammar.parse(text, Scope(known), f"{self._where}: formula")

    @cached_property
    def _expression(self) -> sp.Expr:
        return self._parsed(self.formula.replace(CORNER, SMOOTH))

    @cached_property
    def _adds(self) -> dict[str, sp.Expr]:
        """What one unit of every number adds in which the law is linear."""
        return {name: sp.diff(self._expression, symbol(name)) for name in self._amplitudes}

    def _uses(self, local: str) -> bool:
        return bool(self._expression.has(symbol(local)))

    def places(self, system: System) -> tuple[Place, ...]:
        """Return the places that have what the formula needs.

        Args:
            system: system to search.

        Returns:
            Places of the system.
        """
        if self.at == "port":
            names = [port.name for port in system.ports if all(self._has(system, port.name))]
        else:
            items: Mapping[Kind, Sequence[Input | Output | Parameter]] = {
                "actuator": system.inputs,
                "sensor": system.outputs,
                "parameter": system.parameters,
            }
            names = [item.name for item in items[self.at]]
        return tuple(Place(self.at, name) for name in names if not self.only or name in self.only)

    def _has(self, system: System, name: str) -> Iterator[bool]:
        port = system.port(name)
        for local, coordinate in COORDINATES.items():
            yield not self._uses(local) or getattr(port, coordinate) is not None
        yield not self._uses("l") or carries(system, port)

    def law(self, at: Site) -> laws.Law:
        """Return the law at a place.

        Args:
            at: place with the magnitudes of its quantities.

        Returns:
            Law in local names.
        """
        names = [*LOCAL[self.at], *self.numbers, CREEP]
        amplitudes, shapes = dict[str, laws.Amplitude](), dict[str, laws.Shape]()
        for name, number in self.numbers.items():
            size, bounds = number.si(number.plausible), number.bounds
            if number.like:
                grid = sorted({min(max(k * size, bounds[0]), bounds[1]) for k in GRID})
                shapes[name] = laws.Shape(number.like, tuple(grid), bounds)
            else:
                amplitudes[name] = laws.Amplitude(printed(self._adds[name], names, []), size, bounds)
        fixed = {CREEP: laws.Fixed("v", stopping(at))} if self._uses(CREEP) else {}
        sizes = {name: number.si(1.0) for name, number in self.numbers.items()}
        own = {n: laws.Told(factor=1.0 / s, unit=self.numbers[n].unit) for n, s in sizes.items() if s != 1.0}
        cycle = inf if self.at == "sensor" else None  # its formula knows nothing but y
        return laws.Law(self.formula, amplitudes, shapes, fixed, told=own, cycle=cycle)

    def check(self, system: System, scales: Scales) -> tuple[str, ...]:
        """Return the channels where the law can act, after a check of units and of `check_effect` there.

        Args:
            system: system to search.
            scales: magnitudes of its quantities in the logs.

        Returns:
            Names of the places.

        Raises:
            BadInput: when a number has another unit than the formula needs at a place, `only` names a place
                that the system does not have, or the law can act nowhere or keeps no rule of all laws.
        """
        found = self.places(system)
        for name in self.only:
            if name not in {place.name for place in found}:
                known = [place.name for place in replace(self, only=()).places(system)]
                end = closest(name, known)
                raise BadInput(f"{self._where}: only: {name!r} is no {self.at} with all that it needs{end}")
        if not found:
            raise BadInput(f"{self._where}: {system.name} has no {self.at} with all that its formula needs")
        for place in found:
            added = check_effect(self, system, place, scales)
            for name, own in zip(
                (*self._amplitudes, *self._shapes), (*added.amplitudes, *added.shapes), strict=True
            ):
                needed, given = (parse_logged(u)[0] for u in (added.units[own], self.numbers[name].unit))
                if needed.dimension != given.dimension:
                    raise BadInput(
                        f"{self._where}: {name}: at {place.channel} it must be in {added.units[own]}, not "
                        f"{self.numbers[name].unit}"
                    )
        return tuple(place.channel for place in found)


def _plain(given: Any) -> Any:
    """The arguments of a law as the schema of answers knows them."""
    match given:
        case Number():
            return _plain(vars(given))
        case Mapping():
            return {str(name): _plain(entry) for name, entry in given.items()}
        case np.generic():
            return given.item()
        case tuple():
            return [*given]
    return given


def _number(where: str, name: str, given: Number | Mapping[str, Any]) -> Number:
    try:
        number = Number(**_plain(given))
        low, high = number.bounds
    except (TypeError, ValueError) as fault:
        raise BadInput(f"{where}: numbers.{name}: {fault}") from None
    if not str(name).isidentifier() or name in {"t", CREEP, *(n for some in LOCAL.values() for n in some)}:
        raise BadInput(f"{where}: numbers.{name}: is no name of a number; choose another one")
    if not number.plausible > 0.0 or not low < high:
        raise BadInput(f"{where}: numbers.{name}: plausible must be positive, and low less than high")
    return number


assert set(LOCAL) == set(get_args(Kind))
