"""What a port stands for, by the units of its effort and of its coordinate."""

from __future__ import annotations

from dataclasses import replace

from unmodelled.systems.model import Port
from unmodelled.systems.units import SECOND, Dimension, describe, parse_unit, times

#: Units of what a store holds: a balance loses one of them per time.
_STORED = ("C", "m^3", "kg", "J", "mol")
_ENERGY, _POWER = parse_unit("J").dimension, parse_unit("W").dimension


def leaves_store(effort: Dimension) -> bool:
    """Return whether an effort is charge, volume, mass, heat or amount per time."""
    return times(effort, SECOND) in [parse_unit(unit).dimension for unit in _STORED]


def by_units(port: Port, effort: Dimension, coordinate: Dimension) -> tuple[Port, str]:
    """Return a port with its only coordinate as its units say, and a note if the file calls it otherwise.

    What leaves a store per time is the effort of a balance, and the coordinate is the level of the store. Any
    other effort times a speed or a current is a power, and times a position or a charge an energy. The port
    names a position or a velocity, not both, and no kind.
    """
    (name,) = port.coordinates
    product = times(effort, coordinate)
    if leaves_store(effort):
        found = replace(port, position=name, velocity=None)
        meaning = f"what leaves a balance in {describe(effort)}, and {name} its level: read as position"
    elif product == _POWER:
        found = replace(port, position=None, velocity=name)
        meaning = f"an effort in {describe(effort)}, whose product with {name} is a power: read as velocity"
    elif product == _ENERGY and not port.mechanical:
        found = replace(port, position=name, velocity=None, kind="power")
        meaning = f"an effort in {describe(effort)}, whose product with {name} is an energy: read as position"
    else:
        return port, ""
    renamed = (found.position, found.velocity) != (port.position, port.velocity)
    return found, f"ports.{port.name}: {port.effort} is {meaning}: {name}" if renamed else ""
