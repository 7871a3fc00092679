"""The numpy simulation of both phases, against closed forms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from unmodelled.systems import experiments, phases
from unmodelled.systems.experiments import Experiments
from unmodelled.systems.model import Constant, Event, Input, Parameter, Port, State, System, symbol
from unmodelled.systems.reader import read_system

h, v, g, u, F, top = (symbol(name) for name in ("h", "v", "g", "u", "F", "top"))
SYSTEMS = Path(__file__).parents[3] / "systems"
#: A stone falls into water: there it sinks at the speed that it has.
STONE = System(
    "stone",
    (State("h", "m"), State("v", "m/s")),
    (Input("u", "m/s^2", "u"),),
    (),
    (Constant("top", "m"),),
    (Parameter("g", "m/s^2", 9.0),),
    (Port("stone", "F", "m/s^2", law=0 * h),),
    (),
    {},
    (v, u - g - F),
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
    system = read_system(SYSTEMS / "clutch.yaml")
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


def test_what_is_uncertain_is_a_multiple() -> None:
    p = experiments.scaled_parameters(STONE, ("g",), np.array([[0.5], [2.0]]))
    np.testing.assert_array_equal(p, [[4.5], [18.0]])
