"""Which networks a hybrid model puts where: what `networks:` in a file of conf/model/ names."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import sympy as sp

from unmodelled.base.errors import BadInput
from unmodelled.engine.compiled.structure import Augmented, Network
from unmodelled.systems.grammar import parse
from unmodelled.systems.model import Port, System, symbol
from unmodelled.systems.scope import scope_of


@dataclass(frozen=True)
class Plan:
    """A structure, and the price of each network's mean squared effort in the loss.

    Attributes:
        structure: physics and networks. penalties: one per network, per squared unit of its effort.
    """

    structure: Augmented
    penalties: tuple[float, ...]


Structure = Callable[[System, tuple[str, ...]], Plan]


def physics_only(system: System, trained: tuple[str, ...]) -> Plan:
    """No network: the physics with its identified parameters."""
    return Plan(Augmented(system, (), trained), ())


def one_per_port(
    system: System, trained: tuple[str, ...], hidden: int, inputs: Sequence[str] | None = None
) -> Plan:
    """A network in every port; its inputs are the port's position and velocity unless others are given.

    Raises:
        BadInput: when a port has neither position nor velocity and no inputs are given, or on a bad input.
    """
    networks = []
    for port in system.ports:
        names = list(inputs) if inputs is not None else _coordinates(port)
        networks.append(Network(port.name, _expressions(system, names), hidden, port.effort))
    return Plan(Augmented(system, tuple(networks), trained), (0.0,) * len(networks))


def conservative_and_dissipative(
    system: System, trained: tuple[str, ...], hidden: int, penalty: float
) -> Plan:
    """In every port eta_c(position) + eta_nc(position, velocity), the second one priced (section 4.4.5).

    Raises:
        BadInput: when a port lacks position or velocity.
    """
    networks = []
    for port in system.ports:
        if port.position is None or port.velocity is None:
            raise BadInput(f"port {port.name} must have position and velocity to split its effort")
        position, both = _expressions(system, [port.position]), _expressions(system, _coordinates(port))
        networks.append(Network(port.name, position, hidden, f"{port.effort}_c"))
        networks.append(Network(port.name, both, hidden, f"{port.effort}_nc"))
    return Plan(Augmented(system, tuple(networks), trained), (0.0, penalty) * len(system.ports))


def black_box(system: System, trained: tuple[str, ...], hidden: int, inputs: Sequence[str]) -> Plan:
    """No physics but kinematics: a network gives the derivative of every state whose derivative is not a
    state.
    """
    ports, dynamics = [], []
    for state, f in zip(system.states, system.dynamics, strict=True):
        effort = f"rate_of_{state.name}"
        known = f in system.x
        dynamics.append(f if known else symbol(effort))
        if not known:
            ports.append(Port(state.name, effort, f"{state.unit}/s"))
    bare = replace(
        system,
        name=f"{system.name}_black_box",
        ports=tuple(ports),
        dynamics=tuple(dynamics),
        events=(),  # their dynamics know the efforts of the ports that are gone
    )
    expressions = _expressions(system, list(inputs))
    networks = tuple(Network(port.name, expressions, hidden, port.effort) for port in ports)
    return Plan(Augmented(bare, networks, ()), (0.0,) * len(networks))


def _coordinates(port: Port) -> list[str]:
    if not port.coordinates:
        raise BadInput(f"port {port.name} has no position or velocity: the network's inputs must be given")
    return list(port.coordinates)


def _expressions(system: System, texts: list[str]) -> tuple[sp.Expr, ...]:
    """Network inputs from names or expressions of the system file's grammar; efforts are not known to a
    network.
    """
    scope = scope_of(system)
    found = tuple(parse(text, scope, f"network input {text!r}") for text in texts)
    for text, expression in zip(texts, found, strict=True):
        if expression.free_symbols & set(system.e):
            raise BadInput(f"network input {text!r} must not depend on an effort")
    return found
