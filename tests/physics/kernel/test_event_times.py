"""Event times, compiled and by numpy: those of closed forms, of an adaptive integrator, and of each other."""

import re
from dataclasses import replace
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from pipeline.chapters import phases
from tests.machines.known import EMPTY, Array, built_in
from tests.physics.kernel.random_systems import random_structure
from unmodelled.base.errors import BadInput
from unmodelled.engine.cascade.cascade import SHARED, Cascade
from unmodelled.engine.cascade.cascade_source import CascadeSource
from unmodelled.engine.cascade.event_times import EventTimes
from unmodelled.systems.experiments import Experiments
from unmodelled.systems.model import TIME, Constant, Event, Input, Parameter, Port, State, System, symbol
from unmodelled.systems.numeric import numpy_system_function

h, v, g, u, F, top, x, k = (symbol(name) for name in ("h", "v", "g", "u", "F", "top", "x", "k"))
#: A stone falls into water: there it sinks at the speed that it has.
STONE = replace(
    EMPTY,
    states=(State("h", "m"), State("v", "m/s")),
    inputs=(Input("u", "m/s^2", "u"),),
    operating_point=(Constant("top", "m"),),
    parameters=(Parameter("g", "m/s^2", 9.0),),
    ports=(Port("stone", "F", "m/s^2", law=0 * h),),
    dynamics=(v, u - g - F),
    events=(Event("water", h + top, (v, F)),),
)


def falls(tops: list[float], samples: int = 201) -> Experiments:
    none = np.zeros((len(tops), samples, 1))
    return Experiments(none, 0.01, np.array(tops)[:, None], np.zeros((len(tops), 2)))


def test_both_phases_of_a_falling_stone() -> None:
    """Parabolas are exact for the method, wherever in a step the water is."""
    theta = np.array([[0.7], [1.0], [1.3]])
    runs = falls([0.5, 1.234, 50.0])
    found = phases.trajectories(STONE, "water", ("g",), theta, runs, 0.02)
    assert found.x.shape == (3, 3, 101, 2)
    time = np.sqrt(2.0 * runs.c[:, 0] / (9.0 * theta))
    np.testing.assert_allclose(found.time[:, :2], time[:, :2], rtol=0.0, atol=1e-12)
    assert np.isnan(found.time[:, 2]).all()
    until = np.minimum(found.t, time[..., None])
    speed = -9.0 * theta[..., None] * until
    np.testing.assert_allclose(found.x[..., 1], speed, rtol=0.0, atol=1e-10)
    height = 0.5 * speed * until + speed * (found.t - until)
    np.testing.assert_allclose(found.x[..., 0], height, rtol=0.0, atol=1e-10)


def test_times_alone_are_those_of_the_trajectories() -> None:
    theta, runs = np.array([[0.9], [1.1]]), falls([0.5, 3.0])
    found = phases.event_times(STONE, "water", ("g",), theta, runs, 0.05)
    np.testing.assert_array_equal(found, phases.trajectories(STONE, "water", ("g",), theta, runs, 0.05).time)


def test_inputs_run_along_straight_lines() -> None:
    """u rises with 6 m/s^3 from zero: v = 3 t^2 - g t, also in steps of three samples."""
    runs = falls([0.2])
    ramp = replace(runs, u=6.0 * runs.period * np.arange(201.0)[None, :, None])
    found = phases.trajectories(STONE, "water", ("g",), np.ones((1, 1)), ramp, 0.03)
    before = found.t < found.time[0, 0]
    assert before.sum() > 5
    speed = 3.0 * found.t**2 - 9.0 * found.t
    np.testing.assert_allclose(found.x[0, 0, before, 1], speed[before], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(ramp.input(0.0137), [[6.0 * 0.0137]])
    np.testing.assert_allclose(ramp.input(np.array([[0.5], [7.0]])), [[[3.0]], [[12.0]]])


def test_without_another_phase_the_motion_goes_on() -> None:
    system = replace(STONE, events=(Event("passes", h + top),))
    found = phases.trajectories(system, "passes", ("g",), np.ones((1, 1)), falls([0.5]), 0.02)
    np.testing.assert_allclose(found.x[0, 0, :, 0], -4.5 * found.t**2, rtol=0.0, atol=1e-10)


def test_the_locked_shafts_of_the_clutch_turn_together() -> None:
    """From the event on, and with the momentum that they have (eq. 3.20)."""
    system = built_in("clutch")
    t = np.arange(801) * 0.005
    current = np.where(t < 0.172, 0.35, np.minimum(0.121 + 0.231 * t, 0.6))[None, :, None]
    runs = Experiments(current, 0.005, np.array([[140.0, 60.0]]), np.array([[2e4, 0.0, 0.0, 139.86, 0.0]]))
    found = phases.trajectories(system, "shift", ("p_hc0", "z_p"), np.ones((1, 2)), runs, 0.005)
    slip = found.x[0, 0, :, 3] - 2.5 * found.x[0, 0, :, 4]
    after = found.t > found.time[0, 0]
    assert 0.1 < after.mean() < 0.9
    assert slip[~after].min() > 0.0
    np.testing.assert_allclose(slip[after], 0.0, atol=1e-5)
    assert np.abs(np.diff(found.x[0, 0, :, 3])).max() < 2.0


UNCERTAIN = ("p_hc0", "z_p")
CLUTCH = built_in("clutch")
SHIFT = CLUTCH, "shift", UNCERTAIN
PERIOD = 0.001


@cache
def engagements() -> Experiments:
    """A fill pulse, then a level that rises to a limit (fig. 3.7); three motor speeds, two brakes."""
    t = np.arange(4001) * PERIOD
    settings = [(0.108, 0.097, 0.116), (0.236, 0.146, 0.231)]
    u = np.array([np.where(t < u1, 0.35, np.minimum(u2 + u3 * (t - u1), 0.6)) for u1, u2, u3 in settings])
    c = np.array(list(product(np.pi / 30.0 * np.array([1200.0, 1350.0, 1500.0]), (10.0, 60.0))))
    start = np.zeros((6, 5))
    start[:, 0], start[:, 3] = 2.0e4, 0.999 * c[:, 0]
    return Experiments(u.repeat(6, 0)[:, :, None], PERIOD, np.tile(c, (2, 1)), np.tile(start, (2, 1)))


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
    found = of(*SHIFT, engagements(), PERIOD)(samples(2))
    expected = phases.event_times(*SHIFT, samples(2), engagements(), PERIOD)
    assert np.isfinite(expected).all()
    assert np.ptp(expected) > 0.3
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-5)


@pytest.mark.long
def test_clutch_equals_adaptive_integration() -> None:
    system, runs = CLUTCH, engagements()
    rates = numpy_system_function(system, system.closed, efforts_zero=True)
    theta = np.array([[1.0, 1.0], [0.9, 1.1], [1.15, 0.95]])
    found = of(*SHIFT, runs, 0.004)(theta)
    p = phases.scaled_parameters(system, UNCERTAIN, theta)
    for sample, run in ((0, 0), (1, 4), (2, 11)):
        one = runs.only([run])

        def right(t: float, x: Array, one: Experiments = one, p: Array = p[sample]) -> Array:
            return rates(t, x, one.input(t)[0], None, p, one.c[0])

        def slip(t: float, x: Array) -> float:
            return float(x[3] - 2.5 * x[4])

        slip.terminal = True  # type: ignore[attr-defined]
        end = found[sample, run] + 0.1
        how = {"method": "DOP853", "max_step": 0.002, "rtol": 1e-8, "atol": 1e-8, "events": slip}
        solution = solve_ivp(right, (0.0, end), one.x0[0], **how)
        assert found[sample, run] == pytest.approx(solution.t_events[0][0], abs=2e-4)


def test_innermost_loop_of_the_clutch_is_short() -> None:
    """Two shared values, two states, nothing that could be computed outside, and no division."""
    cascade = Cascade.of(CLUTCH, CLUTCH.events[0], UNCERTAIN)
    assert (cascade.driven, cascade.shared, cascade.own) == ((0, 1, 2), (), (3, 4))
    assert len(cascade.parts[SHARED]) == 2
    advance = CascadeSource(CLUTCH, cascade).text().split("def advance")[1].split("@jit")[0]
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
    system = built_in(name)
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
    points, parameters, events = Constant("v", "1"), Parameter("k", "1", value), Event("falls", event)
    parts = {"operating_point": (points,), "parameters": (parameters,), "events": (events,)}
    return replace(EMPTY, states=(State("x", "1"),), dynamics=(rate,), **parts)


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
    whole = of(*SHIFT, runs, 0.004, threads=2)(theta)
    np.testing.assert_array_equal(of(*SHIFT, runs, 0.004, threads=1)(theta), whole)
    alone = of(*SHIFT, runs.only([8]), 0.004)
    np.testing.assert_array_equal(alone(theta[::-7]), whole[::-7, 8:9])
    assert whole.shape == (100, 12)
    assert alone(theta[:0]).shape == (0, 1)


def test_the_step_that_is_chosen_is_long_and_good_enough() -> None:
    chosen = of(*SHIFT, engagements())
    assert chosen.step > PERIOD
    finest = of(*SHIFT, engagements(), PERIOD)
    np.testing.assert_allclose(chosen(samples(40)), finest(samples(40)), rtol=0.0, atol=2e-4)


def test_bounds_are_multiples() -> None:
    found = of(*SHIFT, engagements(), 0.004)
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
        ("shift", ("p_hc0", "zp"), 0.004, "system clutch: has no parameter 'zp'; did you mean 'z_p'?"),
        ("shift", ("z_p", "z_p"), 0.004, "system clutch: parameter 'z_p' is named twice: name it once"),
        (
            "shift",
            ("c2",),
            0.004,
            "system clutch: parameter 'c2' is zero, and so is every multiple of it: give it another "
            "value, or hold it fixed",
        ),
        *(
            ("shift", UNCERTAIN, step, f"step must be a multiple of the period 0.001 s, got {step}")
            for step in (0.0, -0.004, 0.0035, np.nan)
        ),
    ],
)
def test_bad_arguments_are_named(event: str, uncertain: tuple[str, ...], step: float, message: str) -> None:
    with pytest.raises(BadInput, match=f"^{re.escape(message)}$"):
        of(CLUTCH, event, uncertain, engagements(), step)


def test_numbers_must_be_finite_and_fit() -> None:
    runs = engagements()
    u = runs.u.copy()
    u[7, 3] = np.nan
    words = r"^experiment 8: the input has a value that is not finite: correct its log$"
    with pytest.raises(BadInput, match=words):
        EventTimes.of(*SHIFT, u, PERIOD, runs.c, runs.x0, 0.004)
    with pytest.raises(BadInput, match=r"^period must be a positive number of seconds, got 0.0$"):
        EventTimes.of(*SHIFT, runs.u, 0.0, runs.c, runs.x0, 0.004)
    with pytest.raises(ValueError, match=r"^theta must be \(samples, 2\), got \(1, 3\)$"):
        of(*SHIFT, runs, 0.004)(np.ones((1, 3)))
    with pytest.raises(ValueError, match=r"^12 inputs, 11 constants and 12 starts$"):
        EventTimes.of(*SHIFT, runs.u, PERIOD, runs.c[:11], runs.x0, 0.004)
