"""What efforts do with power, and whether simulations with them stay finite."""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose

from tests.every import every
from tests.machines.known import Array, runge_kutta, values_of
from tests.physics.effects.benches import PERIOD, Case, at_place, cases, measured, system, values
from unmodelled.effects.added import Added, with_numbers
from unmodelled.effects.effect import PortEffect
from unmodelled.systems.numeric import numpy_system_function

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
    pairs = zip(added.amplitudes, added.regressors, strict=True)
    return sp.Add(*(sp.Symbol(name, real=True) * regressor for name, regressor in pairs))


def ones(added: Added) -> Array:
    """Constants of the system."""
    return np.ones(len(added.system.operating_point))


@every(lambda: with_power("lost"))
def test_friction_never_adds_power(case: Case) -> None:
    added = case.added
    assert all(added.bounds[name][0] == 0.0 for name in added.amplitudes)
    rng = np.random.default_rng(3)
    x = rng.uniform(-1.5, 1.5, (500, len(added.system.states)))
    u = rng.uniform(-1.0, 1.0, (500, 1))
    for seed in range(5):
        effort = values_of(added.system, [extra(added)], x, u, ones(added), drawn(added, seed))[:, 0]
        power = effort * x[:, 1]
        assert power.min() >= 0.0
        assert power.max() > 0.0


def cycle(t: Array | np.float64) -> Array:
    """Position and velocity along a motion with a period of 1 s."""
    x = 0.35 * np.sin(TURN * t + 0.3) + 0.05 * np.sin(2.0 * TURN * t)
    v = TURN * (0.35 * np.cos(TURN * t + 0.3) + 0.1 * np.cos(2.0 * TURN * t))
    return np.stack([x, v], axis=-1)


def taken(added: Added, p: Array, cycles: int) -> Array:
    """(cycles,) energy that the effect takes out of the system, its memory integrated along the motion."""
    grown, h = added.system, 1.0 / 2000
    memory = numpy_system_function(grown, [*grown.dynamics[2:], sp.S.Zero], efforts_zero=True)

    def rates(t: np.float64, z: Array) -> Array:
        return memory(t, np.concatenate([cycle(t), z]), np.zeros(1), np.empty(0), p, ones(added))[:-1]

    t, z = h * np.arange(2000 * cycles), np.zeros(len(added.memory))
    path = runge_kutta(rates, z, t) if added.memory else np.empty((len(t), 0))
    x = np.concatenate([cycle(t), path], axis=1)
    effort = values_of(grown, [extra(added)], x, np.zeros((len(t), 1)), ones(added), p, t=t)[:, 0]
    return h * (effort * x[:, 1]).reshape(cycles, -1).sum(1)


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
    state = np.zeros((len(x), len(system.states)))
    state[:, 0] = x
    return values_of(system, [at_place(added)], state, [0.0], ones(added))[:, 0]


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


@every(lambda: ((case, seed) for case in on_ports() if case.added.slopes for seed in range(6)))
def test_a_fitted_curve_goes_on_straight_and_does_not_fall(each: tuple[Case, int]) -> None:
    case, seed = each
    added, numbers = case.added, pushing(case.added, seed)
    (low, high), ends = *added.extent.values(), {p.name: p.value for p in added.system.parameters}
    edges = np.array([ends[low], ends[high]])
    assert_allclose(edges, [-0.33, 0.33], rtol=1e-3)
    h, out = 1e-6, np.array([-1.0, 1.0])
    inside = (at_rest(added, numbers, edges) - at_rest(added, numbers, edges - h * out)) / (h * out)
    for far in (1e-3, 0.5, 20.0):
        beyond = (at_rest(added, numbers, edges + far * out) - at_rest(added, numbers, edges)) / (far * out)
        assert_allclose(beyond, np.maximum(inside, 0.0), rtol=1e-3, atol=1e-6 * np.abs(inside).max())
    within = np.linspace(-0.3, 0.3, 7)
    plain = sum(numbers[name] * sp.lambdify(THETA, law)(within) for name, law in _plain(case).items())
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
    """(samples, sets of parameters, states) by Runge and Kutta's method, two steps per sample, from rest."""
    grown, h = added.system, PERIOD / 2
    closed = numpy_system_function(grown, list(grown.closed), efforts_zero=True)

    def rates(t: float, x: Array) -> Array:
        return closed(t, x, np.array([np.sin(11.0 * t)]), np.empty(0), p, ones(added))

    nowhere = np.zeros((len(p), len(grown.states)))
    start = values_of(grown, [s.initial for s in grown.states], nowhere, [0.0], ones(added), p)
    return runge_kutta(rates, start, h * np.arange(round(seconds / h) + 1))


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
    x, u, c = [0.2, -0.4], [0.7], np.full(len(known.operating_point), 0.5)
    found = values_of(added.system, added.system.closed, x, u, c, more)
    expected = values_of(known, known.closed, x, u, c, heavy)
    # gravity on the stage is an acceleration of its own, not divided by the mass
    weight = 0.01 / (8.5 + 0.5 + 0.01) if name == "stage" else 0.0
    assert_allclose(found[1], expected[1] + weight, rtol=1e-12)


def test_scales_that_are_measured_lead_to_friction_that_a_sample_does_not_overshoot() -> None:
    added = next(c for c in cases("pendulum") if c.effect.family == "coulomb_friction").added
    sizes = measured(system("pendulum"))
    slope = sizes.effort["joint"] * sizes.mobility["joint"] / added.shapes["v_c"][0]
    assert slope * PERIOD <= 1.0 + 1e-2
