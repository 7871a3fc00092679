"""Places of one kind: the joints of an arm, the vessels of a plant, drives and sensors of one unit."""

from __future__ import annotations

from collections.abc import Sequence

from unmodelled.effects.place import Place
from unmodelled.systems.model import Port, System
from unmodelled.systems.units import parse_unit


def port_groups(system: System) -> tuple[tuple[Port, ...], ...]:
    """Return the ports of one kind, those whose efforts have the same unit: bodies and balances.

    A body has a velocity with which the effort makes power, a balance has a level.

    Examples:
        >>> from pathlib import Path
        >>> from unmodelled.systems.reader import read_system
        >>> arm = read_system(Path("systems/double_pendulum/friction_withheld.yaml"))
        >>> [[port.name for port in group] for group in port_groups(arm)]
        [['shoulder', 'elbow']]
    """
    found: dict[object, list[Port]] = {}
    for port in system.ports:
        if (port.velocity if port.domain == "power" else port.position) is not None:
            found.setdefault((port.domain, parse_unit(port.unit).dimension), []).append(port)
    return tuple(map(tuple, found.values()))


#: Places of one kind from which on a law at all of them is one effect. Two ports are reached by adding one
#: effect after the other; a lag of one of two sensors may look like a motion of what lies between them.
FEWEST = {"port": 3, "actuator": 3, "sensor": 2}


def place_groups(system: System) -> tuple[frozenset[Place], ...]:
    """Return the places at all of which a law may act: many ports or drives of one kind, sensors of one unit.

    Examples:
        >>> from pathlib import Path
        >>> from unmodelled.systems.reader import read_system
        >>> arm = read_system(Path("systems/double_pendulum/friction_withheld.yaml"))
        >>> [sorted(place.channel for place in group) for group in place_groups(arm)]
        [['sensor:q1', 'sensor:q2'], ['sensor:v1', 'sensor:v2']]
    """
    places = [
        *((Place("actuator", item.name), item.unit) for item in system.inputs),
        *((Place("sensor", item.name), item.unit) for item in system.outputs),
    ]
    signals: dict[object, list[Place]] = {}
    for place, unit in places:
        signals.setdefault((place.kind, parse_unit(unit).dimension), []).append(place)
    ports = [[Place("port", port.name) for port in group] for group in port_groups(system)]
    groups: Sequence[list[Place]] = [*ports, *signals.values()]
    return tuple(frozenset(group) for group in groups if len(group) >= FEWEST[group[0].kind])
