"""What efforts do with power, and whether simulations with them stay finite."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from tests.every import every
from tests.physics.effects.benches import PERIOD, Case, at_place, cases, measured, system, values
from unmodelled.effects.added import Added, with_numbers
from unmodelled.effects.effect import PortEffect
from unmodelled.systems.numeric import numpy_system_function

Array = NDArray[np.float64]
TURN = 2.0 * np.pi


def on_ports() -> list[Case]:
    return [case for case in cases("pendulum") if isinstance(case.effect, PortEffect)]


def with_power(power: str) -> list[Case]:
    found = [c for c in on_ports() if isinstance(c.effect, PortEffect) and c.effect.power == power]
    return [case for case in found if case.added.linear]


def drawn(added: Added, seed: int) -> Array:
    """(parameters,) amplitudes of a plausible size, shapes anywhere on their grids."""
    rng = np.random.default_rng(seed)
    sizes = {name: rng.uniform(0.3, 1.0) * added.scales[name] for name in added.amplitudes}
    return values(added, **sizes, **{name: rng.choice(grid) for name, grid in added.shapes.items()})


def extra(added: Added) -> sp.Expr:
    """The effort that the effect adds."""
    return sum(
        (sp.Symbol(n, real=True) * r for n, r in zip(added.amplitudes, added.regressors, strict=True)),
        sp.S.Zero,
    )


@every(lambda: with_power("lost"))
def test_friction_never_adds_power(case: Case) -> None:
    added = case.added
    assert all(added.bounds[name][0] == 0.0 for name in added.amplitudes)
    effort = numpy_system_function(added.system, [extra(added)], efforts_zero=True)
    rng = np.random.default_rng(3)
    x = rng.uniform(-1.5, 1.5, (500, len(added.system.states)))
    u = rng.uniform(-1.0, 1.0, (500, 1))
    for seed in range(5):
        c = np.ones((500, len(added.system.operating_point)))
        power = effort(0.0, x, u, np.empty(0), drawn(added, seed), c)[:, 0] * x[:, 1]
        assert power.min() >= 0.0
        assert power.max() > 0.0


@dataclass(frozen=True)
class Cycle:
    """One period of a motion, `n` steps; position, velocity and the rest of the state at half steps too."""

    n: int = 2000
    duration: float = 1.0

    def state(self, t: Array) -> Array:
        phase = TURN * t / self.duration
        x = 0.35 * np.sin(phase + 0.3) + 0.05 * np.sin(2.0 * phase)
        v = TURN / self.duration * (0.35 * np.cos(phase + 0.3) + 0.1 * np.cos(2.0 * phase))
        return np.stack([x, v], axis=-1)


def taken(added: Added, p: Array, cycles: int) -> Array:
    """(cycles,) energy that the effect takes out of the system, its memory integrated along the motion."""
    cycle, grown = Cycle(), added.system
    h, memory = cycle.duration / cycle.n, len(added.memory)
    rates = numpy_system_function(grown, [*grown.dynamics[2:], sp.S.Zero], efforts_zero=True)
    effort = numpy_system_function(grown, [extra(added)], efforts_zero=True)
    c = np.ones(len(grown.operating_point))
    z, path = np.zeros(memory), []
    for t in h * np.arange(cycles * cycle.n):
        path.append(z)
        if memory:
            z = _step(lambda s, m: rates(s, _with(cycle, s, m), np.zeros(1), np.empty(0), p, c)[:-1], t, z, h)
    t = h * np.arange(cycles * cycle.n)
    x = np.concatenate([cycle.state(t), np.array(path).reshape(len(t), memory)], axis=1)
    power = effort(t, x, np.zeros((len(t), 1)), np.empty(0), p, c)[:, 0] * x[:, 1]
    return h * power.reshape(cycles, -1).sum(1)


def _with(cycle: Cycle, t: float, memory: Array) -> Array:
    return np.concatenate([cycle.state(np.float64(t)), memory])


def _step(f, t, z, h):  # type: ignore[no-untyped-def]
    k1 = f(t, z)
    k2 = f(t + h / 2, z + h / 2 * k1)
    k3 = f(t + h / 2, z + h / 2 * k2)
    return z + h / 6 * (k1 + 2 * (k2 + k3) + f(t + h, z + h * k3))


@every(lambda: with_power("stored"))
def test_springs_give_back_what_they_take(case: Case) -> None:
    added = case.added
    (energy,) = taken(added, drawn(added, 1), 1)
    assert abs(energy) <= 1e-3 * max(added.scales[name] for name in added.amplitudes)


@every(lambda: with_power("lost over a cycle"))
def test_hysteresis_play_and_stops_take_energy_over_a_cycle(case: Case) -> None:
    added = case.added
    assert taken(added, drawn(added, 2), 2)[1] > 0.0


def at_rest(added: Added, values: dict[str, float], x: Array) -> Array:
    """The law of a port at positions x and no speed."""
    system = with_numbers(added.system, [added], values)
    effort = numpy_system_function(system, [at_place(added)], efforts_zero=True)
    state = np.zeros((len(x), len(system.states)))
    state[:, 0] = x
    c = np.ones((len(x), len(system.operating_point)))
    return effort(0.0, state, np.zeros((len(x), 1)), np.empty(0), np.array(system.values), c)[:, 0]


def pushing(added: Added, seed: int) -> dict[str, float]:
    """Numbers of either sign for the amplitudes that may have it, none for the others: these only resist."""
    rng = np.random.default_rng(seed)
    either = [name for name in added.amplitudes if added.bounds[name][0] < 0.0]
    sizes = {name: rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 1.0) * added.scales[name] for name in either}
    return sizes | {name: float(rng.choice(grid)) for name, grid in added.shapes.items()}


@every(lambda: (case for case in on_ports() if case.added.linear))
def test_beyond_the_data_no_law_that_may_push_grows_faster_than_a_line(case: Case) -> None:
    """A polynomial feeds in energy without limit there, and tears a simulation apart."""
    added = case.added
    for seed in range(4):
        numbers = pushing(added, seed)
        near, far = (np.abs(at_rest(added, numbers, s * np.array([-1.0, 1.0]))) for s in (1e3, 1e5))
        size = sum(abs(numbers.get(name, 0.0)) for name in added.amplitudes)
        assert np.all(far <= 110.0 * near + 10.0 * size), seed


@every(lambda: (case for case in on_ports() if case.added.slopes))
def test_a_fitted_curve_goes_on_straight_and_does_not_fall(case: Case) -> None:
    for seed in range(6):
        _check_straight(case, pushing(case.added, seed))


def _check_straight(case: Case, numbers: dict[str, float]) -> None:
    added = case.added
    (low, high), ends = *added.extent.values(), {p.name: p.value for p in added.system.parameters}
    edges = np.array([ends[low], ends[high]])
    assert_allclose(edges, [-0.33, 0.33], rtol=1e-3)
    h, out = 1e-6, np.array([-1.0, 1.0])
    inside = (at_rest(added, numbers, edges) - at_rest(added, numbers, edges - h * out)) / (h * out)
    for far in (1e-3, 0.5, 20.0):
        beyond = (at_rest(added, numbers, edges + far * out) - at_rest(added, numbers, edges)) / (far * out)
        assert_allclose(beyond, np.maximum(inside, 0.0), rtol=1e-3, atol=1e-6 * np.abs(inside).max())
    within = np.linspace(-0.3, 0.3, 7)
    plain = sum(
        numbers[name] * sp.lambdify(THETA, added_by)(within) for name, added_by in _plain(case).items()
    )
    assert_allclose(at_rest(added, numbers, within), plain, rtol=1e-9)


@every(lambda: (case for case in on_ports() if case.added.slopes))
def test_a_simulation_that_leaves_the_data_stays_finite_however_the_curve_falls_there(case: Case) -> None:
    added = case.added
    falling = {name: -added.scales[name] for name in added.amplitudes}
    system = with_numbers(added.system, [added], falling)
    far = replace(system.states[0], initial=sp.Float(3.0) * added.system.parameters[-3].value)
    thrown = replace(added, system=replace(system, states=(far, *system.states[1:])))
    path = simulated(thrown, np.array([system.values]), 1.0)
    assert np.isfinite(path).all() and np.abs(path[..., 0]).max() < 1e4


THETA = sp.Symbol("theta", real=True)


def _plain(case: Case) -> dict[str, sp.Expr]:
    """What each amplitude of a spring adds, as its law says it where there are data."""
    added = case.added
    law = added.law
    for p in added.system.parameters:
        if p.name in ("x_m", "x_r"):
            law = law.replace(p.name, f"({p.value!r})")
    expression = sp.sympify(law, locals={"theta": THETA})
    return {name: sp.diff(expression, sp.Symbol(name)) + 0 * THETA for name in added.amplitudes}


def simulated(added: Added, p: Array, seconds: float) -> Array:
    """(steps, sets of parameters, states) by Runge and Kutta's method, two steps per sample, from rest."""
    grown, h = added.system, PERIOD / 2
    rates = numpy_system_function(grown, list(grown.closed), efforts_zero=True)
    c = np.ones(len(grown.operating_point))
    start = numpy_system_function(grown, [s.initial for s in grown.states], efforts_zero=True)
    z = start(0.0, np.zeros((len(p), len(grown.states))), np.zeros(1), np.empty(0), p, c)
    path = []
    for t in h * np.arange(round(seconds / h)):
        z = _step(lambda s, m: rates(s, m, np.array([np.sin(11.0 * s)]), np.empty(0), p, c), t, z, h)
        path.append(z)
    return np.array(path)


@every(lambda: (case for case in cases("pendulum") if case.added.amplitudes))
def test_simulations_stay_finite_at_both_ends_of_the_grids(case: Case) -> None:
    added = case.added
    full = {name: added.scales[name] if name not in added.shares else 1.0 for name in added.amplitudes}
    ends = [values(added, **full, **{n: g[k] for n, g in added.shapes.items()}) for k in (0, -1)]
    path = simulated(added, np.array(ends), 0.2)
    assert np.isfinite(path).all()
    assert np.abs(path[..., :2]).max() < 100.0


def test_what_is_behind_play_moves_with_the_port_once_the_play_is_gone() -> None:
    """With hardly any play, a mass behind it changes nothing: it is the known mass."""
    (case,) = (c for c in cases("pendulum") if (c.effect.family, c.effect.variant) == ("backlash", "mass"))
    added = case.added
    mass = 0.3 * added.bounds["m_b"][1]
    tight = values(added, m_b=mass, delta=1e-9, omega_b=1500.0)
    rigid = values(added, m_b=0.0, delta=1e-9, omega_b=1500.0)
    loose = values(added, m_b=mass, delta=0.1, omega_b=1500.0)
    path = simulated(added, np.array([tight, rigid, loose]), 0.5)
    size = np.abs(path[:, 1, 0]).max()
    assert np.abs(path[:, 0, 0] - path[:, 1, 0]).max() < 0.01 * size
    assert np.abs(path[:, 2, 0] - path[:, 1, 0]).max() > 0.03 * size


@pytest.mark.parametrize("name", ["stage", "pendulum"])
def test_an_inertia_error_is_that_much_more_mass(name: str) -> None:
    (case,) = (c for c in cases(name) if (c.effect.family, c.effect.variant) == ("inertia_error", ""))
    added, known = case.added, system(name)
    more = values(added, dM=0.01)
    mass = {"stage": "M", "pendulum": "J"}[name]
    heavy = np.array([p.value + (0.01 if p.name == mass else 0.0) for p in known.parameters])
    x, u, c = np.array([0.2, -0.4]), np.array([0.7]), np.full(len(known.operating_point), 0.5)
    found, expected = (
        numpy_system_function(s, list(s.closed), efforts_zero=True)(0.0, x, u, np.empty(0), p, c)
        for s, p in ((added.system, more), (known, heavy))
    )
    # gravity on the stage is an acceleration of its own, not divided by the mass
    assert_allclose(
        found[1], expected[1] + (0.01 / (8.5 + 0.5 + 0.01) if name == "stage" else 0.0), rtol=1e-12
    )


def test_scales_that_are_measured_lead_to_friction_that_a_sample_does_not_overshoot() -> None:
    added = next(c for c in cases("pendulum") if c.effect.family == "coulomb_friction").added
    sizes = measured(system("pendulum"))
    slope = sizes.effort["joint"] * sizes.mobility["joint"] / added.shapes["v_c"][0]
    assert slope * PERIOD <= 1.0 + 1e-2
