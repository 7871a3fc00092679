"""Level of the surroundings of a balance where it is logged: an ambient temperature or a level of a lake."""

from __future__ import annotations

from unmodelled.systems.model import Input, Port, System, symbol
from unmodelled.systems.units import ONE, parse_unit


def surroundings(system: System, port: Port) -> Input | None:
    """Return the input that is the level of the surroundings of a port, or None if none or several may be.

    An input may be if it has the unit of the level, which must have one. An input that the known physics
    of this level does not use goes before those that it uses.

    Args:
        system: system of the port.
        port: port of a balance.

    Examples:
        >>> from pathlib import Path
        >>> from unmodelled.systems.reader import read_system
        >>> room = read_system(Path("tests/physics/effects/room.yaml"))
        >>> surroundings(room, room.ports[0]).name
        'T_out'
    """
    levels = [k for k, state in enumerate(system.states) if state.name == port.position]
    if not levels:
        return None
    (level,) = levels
    unit = parse_unit(system.states[level].unit).dimension
    alike = [item for item in system.inputs if parse_unit(item.unit).dimension == unit != ONE]
    unused = [item for item in alike if not system.dynamics[level].has(symbol(item.name))]
    found = unused or alike
    return found[0] if len(found) == 1 else None
