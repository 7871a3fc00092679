"""Place where an effect acts, and the quantities there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Literal

import sympy as sp

from unmodelled.effects.known_terms import driven_port, stiffness
from unmodelled.effects.motion import is_inertial
from unmodelled.effects.outputs import direct_input, rate_output
from unmodelled.effects.scales import Scales, Spread
from unmodelled.effects.surroundings import TEMPERATURE, surroundings
from unmodelled.systems import units
from unmodelled.systems.grammar import evaluate
from unmodelled.systems.model import System, symbol
from unmodelled.systems.printing import printed
from unmodelled.systems.quantities import Quantity
from unmodelled.systems.scope import Value, scope_of
from unmodelled.systems.units import SECOND, Dimension, parse_unit

#: K; a temperature that is never lower is no rise above another one.
ABSOLUTE = 150.0
#: 0 degC, K.
FREEZING = 273.15
Kind = Literal["port", "actuator", "sensor", "parameter"]


@dataclass(frozen=True)
class Place:
    """Place where an effect acts.

    Attributes:
        kind: kind of place.
        name: name of the port, input, output or parameter.
        factor: name of a constant of the operating point, or of a column of experiments.csv such as `group`,
            that limits the effect to some experiments; default None: all experiments.
        level: value of `factor` in the experiments where the effect acts; default None.
        signal: name of another input that the law reads; default None.
    """

    kind: Kind
    name: str
    factor: str | None = None
    level: float | str | None = None
    signal: str | None = None

    @property
    def channel(self) -> str:
        """Name of the place in a diagnosis: name of the port, actuator:<input>, sensor:<output> or
        parameter:<name>.
        """
        return self.name if self.kind == "port" else f"{self.kind}:{self.name}"

    @property
    def everywhere(self) -> Place:
        """Return the place in all experiments."""
        return replace(self, factor=None, level=None)


@dataclass(frozen=True)
class SiteQuantity:
    """Quantity that a local name of a law stands for.

    Attributes:
        text: expression in names of the system file.
        expression: SymPy expression of `text`.
        unit: SI unit.
        dimension: exponents of the base units; None if the file has no units.
        spread: range of its values in the logs.
    """

    text: str
    expression: sp.Expr
    unit: str
    dimension: Dimension | None
    spread: Spread


@dataclass(frozen=True)
class Site:
    """Place in a system with the magnitudes of its quantities.

    Attributes:
        system: system of the place.
        place: place where the effect acts.
        unit: SI unit of the law.
        dimension: exponents of the base units of the law; None if the file has no units.
        quantities: quantities by local name (see `law`).
        effort: plausible magnitude of the law, in SI units.
        period: sampling period in s.
        duration: duration of the longest experiment in s.
        mobility: largest acceleration of the port per effort, in SI units; default 0.
    """

    system: System
    place: Place
    unit: str
    dimension: Dimension | None
    quantities: Mapping[str, SiteQuantity]
    effort: float
    period: float
    duration: float
    mobility: float = 0.0

    def __getitem__(self, local: str) -> Spread:
        """Return the range of values of a local name."""
        return self.quantities[local].spread

    def __contains__(self, local: str) -> bool:
        return local in self.quantities

    def zero(self, local: str) -> float:
        """Return the zero of the scale on which a quantity is measured, in SI units.

        It is 0 degC for a temperature, unless the quantity comes near 0 K, as the rise of a temperature does.

        Args:
            local: local name of the quantity.
        """
        absolute = self.quantities[local].dimension == TEMPERATURE and self[local].low > ABSOLUTE
        return FREEZING if absolute else 0.0


def site(system: System, place: Place, scales: Scales) -> Site:
    """Return a place with the magnitudes of its quantities.

    Args:
        system: system of the place.
        place: place where an effect acts.
        scales: magnitudes of the system's quantities in the logs.

    Returns:
        Place with quantities by local name.

    Raises:
        KeyError: if the system has no such place.
    """
    makers = {"port": _port, "actuator": _input, "sensor": _output, "parameter": _parameter}
    found = makers[place.kind](system, place, scales)
    if place.signal is None:
        return found
    (item,) = (item for item in system.inputs if item.name == place.signal)
    read = _quantity(system, item.name, symbol(item.name), item.unit, scales.of[item.name])
    return replace(found, quantities={**found.quantities, "w": read})


def _port(system: System, place: Place, scales: Scales) -> Site:
    port = system.port(place.name)
    effort, size = _dimension(system, port.unit), scales.effort[port.name]
    mobility = scales.mobility[port.name]
    found = {
        local: _coordinate(system, local, name, effort, scales)
        for local, name in (("x", port.position), ("v", port.velocity))
        if name is not None
    }
    if (carried := scales.loads.get(port.name)) is not None:
        found["l"] = _quantity(system, carried.text, carried.expression, port.unit, carried.spread)
    if (around := surroundings(system, port, scales.of)) is not None:
        spread = scales.of[around.name]
        found["u"] = _quantity(system, around.name, symbol(around.name), around.unit, spread)
    if (spring := stiffness(system, port)) is not None:
        found["s"] = _stiffness(system, spring, effort, found["x"])
    if is_inertial(system, port):
        rms = mobility * size
        unit, spread = _acceleration_unit(effort, found["v"]), Spread(-rms, rms, rms)
        found["a"] = _quantity(system, "a", sp.Dummy("a", real=True), unit, spread)
    return Site(system, place, port.unit, effort, found, size, scales.period, scales.duration, mobility)


def _coordinate(
    system: System, local: str, name: str, effort: Dimension | None, scales: Scales
) -> SiteQuantity:
    unit = coordinate_unit(system, name, _motion_unit(local, effort))
    return _quantity(system, name, system.expression(name), unit, scales.of[name])


def coordinate_unit(system: System, name: str, usual: str = "1") -> str:
    """Return the unit of a state or signal, `usual` for a signal whose expression leaves a doubt.

    Args:
        system: system with the state or signal.
        name: name of the state or signal.
        usual: unit of a signal that may have any; default that of a number.
    """
    units_of = {s.name: s.unit for s in system.states}
    return units_of.get(name) or _signal_unit(system, name, usual)


def _signal_unit(system: System, name: str, usual: str) -> str:
    """Return the unit of a signal by its expression; `usual` where that agrees or leaves a doubt."""
    place = f"signals.{name}"
    if place not in system.text:
        return usual
    lists = (system.states, system.inputs, system.operating_point, system.parameters)
    named = {item.name: item.unit for items in lists for item in items}
    named |= {port.effort: port.unit for port in system.ports}
    own = {n: Value(symbol(n), Quantity(_dimension(system, unit))) for n, unit in named.items()}
    scope = scope_of(system)
    found = evaluate(system.text[place], replace(scope, values={**scope.values, **own}), place)
    dimension = found.quantity.settled
    return usual if dimension in (None, parse_unit(usual).dimension) else units.describe(dimension)


def _stiffness(system: System, spring: sp.Expr, effort: Dimension | None, x: SiteQuantity) -> SiteQuantity:
    size, unit = float(spring.xreplace(dict(zip(system.p, system.values, strict=True)))), "1"
    if effort is not None and x.dimension is not None:
        unit = units.describe(units.times(effort, units.power(x.dimension, Fraction(-1))))
    text = printed(spring, [str(p) for p in system.p], [])
    text = f"({text})" if isinstance(spring, sp.Add) else text
    return _quantity(system, text, spring, unit, Spread(size, size, abs(size)))


def _acceleration_unit(effort: Dimension | None, v: SiteQuantity) -> str:
    if effort is None or v.dimension is None or units.times(effort, v.dimension) == parse_unit("W").dimension:
        return _motion_unit("a", effort)
    return units.describe(units.times(v.dimension, units.power(SECOND, Fraction(-1))))


def _motion_unit(local: str, effort: Dimension | None) -> str:
    """Return the unit of position, velocity or acceleration: effort times velocity is a power."""
    if effort is None:
        return "1"
    velocity = units.times(parse_unit("W").dimension, units.power(effort, Fraction(-1)))
    if units.times(velocity, SECOND) == units.ONE:
        return {"x": "rad", "v": "rad/s", "a": "rad/s^2"}[local]
    return units.describe(
        units.times(velocity, units.power(SECOND, Fraction({"x": 1, "v": 0, "a": -1}[local])))
    )


def _input(system: System, place: Place, scales: Scales) -> Site:
    item = {i.name: i for i in system.inputs}[place.name]
    quantity = _quantity(system, item.name, symbol(item.name), item.unit, scales.of[item.name])
    found = _single(system, place, scales, "u", quantity)
    if (driven := driven_port(system, item)) is None:
        return found
    port, sign = driven
    name = str(port.velocity)
    v = _coordinate(system, "v", name, _dimension(system, port.unit), scales)
    if sign < 0:
        back = Spread(-v.spread.high, -v.spread.low, v.spread.rms)
        v = replace(v, text=f"(-{name})", expression=-v.expression, spread=back)
    return replace(found, quantities={**found.quantities, "v": v})


def _output(system: System, place: Place, scales: Scales) -> Site:
    item = {o.name: o for o in system.outputs}[place.name]
    written = system.text.get(f"outputs.{item.name}.expression")
    text = item.name if written is None else f"({written})"
    quantity = _quantity(system, text, item.expression, item.unit, scales.outputs[item.name])
    found = _single(system, place, scales, "y", quantity)
    if (shown := rate_output(system, item.name)) is not None:
        written = system.text.get(f"outputs.{shown.name}.expression")
        text = shown.name if written is None else f"({written})"
        r = _quantity(system, text, shown.expression, shown.unit, scales.outputs[shown.name])
        found = replace(found, quantities={**found.quantities, "r": r})
    if (direct := direct_input(system, item)) is None:
        return found
    u = _quantity(system, direct.name, symbol(direct.name), direct.unit, scales.of[direct.name])
    return replace(found, quantities={**found.quantities, "u": u})


def _parameter(system: System, place: Place, scales: Scales) -> Site:
    item = {p.name: p for p in system.parameters}[place.name]
    low, high = item.limits
    size = abs(item.value) or (0.5 * (high - low) if high - low < float("inf") else 1.0)
    spread = Spread(item.value, item.value, size)
    quantity = _quantity(system, item.name, symbol(item.name), item.unit, spread)
    return _single(system, place, scales, "p", quantity)


def _single(system: System, place: Place, scales: Scales, local: str, quantity: SiteQuantity) -> Site:
    return Site(
        *(system, place, quantity.unit, quantity.dimension, {local: quantity}),
        *(quantity.spread.rms, scales.period, scales.duration),
    )


def _quantity(system: System, text: str, expression: sp.Expr, unit: str, spread: Spread) -> SiteQuantity:
    return SiteQuantity(text, expression, unit, _dimension(system, unit), spread)


def _dimension(system: System, unit: str) -> Dimension | None:
    """Return the dimension of a unit; None if the file has no units."""
    lists = (system.states, system.inputs, system.outputs, system.operating_point, system.parameters)
    known = [item.unit for items in lists for item in items] + [p.unit for p in system.ports]
    if all(parse_unit(u).dimension == units.ONE for u in known):
        return None
    return parse_unit(unit).dimension
