"""The bounce simulation against closed-form flights and impacts, and what it refuses."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipeline.cam_follower import bounce
from pipeline.cam_follower.bounce import Bounce, BounceParameters, CamMotion, simulate
from pipeline.cam_follower.bounce_kernel import Stretches
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.simulation import gate, gated, residual, with_bounce
from pipeline.stages.featurize import interface_force, on_cam
from tests.learning.bounce_runs import PARAMETERS, PERIOD, campaign, turning
from unmodelled.base.errors import BadInput

Array = NDArray[np.float64]
BENCH = CamFollower()
#: A bench in outer space, and a guide without friction: the smallest positive numbers that matter nowhere.
WEIGHTLESS = CamFollower(gravity=1e-12)
FRICTIONLESS = replace(PARAMETERS, guide_coulomb=1e-12, guide_viscous=1e-12)


def thrown(
    parameters: BounceParameters, height: float, speed: float, bench: CamFollower = BENCH, angle: float = 0.0
) -> tuple[Array, Bounce]:
    """Time and simulation of a follower of 1 kg thrown from a height above a cam at rest."""
    cams = CamMotion.of(campaign([np.full(31, angle)]), bench)
    whole = cams.from_the_start()
    start = Stretches(
        whole.run, whole.piece, whole.steps, whole.height + height, np.array([speed]), whole.first
    )
    return PERIOD * np.arange(31), cams.simulate(parameters, start)


@settings(deadline=None, max_examples=20)
@given(st.floats(-2.0, 2.0))
def test_flight_without_friction_is_a_parabola(speed: float) -> None:
    t, flight = thrown(FRICTIONLESS, 2.0, speed)
    assert np.allclose(flight.eps, 2.0 + speed * t - 0.5 * BENCH.gravity * t**2, rtol=0, atol=1e-12)
    assert not flight.contact.any()


def test_fall_against_the_friction_of_the_guide() -> None:
    b0, b1, v0 = PARAMETERS.guide_coulomb, PARAMETERS.guide_viscous, -0.3
    t, fall = thrown(PARAMETERS, 2.0, v0)
    end = -(BENCH.gravity - b0) / b1  # terminal speed
    expected = 2.0 + end * t + (v0 - end) / b1 * (1.0 - np.exp(-b1 * t))
    assert np.allclose(fall.eps, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("restitution", [0.3, 0.8, 1.0])
@pytest.mark.parametrize("speed", [0.3, 1.5])
@pytest.mark.parametrize("angle", [0.0, 1.5])
def test_an_impact_returns_the_square_of_the_restitution(
    restitution: float, speed: float, angle: float
) -> None:
    """Also on a slope, where the shaft gives way, too."""
    parameters = replace(FRICTIONLESS, restitution=restitution)
    _, flight = thrown(parameters, 0.02, -speed, WEIGHTLESS, angle)
    after = (flight.eps[-1] - flight.eps[-2]) / PERIOD
    assert flight.contact[-1] == 0.0
    assert after / speed == pytest.approx(restitution, abs=0.015)


def test_a_falling_follower_comes_to_rest_on_the_cam() -> None:
    _, fall = thrown(PARAMETERS, 0.002, 0.0)
    assert fall.contact[0] == 0.0 and fall.contact[-1] == 1.0
    assert abs(fall.eps[-1]) < 1e-7


def test_a_slow_cam_is_followed() -> None:
    slow = simulate(CamMotion.of(campaign([turning(6.0)]), BENCH), PARAMETERS)
    assert slow.contact.all()
    assert np.abs(slow.eps).max() < 3e-5


def test_flight_begins_where_the_interface_force_passes_zero() -> None:
    runs = campaign([turning(27.0)])
    bench = CamFollower(guide_coulomb=PARAMETERS.guide_coulomb, guide_viscous=PARAMETERS.guide_viscous)
    fast = simulate(CamMotion.of(runs, bench), PARAMETERS)
    assert fast.contact[0] == 1.0 and fast.eps.max() > 0.003
    omega = np.gradient(runs[0]["theta"], PERIOD)
    _, dh, d2h = on_cam(bench.cam(0.03, np.pi).pitch_curve(7200), runs[0]["theta"])
    force = interface_force()(omega, np.gradient(omega, PERIOD), dh, d2h, 1.0, *bench.constants)
    assert abs(int(np.argmin(fast.contact)) - int(np.argmax(force < 0.0))) <= 1


def test_shorter_steps_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    cams = CamMotion.of(campaign([turning(27.0, 50)]), BENCH)
    coarse = simulate(cams, PARAMETERS).eps
    monkeypatch.setattr(bounce, "STEP", bounce.STEP / 8)
    assert np.abs(simulate(cams, PARAMETERS).eps - coarse).max() < 5e-5


def test_runs_do_not_depend_on_each_other_and_repeat() -> None:
    angles = [turning(12.0), turning(20.0, 60), turning(25.0, 80)]
    runs = campaign(angles)
    together = simulate(CamMotion.of(runs, BENCH), PARAMETERS)
    alone = [simulate(CamMotion.of(runs, BENCH, np.array([i])), PARAMETERS) for i in (0, 1, 2)]
    for whole, parts in zip(together, zip(*alone, strict=True), strict=True):
        assert np.array_equal(whole, np.concatenate(parts))


def test_an_ensemble_repeats_and_spreads() -> None:
    cams = CamMotion.of(campaign([turning(25.0)]), BENCH)
    first, second = (simulate(cams, PARAMETERS, members=5) for _ in range(2))
    assert np.array_equal(first.eps, second.eps)
    assert np.any((first.contact > 0.0) & (first.contact < 1.0))
    narrow = simulate(cams, PARAMETERS, members=3, spread=1e-12)
    assert np.allclose(narrow.eps, simulate(cams, PARAMETERS).eps, rtol=0, atol=1e-6)


def test_gate_reaches_around_flights_but_not_into_the_next_run() -> None:
    contact = np.array([1.0, 1, 1, 0, 1, 1, 1, 1, 1, 0.4, 1])
    opening = gate(contact, np.array([0, 4, 11]), reach=1)
    assert np.allclose(opening, [0, 0, 1, 1, 0, 0, 0, 0, 0.6, 0.6, 0.6])


def test_the_hybrid_with_a_perfect_network_is_exact_wherever_the_gate_is_open() -> None:
    runs = campaign([turning(20.0), turning(25.0)])
    runs = replace(runs, signals={**runs.signals, "eps": np.linspace(0.0, 1e-2, 200)})
    extended = with_bounce(runs, BENCH, PARAMETERS)
    opening, simulated = extended.signals["gate"], extended.signals["eps_bounce"]
    result = gated(opening, simulated, residual(extended).signals["eps"])
    assert 0 < opening.sum() < len(opening)
    assert np.allclose(result, np.where(opening == 1.0, runs.signals["eps"], 0.0), rtol=0, atol=1e-15)


def test_parameters_survive_a_file(tmp_path: Path) -> None:
    PARAMETERS.write(tmp_path / "p.json")
    assert BounceParameters.read(tmp_path / "p.json") == PARAMETERS


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"restitution": -0.1}, "restitution must be a positive number, got -0.1"),
        ({"restitution": 1.1}, "restitution must be at most 1, got 1.1"),
        ({"guide_viscous": "x"}, "guide_viscous must be a positive number, got x"),
        ({"guide_vicsous": 1.0}, "must hold restitution, contact_compliance"),
    ],
)
def test_wrong_parameters_are_refused(tmp_path: Path, change: dict[str, object], message: str) -> None:
    path = tmp_path / "p.json"
    path.write_text(json.dumps(asdict(PARAMETERS) | change))
    with pytest.raises(BadInput, match=message) as refusal:
        BounceParameters.read(path)
    assert str(path) in str(refusal.value)


def broken(name: str, sample: int, value: float) -> dict[str, Array]:
    signals = dict(campaign([turning(10.0), turning(20.0)]).signals)
    signals[name] = signals[name].copy()
    signals[name][sample] = value
    return signals


@pytest.mark.parametrize(
    ("signals", "message"),
    [
        (broken("theta", 103, np.nan), "experiment 2: theta is not a finite number at sample 3"),
        (broken("t", 150, 0.505), "experiment 2: t must be uniform with 0.01 s between samples"),
    ],
)
def test_wrong_signals_are_refused(signals: dict[str, Array], message: str) -> None:
    runs = replace(campaign([turning(10.0), turning(20.0)]), signals=signals)
    with pytest.raises(BadInput, match=message):
        CamMotion.of(runs, BENCH)
    assert len(CamMotion.of(runs, BENCH, np.array([0]))) == 1


def test_wrong_settings_are_refused() -> None:
    with pytest.raises(BadInput, match="experiment 1: m must be positive, got nan"):
        CamMotion.of(campaign([turning(10.0)], m=np.nan), BENCH)
    with pytest.raises(BadInput, match="experiment 2: has fewer than two samples"):
        CamMotion.of(campaign([turning(10.0), turning(10.0, 1)]), BENCH)
