"""Networks in systems: which go where, and compiled free runs with gradients equal to the torch reference."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
import torch
from torch import nn

from tests.machines.known import NAMES, built_in
from tests.physics.kernel.problems import INTEGRATIONS, assert_equal, bare, by_kernel, one_run, problem
from unmodelled.base.errors import BadInput
from unmodelled.engine.compiled.structure import Augmented
from unmodelled.engine.free_run import Integration
from unmodelled.learning.rollout import simulate
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
    grown = structure.system
    for state, f, old in zip(grown.states, grown.dynamics, system.dynamics, strict=True):
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


Build = Callable[[System], Augmented]


def names_of(system: System) -> list[str]:
    return [s.name for s in (*system.states, *system.inputs)]


def alone(system: System) -> Augmented:
    return physics_only()(system, tuple(p.name for p in system.parameters)).structure


def with_networks(system: System) -> Augmented:
    inputs = None if all(p.position or p.velocity for p in system.ports) else names_of(system)
    return one_per_port(5, inputs)(system, system.uncertain).structure


def split(system: System) -> Augmented:
    if not all(p.position and p.velocity for p in system.ports):
        pytest.skip("a port has no position or velocity")
    return conservative_and_dissipative(19, 0.1)(system, system.uncertain[:1]).structure


def without_physics(system: System) -> Augmented:
    return black_box(4, names_of(system))(system, ()).structure


BUILDS = (alone, with_networks, split, without_physics)
#: What the quick tests compile: all structures with one port; with two bodies, what depends on the bodies.
QUICK = {("pendulum", with_networks), ("pendulum", split), ("coupling", alone)}


@pytest.mark.parametrize(
    ("name", "build"),
    [
        pytest.param(name, build, marks=() if (name, build) in QUICK else pytest.mark.long)
        for name in NAMES
        for build in BUILDS
    ],
)
def test_compiled_free_run_equals_reference(name: str, build: Build) -> None:
    given = problem(build(built_in(name)))
    for how in INTEGRATIONS:
        assert_equal(given, how)


@pytest.mark.parametrize("windows", [1, 16, 17, 32])
def test_any_number_of_windows(windows: int) -> None:
    given = problem(with_networks(built_in("pendulum")), windows)
    assert_equal(given, INTEGRATIONS[3])


def test_a_window_that_diverges_leaves_the_others_alone() -> None:
    given = problem(with_networks(built_in("pendulum")))
    before = by_kernel(given, 0, INTEGRATIONS[0])
    given.x0[3] = np.nan
    after = by_kernel(given, 0, INTEGRATIONS[0])
    others = torch.arange(len(given.starts)) != 3
    for name in ("X", "Z", "x0"):
        torch.testing.assert_close(after[name][others], before[name][others], rtol=0, atol=0)
    assert torch.isnan(after["X"][3]).all()


def test_network_is_the_layers_of_torch() -> None:
    """Eq. 4.4: gain * (W_o relu(W_h q / sigma + b_h) + b_o)."""
    given = problem(with_networks(built_in("pendulum")))
    model, x = given.model, torch.tensor(given.x0)
    ni, nh = 2, 5
    layers = nn.Sequential(nn.Linear(ni, nh), nn.ReLU(), nn.Linear(nh, 1)).double()
    for member in range(model.batch):
        W_h, b_h, W_o, b_o = model.weights[member].detach().split([ni * nh, nh, nh, 1])
        state = {"0.weight": W_h.view(ni, nh).T, "0.bias": b_h, "2.weight": W_o[None], "2.bias": b_o}
        layers.load_state_dict(state)
        expected = model.gain[member] * layers(x * model.scale[member])
        t, u, c = torch.zeros(len(x)), torch.zeros(1), torch.empty(0)
        found = model.efforts(t, x.expand(model.batch, -1, -1), u, c)[member]
        torch.testing.assert_close(found, expected)


def test_integration_converges_in_the_order_of_its_method() -> None:
    system = built_in("pendulum")
    model = problem(alone(system)).model
    steps, period = 8, 0.1
    data = one_run(np.sin(np.arange(steps + 1))[:, None], period)
    x0, starts = np.array([[1.0, -2.0]]), np.zeros(1, np.int64)

    def end(method: str, substeps: int) -> np.ndarray:
        how = Integration(period, method, substeps, hold=1.0)  # type: ignore[arg-type]
        return simulate(model, 0, data, x0, starts, steps, how)[0][0, -1]

    best = end("rk4", 400)
    for method, substeps, order in (("euler", 200, 1), ("rk4", 8, 4)):
        errors = [np.abs(end(method, n) - best).max() for n in (substeps, 2 * substeps)]
        assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.15)


def test_inputs_are_held_or_go_straight_to_the_next_sample() -> None:
    """Euler with two substeps of omega' = torque/J and nothing else."""
    system = built_in("pendulum").with_values({"b": 0.0, "mgl": 0.0, "J": 1.0})
    data, x0, first = one_run(np.array([[1.0], [3.0], [-5.0]]), 1.0), np.zeros((1, 2)), np.zeros(1, np.int64)
    for hold, expected in ((0.0, [0.0, 1.0, 4.0]), (1.0, [0.0, 1.5, 2.5])):
        X, Z = simulate(bare(system), 0, data, x0, first, 2, Integration(1.0, "euler", 2, hold))
        np.testing.assert_allclose(X[0, :, 1], expected)
        assert Z.shape == (1, 2, 0)
