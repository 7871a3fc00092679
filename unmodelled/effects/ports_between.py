"""Ports between two bodies or balances: what acts there takes from one what it gives to the other."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from itertools import combinations

from unmodelled.effects.naming import fresh
from unmodelled.effects.substitution import substituted
from unmodelled.systems.model import Port, System, symbol
from unmodelled.systems.units import parse_unit

Pairs = tuple[tuple[Port, Port], ...]
#: Pairs of ports up to which a port is added between all of them.
MOST_BETWEEN = 3


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


def comparable_ports(system: System) -> Pairs:
    """Return the pairs of ports between whose bodies an effort can act."""
    return tuple(pair for group in port_groups(system) for pair in combinations(group, 2))


def with_ports_between(system: System, pairs: Pairs) -> tuple[System, tuple[str, ...]]:
    """Return the system with a port between the two ports of every pair, and the names of the new ports.

    The effort of the new port takes from one body or balance what it gives to the other. Its position and
    velocity are the differences of those of the two ports.
    """
    names = []
    for one, other in pairs:
        system, name = _with_port_between(system, one, other)
        names.append(name)
    return system, tuple(names)


def with_all_ports_between(system: System) -> System:
    """Return the system with a port between all ports of one kind where these are few."""
    pairs = comparable_ports(system)
    return with_ports_between(system, pairs)[0] if len(pairs) <= MOST_BETWEEN else system


def with_named_ports(system: System, names: Collection[str]) -> System:
    """Return the system with those ports between two of its ports that are named.

    Examples:
        >>> from pathlib import Path
        >>> from unmodelled.systems.reader import read_system
        >>> arm = read_system(Path("systems/double_pendulum/friction_withheld.yaml"))
        >>> [port.name for port in with_named_ports(arm, ["elbow", "shoulder_elbow"]).ports]
        ['shoulder', 'elbow', 'shoulder_elbow']
    """
    known = {port.name for port in system.ports}
    pairs = [pair for pair in comparable_ports(system) if _between(*pair) in set(names) - known]
    return with_ports_between(system, tuple(pairs))[0]


def _between(one: Port, other: Port) -> str:
    """Name of a port between two ports."""
    return f"{one.name}_{other.name}"


def _with_port_between(system: System, one: Port, other: Port) -> tuple[System, str]:
    """The system with a port between two of its ports; and its name."""
    words = [_between(one, other), f"{one.effort}_{other.effort}"]
    words += [f"{one.position}_minus_{other.position}", f"{one.velocity}_minus_{other.velocity}"]
    words += [f"{port.effort}_acting" for port in (one, other)]
    name, effort, position, velocity, *acting = fresh(system, words, "between").values()
    placed, moved = (None not in (getattr(one, c), getattr(other, c)) for c in ("position", "velocity"))
    coordinates = position if placed else None, velocity if moved else None
    between = Port(name, effort, one.unit, *coordinates, kind=one.kind or other.kind)
    grown = replace(system, ports=(*system.ports, between))
    for port, total, sign in zip((one, other), acting, "+-", strict=True):
        own, more = symbol(port.effort), symbol(effort)
        expression = own + more if sign == "+" else own - more
        grown = substituted(grown, port.effort, {total: (expression, f"{port.effort} {sign} {effort}")})
    signals, text = dict(grown.signals), dict(grown.text)
    for signal, a, b in ((position, one.position, other.position), (velocity, one.velocity, other.velocity)):
        if a is not None and b is not None:
            signals[signal] = system.expression(a) - system.expression(b)
            text[f"signals.{signal}"] = f"{a} - {b}"
    return replace(grown, signals=signals, text=text), name
