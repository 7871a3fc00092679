"""Acceleration of a port, and the influence of its effort on it."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from unmodelled.systems.functions import sanitised
from unmodelled.systems.model import Port, System, symbol


def acceleration(system: System, port: Port, rates: Sequence[sp.Expr]) -> sp.Expr:
    """Return the acceleration of a port for given rates of the states.

    Args:
        system: system of the port.
        port: port to look at.
        rates: time derivative of each state.

    Returns:
        Time derivative of the port's velocity; zero if the port has no velocity.
    """
    if port.velocity is None:
        return sp.S.Zero
    v = system.expression(port.velocity)
    return sanitised(sum((sp.diff(v, x) * f for x, f in zip(system.x, rates, strict=True)), sp.S.Zero))


def mobility(system: System, port: Port) -> sp.Expr:
    """Return the derivative of a port's acceleration by its effort: minus one over the mass that the port
    feels.

    Args:
        system: system of the port.
        port: port to look at.

    Returns:
        Expression in the symbols of the system.

    Examples:
        >>> from pathlib import Path
        >>> from unmodelled.systems.reader import read_system
        >>> pendulum = read_system(Path("systems/pendulum.yaml"))
        >>> mobility(pendulum, pendulum.port("joint"))
        -1/J
    """
    return sanitised(sp.diff(acceleration(system, port, system.dynamics), symbol(port.effort)))


def is_inertial(system: System, port: Port) -> bool:
    """Return whether a port's acceleration depends linearly on its effort.

    Args:
        system: system of the port.
        port: port to look at.

    Returns:
        False if the port has no velocity, or if its velocity depends on an input or on time.
    """
    if port.velocity is None:
        return False
    beta = mobility(system, port)
    moving = system.expression(port.velocity).free_symbols <= {*system.x, *system.p, *system.c}
    return moving and beta != 0 and symbol(port.effort) not in beta.free_symbols
