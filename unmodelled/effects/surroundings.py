"""Level of the surroundings of a balance where it is known: an ambient temperature or a level of a lake."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import TypeVar

from unmodelled.systems.model import Constant, Input, Parameter, Port, System, symbol
from unmodelled.systems.units import ONE, Dimension, parse_unit

TEMPERATURE = parse_unit("K").dimension

Level = TypeVar("Level", Input, Constant, Parameter)


def surroundings(
    system: System, port: Port, among: Collection[str] | None = None
) -> Input | Constant | Parameter | None:
    """Return what gives the level of the surroundings of a port, or None if nothing or several things may.

    An input may if it has the unit of the level, which must have one. An input that the known physics of this
    level does not use goes before those that it uses. Where there is no such input, a temperature may also be
    given by a constant of the operating point or by a parameter.
    """
    levels = [k for k, state in enumerate(system.states) if state.name == port.position]
    if not levels:
        return None
    (level,) = levels
    unit = parse_unit(system.states[level].unit).dimension
    alike = _of_unit(system.inputs, unit, among)
    unused = [item for item in alike if not system.dynamics[level].has(symbol(item.name))]
    if alike or unit != TEMPERATURE:
        return _only(unused or alike)
    # a number that is fitted in every experiment is the start of a state
    fixed = (constant for constant in system.operating_point if not constant.identify)
    return _only(_of_unit(fixed, unit, among)) or _only(_of_unit(system.parameters, unit, among))


def _of_unit(items: Iterable[Level], unit: Dimension, among: Collection[str] | None) -> list[Level]:
    own = [item for item in items if among is None or item.name in among]
    return [item for item in own if parse_unit(item.unit).dimension == unit != ONE]


def _only(items: list[Level]) -> Level | None:
    return items[0] if len(items) == 1 else None
