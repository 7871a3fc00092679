"""Dry friction holds a port over an integration step that is far too long for its corner."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from tests.machines.folders import Array, system_of, text_of
from tests.physics.kernel.problems import assert_equal, problem
from unmodelled.engine.compiled.backend import Generated
from unmodelled.engine.compiled.structure import Augmented
from unmodelled.engine.free_run import Backend, Integration, Windows, free_run
from unmodelled.engine.machine.program import Program
from unmodelled.systems.model import System, symbol
from unmodelled.systems.numeric import numpy_system_function
from unmodelled.systems.sticking import STEP_LENGTH, held

#: s, and the resolution of an encoder, rad.
PERIOD, RESOLUTION = 0.002, 1e-3
#: Two bodies whose masses are coupled, as the links of an arm are, each with dry friction.
ARM = """schema: system/1
name: arm
states: {q: {unit: rad}, r: {unit: rad}, v: {unit: rad/s}, w: {unit: rad/s}}
inputs: {u: {unit: N m}}
outputs: {q: {unit: rad}, r: {unit: rad}}
parameters:
  J: {value: 0.02, unit: kg m^2}
  C: {value: 0.012, unit: kg m^2}
  F_c: {value: 0.8, unit: N m}
  v_c: {value: 1.0e-5, unit: rad/s}
ports:
  shoulder: {effort: F, unit: N m, position: q, velocity: v, law: F_c*tanh(v/v_c)}
  elbow: {effort: G, unit: N m, position: r, velocity: w, law: F_c*tanh(w/v_c)}
dynamics:
  q: v
  r: w
  v: (J*(u - F) + C*(0.5*u - G))/(J**2 - C**2)
  w: (J*(0.5*u - G) + C*(u - F))/(J**2 - C**2)
"""


def axis(folder: Path, *changes: tuple[str, str]) -> System:
    return system_of(text_of("stuck_axis.yaml", *changes), folder)


def path(system: System, u: Array, substeps: int = 1, backend: type = Program, **known: float) -> Array:
    """States (samples, states) from rest."""
    made: Backend = backend.of(system, list(system.x))  # type: ignore[attr-defined]
    p, one, n = np.array(system.with_values(known).values), np.zeros(1, np.int64), len(u)
    windows = Windows(u[:, None], PERIOD * np.arange(n), one, one + n - 1, one, one)
    how = Integration(PERIOD, "rk4", substeps, 1.0)
    return free_run(made, windows, p[None, None], np.zeros((1, 0)), np.zeros((1, 1, len(system.x))), how)[
        0, 0
    ]


def pushed(seconds: float, level: float = 4.0) -> Array:
    """A torque that rises within half a second, and falls a little after a second."""
    t = np.arange(0.0, seconds, PERIOD)
    return np.where(t < 0.5, level * t / 0.5, np.where(t < 1.0, level, 0.9 * level))


@pytest.mark.parametrize("backend", [Program, Generated])
def test_a_held_axis_does_not_creep(tmp_path: Path, backend: type) -> None:
    system, u = axis(tmp_path), pushed(11.0)
    once, often = (path(system, u, steps, backend) for steps in (1, 64))
    at_rest = once[len(u) // 10 :]
    assert 42.0 * at_rest[0, 0] > u[-1] - 0.8 and once[:, 0].max() > 50 * RESOLUTION
    assert np.ptp(at_rest[:, 0]) < 0.1 * RESOLUTION
    assert np.abs(at_rest[:, 1]).max() < 1e-4
    assert np.abs(once[:, 0] - often[:, 0]).max() < 0.1 * RESOLUTION


def test_coupled_bodies_are_both_held(tmp_path: Path) -> None:
    system = system_of(ARM, tmp_path)
    still = path(system, pushed(4.0, 0.7))
    assert np.abs(still[:, :2]).max() < RESOLUTION
    t = PERIOD * np.arange(1500)
    u = np.where(t < 1.0, 3.0 * np.sin(6.0 * t), 0.5)
    once, often = (path(system, u, steps) for steps in (1, 64))
    assert np.ptp(once[:, :2], axis=0).min() > 50 * RESOLUTION
    assert np.abs(once - often)[:, :2].max() < 0.02 * np.ptp(often[:, :2])
    assert np.abs(once[-1, 2:]).max() < 1e-4


@pytest.mark.parametrize("v_c", [1e-5, 4e-3, 0.03])
def test_the_derivative_of_a_run_that_sticks(tmp_path: Path, v_c: float) -> None:
    """Differences of a run are alike for steps of any size: it is smooth, and needs no averaging."""
    system, u = axis(tmp_path), pushed(2.0)
    for name, value in (("F_c", 0.8), ("k", 42.0)):
        slopes = []
        for step in (1e-4 * value, 1e-7 * value):
            ends = [path(system, u, v_c=v_c, **{name: value + sign * step})[:, 0] for sign in (1, -1)]
            slopes.append((ends[0] - ends[1]) / (2.0 * step))
        assert np.abs(slopes[0] - slopes[1]).max() < 0.02 * np.abs(slopes[1]).max()


@pytest.mark.parametrize("v_c", [1e-4, 1e-2, 0.3])
def test_kernel_equals_reference_in_value_and_gradient(tmp_path: Path, v_c: float) -> None:
    trained = Augmented(axis(tmp_path).with_values({"v_c": v_c}), (), ("F_c", "k", "v_c"))
    given = problem(trained, windows=19, steps=6, period=PERIOD)
    given = replace(given, x0=0.1 * given.x0)
    assert_equal(given, Integration(PERIOD, "rk4", hold=1.0), tolerance=1e-8)


@pytest.mark.long
@pytest.mark.parametrize("v_c", [1e-4, 1e-2, 0.3])
def test_the_kernel_of_coupled_bodies_equals_the_reference(tmp_path: Path, v_c: float) -> None:
    arm = Augmented(system_of(ARM, tmp_path).with_values({"v_c": v_c}), (), ("F_c", "C"))
    assert_equal(problem(arm, windows=5, steps=4, period=PERIOD), Integration(PERIOD, "rk4"), tolerance=1e-8)


def test_a_corner_that_steps_resolve_is_left_alone(tmp_path: Path) -> None:
    system = axis(tmp_path)
    rates = held(system.x, system.closed)
    assert rates != system.closed
    x, u = np.random.default_rng(0).normal(size=(50, 2)), np.ones((50, 1))
    p = np.array(system.with_values({"v_c": 0.2}).values)
    for step in (0.0, 0.9 * 0.2 * 0.02 / 0.8):
        integrated = [f.xreplace({STEP_LENGTH: sp.Float(step)}) for f in rates]
        both = [numpy_system_function(system, list(e), True) for e in (integrated, system.closed)]
        there, here = (f(0.0, x, u, None, p, np.empty(0)) for f in both)
        np.testing.assert_allclose(there, here, rtol=1e-14)


def test_what_does_not_slow_itself_is_no_friction(tmp_path: Path) -> None:
    x, y, k = symbol("x"), symbol("y"), symbol("k")
    for rates in ((k * sp.tanh(y), -x), (k * x, -y), (sp.tanh(x) ** 2, sp.S.Zero)):
        assert held((x, y), rates) == rates


def test_neurons_of_a_network_are_no_friction() -> None:
    """With their biases they hold nothing at rest; corners of many networks are many to solve for."""
    x, k = symbol("x"), symbol("k")
    rates = (-k * sp.tanh(3.0 * x + 0.2),)
    assert held((x,), rates) == rates
    assert held((x,), (-k * sp.tanh(3.0 * x),)) != (-k * sp.tanh(3.0 * x),)
