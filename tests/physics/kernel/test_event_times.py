"""Compiled event times are those of the numpy reference, of closed forms and of an adaptive integrator."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tests.physics.kernel.random_systems import random_structure
from unmodelled.base.errors import BadInput
from unmodelled.engine.cascade.cascade import SHARED, Cascade
from unmodelled.engine.cascade.cascade_source import CascadeSource
from unmodelled.engine.cascade.event_times import EventTimes
from unmodelled.systems import experiments, phases
from unmodelled.systems.experiments import Experiments
from unmodelled.systems.model import TIME, Constant, Event, Parameter, State, System, symbol
from unmodelled.systems.numeric import numpy_system_function
from unmodelled.systems.reader import read_system

Array = NDArray[np.float64]
SYSTEMS = Path(__file__).parents[3] / "systems"
CLUTCH, UNCERTAIN = "shift", ("p_hc0", "z_p")
PERIOD = 0.001
x, k, v = symbol("x"), symbol("k"), symbol("v")


@cache
def clutch() -> System:
    return read_system(SYSTEMS / "clutch.yaml")


@cache
def engagements(profiles: int = 2) -> Experiments:
    """A fill pulse, then a level that rises to a limit (fig. 3.7); three motor speeds, two brakes."""
    t = np.arange(4001) * PERIOD
    settings = [(0.108, 0.097, 0.116), (0.236, 0.146, 0.231), (0.172, 0.121, 0.231)][:profiles]
    u = np.array([np.where(t < u1, 0.35, np.minimum(u2 + u3 * (t - u1), 0.6)) for u1, u2, u3 in settings])
    c = np.array(list(product(np.pi / 30.0 * np.array([1200.0, 1350.0, 1500.0]), (10.0, 60.0))))
    start = np.zeros((6, 5))
    start[:, 0], start[:, 3] = 2.0e4, 0.999 * c[:, 0]
    return Experiments(
        u.repeat(6, 0)[:, :, None], PERIOD, np.tile(c, (profiles, 1)), np.tile(start, (profiles, 1))
    )


def of(
    system: System, event: str, uncertain: tuple[str, ...], runs: Experiments, *args: Any, **kw: Any
) -> EventTimes:
    return EventTimes.of(system, event, uncertain, runs.u, runs.period, runs.c, runs.x0, *args, **kw)


def samples(n: int, seed: int = 0) -> Array:
    """Draws around the demonstration's distribution, within its box (section 3.3.3)."""
    draws = np.random.default_rng(seed).normal([1.0, 1.0], [0.07, 0.02], (n, 2))
    return np.clip(draws, [0.7, 0.4], [1.3, 1.15])


@pytest.mark.long
def test_clutch_equals_reference() -> None:
    """With steps of one period; the kernel takes half as long ones for pressure and piston."""
    found = of(clutch(), CLUTCH, UNCERTAIN, engagements(), PERIOD)(samples(2))
    expected = phases.event_times(clutch(), CLUTCH, UNCERTAIN, samples(2), engagements(), PERIOD)
    assert np.isfinite(expected).all()
    assert np.ptp(expected) > 0.3
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-5)


@pytest.mark.long
def test_clutch_equals_adaptive_integration() -> None:
    system, runs = clutch(), engagements()
    rates = numpy_system_function(system, system.closed, efforts_zero=True)
    theta = np.array([[1.0, 1.0], [0.9, 1.1], [1.15, 0.95]])
    found = of(system, CLUTCH, UNCERTAIN, runs, 0.004)(theta)
    p = experiments.scaled_parameters(system, UNCERTAIN, theta)
    for sample, run in ((0, 0), (1, 4), (2, 11)):
        one = runs.only([run])

        def right(t: float, x: Array, one: Experiments = one, p: Array = p[sample]) -> Array:
            return rates(t, x, one.input(t)[0], None, p, one.c[0])

        def slip(t: float, x: Array) -> float:
            return float(x[3] - 2.5 * x[4])

        slip.terminal = True  # type: ignore[attr-defined]
        end = found[sample, run] + 0.1
        solution = solve_ivp(
            right, (0.0, end), one.x0[0], "DOP853", max_step=0.002, rtol=1e-8, atol=1e-8, events=slip
        )
        assert found[sample, run] == pytest.approx(solution.t_events[0][0], abs=2e-4)


def test_innermost_loop_of_the_clutch_is_short() -> None:
    """Two shared values, two states, nothing that could be computed outside, and no division."""
    cascade = Cascade.of(clutch(), clutch().events[0], UNCERTAIN)
    assert (cascade.driven, cascade.shared, cascade.own) == ((0, 1, 2), (), (3, 4))
    assert len(cascade.parts[SHARED]) == 2
    advance = CascadeSource(clutch(), cascade).text().split("def advance")[1].split("@jit")[0]
    assert "/" not in advance.split("while k < stop")[1]


@pytest.mark.parametrize("seed", [16, pytest.param(19, marks=pytest.mark.long)])
def test_random_systems_equal_reference(seed: int) -> None:
    """With parts of every place, and with shared states; nothing is driven: all steps are the same."""
    system, draw = random_structure(seed).system, np.random.default_rng(seed)
    names = tuple(p.name for p in system.parameters)
    u = draw.normal(size=(2, 61, len(system.inputs))).repeat(2, 0)
    c = draw.uniform(0.3, 1.5, (4, len(system.operating_point)))
    runs = Experiments(u, 0.01, c, np.tile(draw.normal(size=len(system.states)), (4, 1)))
    theta = draw.uniform(0.8, 1.2, (40, len(names)))
    value = sum((j + 1) * x for j, x in enumerate(system.x))
    never = replace(system, events=(Event("never", sp.Integer(-1)),))
    path = phases.trajectories(never, "never", names, theta, runs, 0.02).x @ np.arange(1, len(system.x) + 1)
    sign = -1 if np.median(path[..., -1] - path[..., 0]) > 0.0 else 1
    level = sp.Float(np.median(path[..., path.shape[-1] // 2]))
    falling = replace(system, events=(Event("falls", sign * (value - level)),))
    found = of(falling, "falls", names, runs, 0.02)(theta)
    expected = phases.event_times(falling, "falls", names, theta, runs, 0.02)
    assert np.isfinite(expected).mean() > 0.3
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("name", ["pendulum", "slider_crank"])
def test_system_files_equal_reference(name: str) -> None:
    """No operating point: every state is shared by experiments that start alike."""
    system = read_system(SYSTEMS / f"{name}.yaml")
    system = replace(system, events=(Event("passes", sp.Float(2.0) - system.x[0]),))
    t = np.arange(401) * 0.002
    u = np.stack([1.0 + np.sin(9.0 * t), 2.0 + np.cos(5.0 * t)])[:, :, None]
    runs = Experiments(u, 0.002, np.zeros((2, 0)), np.array([[0.3, 0.0], [-0.2, 1.0]]))
    theta = np.random.default_rng(1).uniform(0.5, 1.5, (50, len(system.uncertain)))
    found = of(system, "passes", system.uncertain, runs, 0.004)(theta)
    expected = phases.event_times(system, "passes", system.uncertain, theta, runs, 0.004)
    assert np.isfinite(expected).mean() > 0.3
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9)


def one_state(rate: sp.Expr, event: sp.Expr, value: float = 1.0) -> System:
    """x' = rate(x, t, k, v); k is a parameter, v an operating point."""
    parameters, points = (Parameter("k", "1", value),), (Constant("v", "1"),)
    events = (Event("falls", event),)
    return System("one", (State("x", "1"),), (), (), points, parameters, (), (), {}, (rate,), events=events)


def still(v: list[float], x0: list[float], duration: float = 4.0, period: float = 0.01) -> Experiments:
    """Experiments without input."""
    u = np.zeros((len(v), round(duration / period) + 1, 0))
    return Experiments(u, period, np.array(v)[:, None], np.array(x0)[:, None])


def test_times_are_smooth_in_theta() -> None:
    """Wherever in a step the event lies: x falls exponentially to v."""
    runs = still([0.3, 0.5, 0.5], [1.0, 1.0, 2.0])
    theta = np.linspace(0.8, 1.2, 1001)[:, None]
    found = of(one_state(-k * x, x - v), "falls", ("k",), runs, 0.02)(theta)
    np.testing.assert_allclose(found, np.log(runs.x0 / runs.c)[:, 0] / theta, rtol=0.0, atol=1e-7)


def test_the_first_fall_counts() -> None:
    """x = sin(t) rises through the level before it falls; a level above one is never reached."""
    system = one_state(sp.cos(TIME), x - k, 0.9)
    found = of(system, "falls", ("k",), still([0.0], [0.0]), 0.02)(np.array([[0.5], [1.0], [1.2]]))
    np.testing.assert_allclose(found[:2, 0], np.pi - np.arcsin([0.45, 0.9]), rtol=0.0, atol=1e-7)
    assert np.isnan(found[2, 0])


def test_what_diverges_has_no_time_and_harms_no_other() -> None:
    found = of(one_state(k * x**2, v - x), "falls", ("k",), still([5.0, 1e300], [1.0, 1.0]), 0.01)
    times = found(np.linspace(0.5, 2.0, 40)[:, None])
    np.testing.assert_allclose(times[:, 0], 0.8 / np.linspace(0.5, 2.0, 40), rtol=0.0, atol=1e-5)
    diverging = of(one_state(k * x**2, v + x), "falls", ("k",), still([5.0], [1.0]), 0.01)
    assert np.isnan(diverging(np.linspace(0.5, 2.0, 40)[:, None])).all()


def test_a_log_says_nothing_after_its_end() -> None:
    system, runs = one_state(-k * x, x - v), still([0.5, 0.5], [1.0, 1.0])
    found = of(system, "falls", ("k",), runs, 0.02, duration=np.array([0.6, 4.0]))(np.ones((1, 1)))
    assert np.isnan(found[0, 0])
    assert found[0, 1] == pytest.approx(np.log(2.0))


def test_samples_threads_and_company_make_no_difference() -> None:
    theta, runs = samples(100, seed=3), engagements()
    whole = of(clutch(), CLUTCH, UNCERTAIN, runs, 0.004, threads=2)(theta)
    np.testing.assert_array_equal(of(clutch(), CLUTCH, UNCERTAIN, runs, 0.004, threads=1)(theta), whole)
    alone = of(clutch(), CLUTCH, UNCERTAIN, runs.only([8]), 0.004)
    np.testing.assert_array_equal(alone(theta[::-7]), whole[::-7, 8:9])
    assert whole.shape == (100, 12)
    assert alone(theta[:0]).shape == (0, 1)


def test_the_step_that_is_chosen_is_long_and_good_enough() -> None:
    chosen = of(clutch(), CLUTCH, UNCERTAIN, engagements())
    assert chosen.step > PERIOD
    finest = of(clutch(), CLUTCH, UNCERTAIN, engagements(), PERIOD)
    np.testing.assert_allclose(chosen(samples(40)), finest(samples(40)), rtol=0.0, atol=2e-4)


def test_bounds_are_multiples() -> None:
    found = of(clutch(), CLUTCH, UNCERTAIN, engagements(), 0.004)
    np.testing.assert_allclose(found.bounds, [[0.7, 1.3], [0.4, 1.15]])


def test_a_kept_kernel_is_not_generated_again(monkeypatch: pytest.MonkeyPatch) -> None:
    system, runs = one_state(-k * x, x - v), still([0.5], [1.0])
    of(system, "falls", ("k",), runs, 0.02)

    def refuse(self: CascadeSource) -> str:
        raise AssertionError("generated again")

    monkeypatch.setattr(CascadeSource, "text", refuse)
    found = of(system.with_values({"k": 2.0}), "falls", ("k",), runs, 0.02)(np.ones((1, 1)))
    assert found[0, 0] == pytest.approx(np.log(2.0) / 2.0)
    with pytest.raises(AssertionError):
        of(one_state(-k * x, x - v / 7), "falls", ("k",), runs, 0.02)


def test_nothing_that_a_user_wrote_stands_in_the_code() -> None:
    named = {symbol(name): symbol(f"zebra_{name}") for name in ("x", "k", "v")}
    plain = one_state(-k * x * v, x - v)
    marked = replace(
        plain,
        states=(State("zebra_x", "1"),),
        parameters=(Parameter("zebra_k", "1", 1.0),),
        operating_point=(Constant("zebra_v", "1"),),
        dynamics=tuple(e.xreplace(named) for e in plain.dynamics),
        events=tuple(replace(e, expression=e.expression.xreplace(named)) for e in plain.events),
    )
    text = CascadeSource(marked, Cascade.of(marked, marked.events[0], ("zebra_k",))).text()
    assert "zebra" not in text
    assert text == CascadeSource(plain, Cascade.of(plain, plain.events[0], ("k",))).text()


@pytest.mark.parametrize(
    ("event", "uncertain", "step", "message"),
    [
        ("shif", UNCERTAIN, 0.004, "system clutch: has no event 'shif'; did you mean 'shift'?"),
        (CLUTCH, ("p_hc0", "zp"), 0.004, "system clutch: has no parameter 'zp'; did you mean 'z_p'?"),
        (CLUTCH, ("z_p", "z_p"), 0.004, "system clutch: parameter 'z_p' is named twice: name it once"),
        (
            CLUTCH,
            ("c2",),
            0.004,
            "system clutch: parameter 'c2' is zero, and so is every multiple of it: give it another value, "
            "or hold it fixed",
        ),
        (CLUTCH, UNCERTAIN, 0.0, "step must be a multiple of the period 0.001 s, got 0.0"),
        (CLUTCH, UNCERTAIN, -0.004, "step must be a multiple of the period 0.001 s, got -0.004"),
        (CLUTCH, UNCERTAIN, 0.0035, "step must be a multiple of the period 0.001 s, got 0.0035"),
        (CLUTCH, UNCERTAIN, np.nan, "step must be a multiple of the period 0.001 s, got nan"),
    ],
)
def test_bad_arguments_are_named(event: str, uncertain: tuple[str, ...], step: float, message: str) -> None:
    with pytest.raises(BadInput, match=f"^{re.escape(message)}$"):
        of(clutch(), event, uncertain, engagements(), step)


def test_numbers_must_be_finite_and_fit() -> None:
    runs = engagements()
    u = runs.u.copy()
    u[7, 3] = np.nan
    with pytest.raises(
        BadInput, match=r"^experiment 8: the input has a value that is not finite: correct its log$"
    ):
        EventTimes.of(clutch(), CLUTCH, UNCERTAIN, u, PERIOD, runs.c, runs.x0, 0.004)
    with pytest.raises(BadInput, match=r"^period must be a positive number of seconds, got 0.0$"):
        EventTimes.of(clutch(), CLUTCH, UNCERTAIN, runs.u, 0.0, runs.c, runs.x0, 0.004)
    with pytest.raises(ValueError, match=r"^theta must be \(samples, 2\), got \(1, 3\)$"):
        of(clutch(), CLUTCH, UNCERTAIN, runs, 0.004)(np.ones((1, 3)))
    with pytest.raises(ValueError, match=r"^12 inputs, 11 constants and 12 starts$"):
        EventTimes.of(clutch(), CLUTCH, UNCERTAIN, runs.u, PERIOD, runs.c[:11], runs.x0, 0.004)
