"""Which networks go where, for every built-in system; and what is refused."""

from __future__ import annotations

from dataclasses import replace

import pytest
import sympy as sp

from tests.physics.kernel.problems import NAMES, built_in
from unmodelled.base.errors import BadInput
from unmodelled.learning.structures import black_box, conservative_and_dissipative, one_per_port, physics_only
from unmodelled.systems.model import System, symbol

every = pytest.mark.parametrize("system", [pytest.param(built_in(name), id=name) for name in NAMES])


def coordinates(system: System) -> list[tuple[sp.Expr, ...]]:
    """Position and velocity of every port, as far as it has them."""
    return [
        tuple(system.expression(name) for name in (port.position, port.velocity) if name is not None)
        for port in system.ports
    ]


@every
def test_physics_only(system: System) -> None:
    plan = physics_only()(system, system.uncertain)
    assert plan.structure.system is system
    assert (plan.structure.networks, plan.penalties, plan.structure.size) == ((), (), 0)
    values = [system.values[k] for k in plan.structure.index]
    assert values == [p.value for p in system.parameters if p.identify]


@every
def test_one_per_port(system: System) -> None:
    if not all(coordinates(system)):
        pytest.skip("a port has neither position nor velocity")
    plan = one_per_port(6)(system, system.uncertain)
    networks = plan.structure.networks
    assert [n.port for n in networks] == list(system.port_names)
    assert [n.label for n in networks] == [p.effort for p in system.ports]
    assert [n.inputs for n in networks] == coordinates(system)
    assert [n.size for n in networks] == [6 * (len(q) + 2) + 1 for q in coordinates(system)]
    assert plan.penalties == (0.0,) * len(networks)
    assert plan.structure.trainable == system.uncertain


@every
def test_one_per_port_with_other_inputs(system: System) -> None:
    state = system.states[0].name
    plan = one_per_port(3, [state, f"sin({state})**2"])(system, ())
    x = symbol(state)
    assert all(n.inputs == (x, sp.sin(x) ** 2) for n in plan.structure.networks)
    assert len(plan.structure.networks) == len(system.ports)


@every
def test_conservative_and_dissipative(system: System) -> None:
    if not all(port.position and port.velocity for port in system.ports):
        with pytest.raises(BadInput, match="must have position and velocity"):
            conservative_and_dissipative(4, 0.5)(system, ())
        return
    plan = conservative_and_dissipative(4, 0.5)(system, ())
    networks = plan.structure.networks
    expected = [q for both in coordinates(system) for q in (both[:1], both)]
    assert [n.inputs for n in networks] == expected
    assert [n.label for n in networks] == [f"{p.effort}_{kind}" for p in system.ports for kind in ("c", "nc")]
    assert plan.penalties == (0.0, 0.5) * len(system.ports)


@every
def test_black_box(system: System) -> None:
    names = [s.name for s in (*system.states, *system.inputs)]
    structure = black_box(8, names)(system, system.uncertain).structure
    unknown = [s.name for s, f in zip(system.states, system.dynamics, strict=True) if f not in system.x]
    assert [n.port for n in structure.networks] == list(structure.system.port_names) == unknown
    assert structure.trainable == ()
    assert all(n.inputs == tuple(symbol(name) for name in names) for n in structure.networks)
    for state, f, old in zip(
        structure.system.states, structure.system.dynamics, system.dynamics, strict=True
    ):
        assert f == (symbol(f"rate_of_{state.name}") if state.name in unknown else old)
    assert not set().union(*(f.free_symbols for f in structure.system.closed)) & set(system.p)


PENDULUM = built_in("pendulum")


@pytest.mark.parametrize(
    ("inputs", "words"),
    [
        (["theta", "thta"], "thta"),
        (["tau*theta"], "network input 'tau[*]theta' must not depend on an effort"),
        (["theta.real"], "theta.real"),
        (["__import__('os')"], "import"),
        (["theta +"], "theta"),
    ],
)
def test_bad_inputs_are_named(inputs: list[str], words: str) -> None:
    for build in (lambda: one_per_port(3, inputs)(PENDULUM, ()), lambda: black_box(3, inputs)(PENDULUM, ())):
        with pytest.raises(BadInput, match=words) as raised:
            build()
        assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    "missing", [{"position": None}, {"velocity": None}, {"position": None, "velocity": None}]
)
def test_ports_without_coordinates(missing: dict[str, None]) -> None:
    system = replace(PENDULUM, ports=(replace(PENDULUM.ports[0], **missing),))
    with pytest.raises(BadInput, match="port joint must have position and velocity"):
        conservative_and_dissipative(3, 0.1)(system, ())
    if len(missing) == 2:
        with pytest.raises(BadInput, match="port joint has no position or velocity"):
            one_per_port(3)(system, ())
    else:
        (network,) = one_per_port(3)(system, ()).structure.networks
        assert len(network.inputs) == 1
