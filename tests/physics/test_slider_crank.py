"""The slider-crank from three sides: Newton-Euler, Lagrange, and the system file; energy and power."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.physics.newton_euler import newton_euler
from unmodelled.engine.free_run import Integration
from unmodelled.learning.nnap import Nnap
from unmodelled.learning.rollout import Measured, simulate
from unmodelled.learning.structures import physics_only
from unmodelled.systems.model import System, symbol
from unmodelled.systems.numeric import numpy_system_function
from unmodelled.systems.reader import read_system

Array = NDArray[np.float64]
FILE = Path(__file__).parents[2] / "systems" / "slider_crank.yaml"
theta, omega, T, F = (symbol(name) for name in ("theta", "omega", "T", "F"))
m1, m2, m3, l1, l2, J1, B_m, g = (symbol(n) for n in ("m1", "m2", "m3", "l1", "l2", "J1", "B_m", "g"))

#: Where the slider is, from the shaft.
SLIDER = l1 * sp.cos(theta) + sp.sqrt(l2**2 - l1**2 * sp.sin(theta) ** 2)


@cache
def system() -> System:
    return read_system(FILE)


def energies() -> tuple[sp.Expr, sp.Expr]:
    """Kinetic and potential energy from the positions of the joints alone."""
    pin = sp.Matrix([l1 * sp.cos(theta), l1 * sp.sin(theta)])
    end = sp.Matrix([SLIDER, 0])
    speed = {name: q.diff(theta) * omega for name, q in {"pin": pin, "end": end}.items()}
    # a slender rod whose ends move with a and b has the kinetic energy m (a.a + a.b + b.b) / 6
    rod = speed["pin"].dot(speed["pin"]) + speed["pin"].dot(speed["end"]) + speed["end"].dot(speed["end"])
    kinetic = J1 * omega**2 / 2 + m2 * rod / 6 + m3 * speed["end"].dot(speed["end"]) / 2
    return kinetic, g * (m1 + m2) * pin[1] / 2


def lagrange() -> sp.Expr:
    """d/dt dL/domega - dL/dtheta = T - B_m omega - F dd/dtheta, solved for the acceleration."""
    kinetic, potential = energies()
    force = T - B_m * omega - F * sp.diff(SLIDER, theta)
    momentum = sp.diff(kinetic, omega)
    bent = sp.diff(momentum, theta) * omega - sp.diff(kinetic - potential, theta)
    return (force - bent) / sp.diff(momentum, omega)


@cache
def accelerations():  # type: ignore[no-untyped-def]
    """f(state, input, effort, parameters) -> Newton-Euler, Lagrange, file, at 30 digits."""
    s = system()
    expressions = [newton_euler(), lagrange(), s.dynamics[1]]
    return sp.lambdify([*s.x, *s.u, *s.e, *s.p], expressions, modules="mpmath", cse=True)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(
    st.floats(-7.0, 7.0),
    st.floats(-100.0, 100.0),
    st.floats(-20.0, 20.0),
    st.floats(-300.0, 300.0),
    st.lists(st.floats(0.3, 3.0), min_size=8, max_size=8),
)
def test_three_derivations_agree(
    angle: float, speed: float, torque: float, force: float, share: list[float]
) -> None:
    import mpmath

    values = [v * s for v, s in zip(system().values, share, strict=True)]
    with mpmath.workdps(30):
        one, two, three = accelerations()(*map(mpmath.mpf, (angle, speed, torque, force, *values)))
        scale = 1 + abs(three)
        assert abs(one - two) < 1e-20 * scale
        assert abs(one - three) < 1e-20 * scale


def test_terms_are_all_there() -> None:
    """No term cancels by chance: every symbol of the file is in the derived expression, and no other."""
    s = system()
    assert newton_euler().free_symbols == {*s.x, *s.u, *s.e, *s.p}


def test_power_that_flows_out_at_the_port_is_force_times_speed() -> None:
    s = system()
    energy = sum(energies())
    rate = sp.diff(energy, theta) * omega + sp.diff(energy, omega) * s.dynamics[1]
    brought = T * omega - B_m * omega**2 - F * s.signals["v"]
    function = numpy_system_function(s, [rate, brought, F * s.signals["v"]])
    draw = np.random.default_rng(0).normal
    x = np.stack([draw(size=500) * 3, draw(size=500) * 50], -1)
    u, e = draw(size=(500, 1)) * 5, draw(size=(500, 1)) * 100
    found = function(0.0, x, u, e, np.array(s.values), np.empty(0))
    assert np.abs(found[:, 2]).max() > 100.0
    np.testing.assert_allclose(found[:, 0], found[:, 1], rtol=0, atol=1e-11 * np.abs(found).max())


def test_position_of_the_port_is_the_slider_and_starts_closest_to_the_shaft() -> None:
    s = system()
    function = numpy_system_function(
        s, [s.signals["d"], SLIDER, s.signals["v"], sp.diff(SLIDER, theta) * omega]
    )
    x = np.stack([np.linspace(-7, 7, 401), np.full(401, 3.0)], -1)
    d, slider, v, speed = function(0.0, x, np.zeros(1), np.zeros(1), np.array(s.values), np.empty(0)).T
    np.testing.assert_allclose(d, slider - 0.24, atol=1e-15)
    np.testing.assert_allclose(v, speed, atol=1e-15)
    assert d.min() == pytest.approx(0.0, abs=1e-4)


def free_run(s: System, x0: Array, steps: int, period: float) -> Array:
    """(windows, steps + 1, 2) without torque and load, by the compiled kernel."""
    structure = physics_only()(s, ()).structure
    p = torch.tensor([s.values])
    nothing = torch.empty(1, 0)
    model = Nnap(structure, p, torch.empty(0), nothing, nothing, nothing)
    data = Measured(
        np.zeros((steps + 1, 2)),
        np.zeros((steps + 1, 1)),
        np.arange(steps + 1) * period,
        np.empty((1, 0)),
        np.zeros(steps + 1, np.int64),
        np.array([0, steps + 1]),
    )
    starts = np.zeros(len(x0), np.int64)
    return simulate(model, 0, data, x0, starts, steps, Integration(period, "rk4"))[0]


def starting_states(n: int) -> Array:
    generator = np.random.default_rng(1)
    return np.stack([generator.uniform(-np.pi, np.pi, n), generator.normal(0.0, 20.0, n)], -1)


def test_energy_is_kept_without_dissipation() -> None:
    s = system().with_values({"B_m": 0.0})
    X = free_run(s, starting_states(20), 2000, 5e-4)
    total = numpy_system_function(s, [sum(energies())])
    energy = total(0.0, X, np.zeros(1), np.zeros(1), np.array(s.values), np.empty(0))[..., 0]
    assert np.ptp(X[..., 0], axis=1).min() > 0.5
    scale = np.abs(energy).max(axis=1)
    assert (np.ptp(energy, axis=1) / scale).max() < 1e-6


def test_a_batch_equals_its_loop() -> None:
    x0 = starting_states(19)
    together = free_run(system(), x0, 50, 5e-4)
    alone = [free_run(system(), x[None], 50, 5e-4)[0] for x in x0]
    np.testing.assert_array_equal(together, np.stack(alone))
