"""Structures of hybrid models: which networks sit in which ports of a system."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import sympy as sp

from unmodelled.base.errors import BadInput
from unmodelled.engine.compiled.structure import Augmented, Network
from unmodelled.systems.grammar import parse
from unmodelled.systems.model import Port, System, symbol
from unmodelled.systems.printing import printed
from unmodelled.systems.scope import scope_of


@dataclass(frozen=True)
class Plan:
    """The structure of a model for one system, and the penalties of its networks.

    Attributes:
        structure: physics, networks and trained parameters.
        penalties: weight of the mean squared effort of every network in the loss, per squared unit of the
            effort, one per network.
    """

    structure: Augmented
    penalties: tuple[float, ...]


#: The plan of a model for a system and the names of its trained parameters.
Structure = Callable[[System, tuple[str, ...]], Plan]


def physics_only() -> Structure:
    """Return the structure without networks: the physics and its identified parameters.

    Returns:
        Structure for any system.

    Examples:
        >>> from unmodelled.systems.reader import read_system
        >>> plan = physics_only()(read_system("systems/pendulum.yaml"), ("b",))
        >>> plan.structure.networks, plan.structure.trainable
        ((), ('b',))
    """
    return _physics_only


def one_per_port(hidden: int, inputs: Sequence[str] | None = None) -> Structure:
    """Return the structure with one network in every port.

    Args:
        hidden: number of hidden units of every network.
        inputs: names or expressions of the system file that every network sees; default: position and
            velocity of its port.

    Returns:
        Structure for any system; it raises `BadInput` for a port without position and velocity if no inputs
        are given, and for an input that is no expression of the system.

    Examples:
        >>> from unmodelled.systems.reader import read_system
        >>> plan = one_per_port(hidden=32)(read_system("systems/pendulum.yaml"), ("b",))
        >>> [(network.port, network.inputs, network.size) for network in plan.structure.networks]
        [('joint', (theta, omega), 129)]
    """
    return partial(_one_per_port, hidden=hidden, inputs=inputs)


def conservative_and_dissipative(hidden: int, penalty: float) -> Structure:
    """Return the structure with a conservative and a dissipative network in every port (section 4.4.5).

    The conservative network sees the position of the port, the dissipative one its position and velocity.

    Args:
        hidden: number of hidden units of every network.
        penalty: weight of the mean squared effort of a dissipative network in the loss, per squared unit of
            the effort.

    Returns:
        Structure for any system; it raises `BadInput` for a port without position or velocity.

    Examples:
        >>> from unmodelled.systems.reader import read_system
        >>> plan = conservative_and_dissipative(16, 1e-5)(read_system("systems/pendulum.yaml"), ())
        >>> [(network.label, network.inputs) for network in plan.structure.networks], plan.penalties
        ([('tau_c', (theta,)), ('tau_nc', (theta, omega))], (0.0, 1e-05))
    """
    return partial(_conservative_and_dissipative, hidden=hidden, penalty=penalty)


def black_box(hidden: int, inputs: Sequence[str]) -> Structure:
    """Return the structure without physics but kinematics.

    A network gives the derivative of every state whose derivative is not itself a state.

    Args:
        hidden: number of hidden units of every network.
        inputs: names or expressions of the system file that every network sees.

    Returns:
        Structure for any system; it raises `BadInput` for an input that is no expression of the system.

    Examples:
        >>> from unmodelled.systems.reader import read_system
        >>> plan = black_box(16, ["theta", "omega", "torque"])(read_system("systems/pendulum.yaml"), ())
        >>> plan.structure.system.dynamics
        (omega, rate_of_omega)
    """
    return partial(_black_box, hidden=hidden, inputs=inputs)


def network_inputs(system: System, texts: Sequence[str]) -> tuple[sp.Expr, ...]:
    """Read the inputs of a network, expressions of a system file without efforts."""
    scope = scope_of(system)
    found = tuple(parse(text, scope, f"network input {text!r}") for text in texts)
    for text, expression in zip(texts, found, strict=True):
        if expression.free_symbols & set(system.e):
            raise BadInput(f"network input {text!r} must not depend on an effort")
    return found


def texts_of(system: System, inputs: Sequence[sp.Expr]) -> list[str]:
    """Return the inputs of a network as text that `network_inputs` reads back.

    Examples:
        >>> from unmodelled.systems.reader import read_system
        >>> system = read_system("systems/pendulum.yaml")
        >>> texts_of(system, network_inputs(system, ["sin(theta)", "omega"]))
        ['sin(theta)', 'omega']
    """
    names = [name for name in scope_of(system).values if name not in system.signals]
    return [printed(expression, names, [table.name for table in system.tables]) for expression in inputs]


def _physics_only(system: System, trained: tuple[str, ...]) -> Plan:
    return Plan(Augmented(system, (), trained), ())


def _one_per_port(
    system: System, trained: tuple[str, ...], hidden: int, inputs: Sequence[str] | None
) -> Plan:
    networks = []
    for port in system.ports:
        names = inputs if inputs is not None else _coordinates(port)
        networks.append(Network(port.name, network_inputs(system, names), hidden, port.effort))
    return Plan(Augmented(system, tuple(networks), trained), (0.0,) * len(networks))


def _conservative_and_dissipative(
    system: System, trained: tuple[str, ...], hidden: int, penalty: float
) -> Plan:
    networks = []
    for port in system.ports:
        if port.position is None or port.velocity is None:
            raise BadInput(f"port {port.name} must have position and velocity to split its effort")
        position, both = network_inputs(system, [port.position]), network_inputs(system, _coordinates(port))
        networks.append(Network(port.name, position, hidden, f"{port.effort}_c"))
        networks.append(Network(port.name, both, hidden, f"{port.effort}_nc"))
    return Plan(Augmented(system, tuple(networks), trained), (0.0, penalty) * len(system.ports))


def _black_box(system: System, trained: tuple[str, ...], hidden: int, inputs: Sequence[str]) -> Plan:
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
    expressions = network_inputs(system, inputs)
    networks = tuple(Network(port.name, expressions, hidden, port.effort) for port in ports)
    return Plan(Augmented(bare, networks, ()), (0.0,) * len(networks))


def _coordinates(port: Port) -> Sequence[str]:
    if not port.coordinates:
        raise BadInput(f"port {port.name} has no position or velocity: the network's inputs must be given")
    return port.coordinates
