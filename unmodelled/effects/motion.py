"""How the velocity of a port changes, and what its effort does to that."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from unmodelled.systems.functions import sanitised
from unmodelled.systems.model import Port, System, symbol


def acceleration(system: System, port: Port, rates: Sequence[sp.Expr]) -> sp.Expr:
    """Time derivative of the velocity of `port`, given those of all states; zero where it has no velocity."""
    if port.velocity is None:
        return sp.S.Zero
    v = system.expression(port.velocity)
    return sanitised(sum((sp.diff(v, x) * f for x, f in zip(system.x, rates, strict=True)), sp.S.Zero))


def mobility(system: System, port: Port) -> sp.Expr:
    """Derivative of the acceleration of `port` by its effort: minus one over the mass that it feels."""
    return sanitised(sp.diff(acceleration(system, port, system.dynamics), symbol(port.effort)))


def is_inertial(system: System, port: Port) -> bool:
    """Whether the acceleration of `port` follows from the states' rates and is affine in its effort."""
    if port.velocity is None:
        return False
    beta = mobility(system, port)
    moving = system.expression(port.velocity).free_symbols <= {*system.x, *system.p, *system.c}
    return moving and beta != 0 and symbol(port.effort) not in beta.free_symbols
