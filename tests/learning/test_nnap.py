"""Nnap: compiled free runs and their gradients equal the torch reference, for every built-in system."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch
from torch import nn

from tests.physics.kernel.problems import (
    INTEGRATIONS,
    NAMES,
    Problem,
    assert_equal,
    built_in,
    by_kernel,
    by_reference,
    problem,
)
from unmodelled.engine.compiled.structure import Augmented
from unmodelled.engine.free_run import Integration
from unmodelled.learning.nnap import Nnap
from unmodelled.learning.rollout import Measured, rollout, simulate
from unmodelled.learning.structures import black_box, conservative_and_dissipative, one_per_port, physics_only
from unmodelled.systems.model import System

Build = Callable[[System], Augmented]


def names_of(system: System) -> list[str]:
    return [s.name for s in (*system.states, *system.inputs)]


def all_trained(system: System) -> tuple[str, ...]:
    return tuple(p.name for p in system.parameters)


def alone(system: System) -> Augmented:
    return physics_only()(system, all_trained(system)).structure


def with_networks(system: System) -> Augmented:
    inputs = None if all(p.position or p.velocity for p in system.ports) else names_of(system)
    return one_per_port(5, inputs)(system, system.uncertain).structure


def split(system: System) -> Augmented:
    if not all(p.position and p.velocity for p in system.ports):
        pytest.skip("a port has no position or velocity")
    return conservative_and_dissipative(19, 0.1)(system, system.uncertain[:1]).structure


def without_physics(system: System) -> Augmented:
    return black_box(4, names_of(system))(system, ()).structure


#: Systems of the quick tests: one port, and two bodies.
QUICK = {"pendulum", "coupling"}


@pytest.mark.parametrize("build", [alone, with_networks, split, without_physics])
@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.long) for name in NAMES]
)
def test_compiled_free_run_equals_reference(name: str, build: Build) -> None:
    given = problem(build(built_in(name)))
    for how in INTEGRATIONS:
        assert_equal(given, how)


@pytest.mark.parametrize("windows", [1, 16, 17, 32])
def test_any_number_of_windows(windows: int) -> None:
    given = problem(with_networks(built_in("pendulum")), windows)
    assert_equal(given, INTEGRATIONS[3])


def test_a_window_does_not_depend_on_the_others() -> None:
    given = problem(with_networks(built_in("pendulum")))
    whole = by_kernel(given, 0, INTEGRATIONS[3])
    order = np.random.default_rng(0).permutation(len(given.starts))
    X, Z = simulate(
        given.model, 0, given.data, given.x0[order], given.starts[order], given.steps, INTEGRATIONS[3]
    )
    np.testing.assert_array_equal(X, whole["X"].numpy()[order])
    np.testing.assert_array_equal(Z, whole["Z"].numpy()[order])


def test_a_window_that_diverges_leaves_the_others_alone() -> None:
    given = problem(with_networks(built_in("pendulum")))
    before = by_kernel(given, 0, INTEGRATIONS[0])
    given.x0[3] = np.nan
    after = by_kernel(given, 0, INTEGRATIONS[0])
    others = torch.arange(len(given.starts)) != 3
    for name in ("X", "Z", "x0"):
        torch.testing.assert_close(after[name][others], before[name][others], rtol=0, atol=0)
    assert torch.isnan(after["X"][3]).all()


def test_gradient_check() -> None:
    given = problem(with_networks(built_in("pendulum")), windows=2, steps=2, period=0.02)
    member, how = 1, Integration(0.02, "rk4", substeps=2, hold=1.0)

    def run(x0: torch.Tensor, *_: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return rollout(given.model, member, given.data, x0, given.starts, given.steps, how)

    x0 = torch.tensor(given.x0, requires_grad=True)
    # xi and weights are the model's own: what gradcheck does to them in place, the model sees
    assert torch.autograd.gradcheck(run, (x0, given.model.xi, given.model.weights))


def test_states_may_be_laid_out_in_any_way() -> None:
    given = problem(with_networks(built_in("pendulum")))
    how = INTEGRATIONS[0]
    x0 = torch.tensor(given.x0).T.contiguous().T
    X, _ = rollout(given.model, 0, given.data, x0, given.starts, given.steps, how)
    torch.testing.assert_close(X, by_reference(given, 0, how)["X"])


def test_efforts_at_a_port_add_up() -> None:
    """Of two networks, the one with no weights changes nothing."""
    system = built_in("pendulum")
    given = problem(split(system))
    first = given.model.structure.networks[0].size
    with torch.no_grad():
        given.model.weights[:, first:] = 0.0
    single = Augmented(system, given.model.structure.networks[:1], given.model.structure.trainable)
    parts = given.model.p, given.model.unit, given.model.scale[:, :1], given.model.gain[:, :1]
    alone = Nnap(single, *parts, given.model.weights[:, :first].detach())
    other = Problem(alone, given.data, given.x0, given.starts, given.steps)
    how = INTEGRATIONS[1]
    torch.testing.assert_close(
        by_kernel(given, 0, how)["X"], by_kernel(other, 0, how)["X"], rtol=1e-13, atol=0
    )


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
    data = Measured(
        np.zeros((steps + 1, 2)),
        np.sin(np.arange(steps + 1))[:, None],
        period * np.arange(steps + 1),
        np.empty((1, 0)),
        np.zeros(steps + 1, np.int64),
        np.array([0, steps + 1]),
    )
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
    structure = physics_only()(system, ()).structure
    nothing = torch.empty(1, 0)
    model = Nnap(structure, torch.tensor([system.values]), torch.empty(0), nothing, nothing, nothing)
    u = np.array([[1.0], [3.0], [-5.0]])
    data = Measured(
        np.zeros((3, 2)), u, np.arange(3.0), np.empty((1, 0)), np.zeros(3, np.int64), np.array([0, 3])
    )
    for hold, expected in ((0.0, [0.0, 1.0, 4.0]), (1.0, [0.0, 1.5, 2.5])):
        X, Z = simulate(
            model, 0, data, np.zeros((1, 2)), np.zeros(1, np.int64), 2, Integration(1.0, "euler", 2, hold)
        )
        np.testing.assert_allclose(X[0, :, 1], expected)
        assert Z.shape == (1, 2, 0)
