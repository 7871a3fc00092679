"""The bounce simulation against closed forms, its fit, its use as a model, and a network on top of it."""

import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.cam_follower import bounce
from pipeline.cam_follower.bounce import Bounce, BounceParameters, CamMotion, simulate
from pipeline.cam_follower.bounce_fitting import START, fit_bounce
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.detachment import Family
from pipeline.cam_follower.jumps import Observed
from pipeline.cam_follower.sequence.hybrid import BounceHybrid
from pipeline.cam_follower.sequence.recipe import SequenceRecipe
from pipeline.cam_follower.sequence.training import Training
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from pipeline.cam_follower.simulation import BounceRecipe, Ensemble, gate, gated, residual, with_bounce
from pipeline.stages.featurize import interface_force, on_cam
from unmodelled.base.arrays import Array, Indices
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.learning.splits import Fold, Split

PERIOD = 0.01
PARAMETERS = BounceParameters(
    restitution=0.7, contact_compliance=6e-6, shaft_compliance=0.02, guide_coulomb=0.5, guide_viscous=10.0
)


def campaign(angles: Sequence[Array], H: float = 0.03, beta: float = np.pi, m: float = 1.0) -> Campaign:
    """One run per angle (rad, at 100 Hz), all of one cam and mass, in contact throughout."""
    lengths = [len(angle) for angle in angles]
    table = pd.DataFrame({"exp": np.arange(1, len(angles) + 1), "H": H, "beta": beta, "m": m})
    signals = {
        "t": np.concatenate([PERIOD * np.arange(n) for n in lengths]),
        "theta": np.concatenate(list(angles)),
        "eps": np.zeros(sum(lengths)),
    }
    return Campaign(table, signals, np.append(0, np.cumsum(lengths)), {})


def turning(speed: float, samples: int = 100) -> Array:
    """Angle, rad, of a cam that takes up `speed` (rad/s) within a fifth of a second."""
    t = PERIOD * np.arange(samples)
    return np.asarray(speed * (t - 0.05 * (1.0 - np.exp(-t / 0.05))))


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
    start = whole._replace(height=whole.height + height, speed=np.array([speed]))
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
def test_an_impact_returns_the_restitution(restitution: float, speed: float, angle: float) -> None:
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


@pytest.mark.parametrize(
    ("name", "sample", "value", "message"),
    [
        ("theta", 103, np.nan, "experiment 2: theta is not a finite number at sample 3"),
        ("t", 150, 0.505, "experiment 2: t must be uniform with 0.01 s between samples"),
    ],
)
def test_wrong_signals_are_refused(name: str, sample: int, value: float, message: str) -> None:
    runs = campaign([turning(10.0), turning(20.0)])
    runs.signals[name][sample] = value
    with pytest.raises(BadInput, match=message):
        CamMotion.of(runs, BENCH)
    assert len(CamMotion.of(runs, BENCH, np.array([0]))) == 1


def test_wrong_settings_are_refused() -> None:
    with pytest.raises(BadInput, match="experiment 1: m must be positive, got nan"):
        CamMotion.of(campaign([turning(10.0)], m=np.nan), BENCH)
    with pytest.raises(BadInput, match="experiment 2: has fewer than two samples"):
        CamMotion.of(campaign([turning(10.0), turning(10.0, 1)]), BENCH)


def measured() -> Campaign:
    """Runs whose follower moves as the simulation says."""
    runs = campaign([turning(speed) for speed in (22.0, 24.0, 26.0, 28.0, 30.0, 32.0, 25.0, 27.0)])
    eps = simulate(CamMotion.of(runs, BENCH), PARAMETERS).eps
    return replace(runs, signals={**runs.signals, "eps": eps})


TRAIN = np.arange(6)


def test_planted_parameters_are_found_again() -> None:
    found = fit_bounce(measured(), TRAIN, BENCH)
    assert found.restitution == pytest.approx(PARAMETERS.restitution, rel=0.03)
    # over the speeds of short falls the two kinds of friction can hardly be told apart
    friction, expected = (p.guide_coulomb + p.guide_viscous * 0.3 for p in (found, PARAMETERS))
    assert friction == pytest.approx(expected, rel=0.02)
    assert found.contact_compliance == pytest.approx(PARAMETERS.contact_compliance, rel=0.2)
    assert found.shaft_compliance == pytest.approx(PARAMETERS.shaft_compliance, rel=0.2)


def test_test_runs_play_no_part() -> None:
    runs = measured()
    spoilt = {name: np.where(np.arange(800) < 600, x, np.nan) for name, x in runs.signals.items()}
    first, second = (fit_bounce(r, TRAIN, BENCH) for r in (runs, replace(runs, signals=spoilt)))
    assert first == second


def test_runs_without_jumps_or_numbers_are_refused() -> None:
    with pytest.raises(BadInput, match="the follower never leaves the cam in the 2 training runs"):
        fit_bounce(campaign([turning(5.0), turning(6.0)]), np.arange(2), BENCH)
    runs = measured()
    eps = np.where(np.arange(800) == 207, np.nan, runs.signals["eps"])
    with pytest.raises(BadInput, match="experiment 3: eps is not a finite number at sample 7"):
        fit_bounce(replace(runs, signals={**runs.signals, "eps": eps}), TRAIN, BENCH)


BOUNCE = BounceRecipe(BENCH, members=1, samples=100)
NETWORK = SequenceRecipe(
    SequenceInputs(("F_dagger", "omega", "eps_bounce"), ("m", "H")),
    Training(batch=6, epochs=2, updates=10, most=300),
    hidden=8,
    head=8,
    samples=100,
)
HYBRID = BounceHybrid(BOUNCE, NETWORK)
TRUE = BounceParameters(0.6, 4e-6, 1e-2, 0.8, 9.0)
ROWS, OTHERS = np.arange(1, 40, 2), np.arange(0, 40, 2)
FOLDS = {"half": ROWS, "few": np.array([9, 19, 29, 39])}


def detached(campaign: Campaign, eps: Array) -> Campaign:
    return replace(campaign, signals={**campaign.signals, "eps": eps})


@pytest.fixture(scope="module")
def bouncing(jump_campaign: Campaign) -> Campaign:
    """The runs as the simulation with known parameters sees them."""
    return detached(jump_campaign, with_bounce(jump_campaign, BENCH, TRUE).signals["eps_bounce"])


@pytest.fixture(scope="module")
def missing(bouncing: Campaign) -> Campaign:
    """The same with every flight 2 mm higher, which no impact explains."""
    eps = bouncing.signals["eps"]
    return detached(bouncing, np.where(eps > 3e-4, eps + 2e-3, eps))


def error(campaign: Campaign, eps: Array, rows: Indices) -> float:
    """Mean squared error over the runs `rows`, mm^2."""
    return float(Observed.of(campaign, 100).squared_error(np.median(eps, 0))[rows].mean())


def test_the_simulation_is_identified_on_each_fold(bouncing: Campaign, tmp_path: Path) -> None:
    seconds = BOUNCE.fit(bouncing, FOLDS, 3, 0, tmp_path)
    fitted = BOUNCE.read(tmp_path)
    assert fitted.folds == ["half", "few"] and seconds > 0
    assert fitted.parameters["half"].restitution == pytest.approx(TRUE.restitution, abs=0.05)
    eps = fitted.detachment("half", bouncing)
    assert eps.shape == (1, 40, 100)
    assert error(bouncing, eps, OTHERS) < 0.02 * error(bouncing, np.zeros_like(eps), OTHERS)


def test_where_nothing_flies_the_parameters_stay(bouncing: Campaign, tmp_path: Path) -> None:
    flat = detached(bouncing, np.full_like(bouncing.signals["eps"], 1e-5))
    BOUNCE.fit(flat, {"one": np.array([3])}, 1, 0, tmp_path)
    assert BOUNCE.read(tmp_path).parameters["one"] == START


def test_the_network_learns_what_the_simulation_leaves(missing: Campaign, tmp_path: Path) -> None:
    HYBRID.fit(missing, {"half": ROWS}, 2, 0, tmp_path)
    fitted = HYBRID.read(tmp_path)
    assert fitted.parts == {"bounce": fitted.physics} and fitted.physics.parts == {}
    eps = fitted.detachment("half", missing)
    assert eps.shape == (2, 40, 100) and not np.array_equal(eps[0], eps[1])
    alone = fitted.physics.detachment("half", missing)
    assert error(missing, eps, OTHERS) < 0.8 * error(missing, alone, OTHERS)
    # silent where the simulation leaves no doubt of contact, and after the end of a run
    signals = Sequences.of(fitted.physics.simulated("half", missing), SequenceInputs(("gate",)), 100)
    gate = signals.features[..., 0]
    assert 0.2 < (gate[signals.mask] == 0).mean() < 0.95
    assert (eps[:, gate == 0] == 0).all() and (eps[:, gate > 0] != 0).all()


@pytest.mark.long
def test_a_second_fit_keeps_the_first(bouncing: Campaign, tmp_path: Path) -> None:
    HYBRID.fit(bouncing, FOLDS, 1, 0, tmp_path)
    made = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.pt")}
    eps = HYBRID.read(tmp_path).detachment("few", bouncing)
    HYBRID.fit(bouncing, FOLDS, 1, 0, tmp_path)
    assert made == {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.pt")} and len(made) == 2
    np.testing.assert_array_equal(HYBRID.read(tmp_path).detachment("few", bouncing), eps)


def test_a_family_keeps_its_members_apart(bouncing: Campaign, tmp_path: Path) -> None:
    bouncing.write(tmp_path / "features")
    recipes = {"a": BOUNCE, "b": replace(BOUNCE, members=2)}
    family = Family(recipes, tmp_path / "features", BENCH)
    split, out = Split(lambda experiments: [Fold("few", FOLDS["few"], OTHERS)]), tmp_path / "fits"
    family.train(None, None, split, {"repeats": 1}, None, "cpu", 0, out)
    one, two = (recipe.read(out / name) for name, recipe in recipes.items())
    assert one.ensemble.members == 1 and two.ensemble.members == 2
    tables = family.evaluate(None, None, out, split)
    assert set(tables) == {"runs", "repeats", "examples"}
    assert tables["runs"].groupby("model").size().to_dict() == {"a": len(OTHERS), "b": len(OTHERS)}


def test_impossible_ensembles_and_windows_are_refused() -> None:
    with pytest.raises(BadInput, match="samples must be the same of bounce and network, got 50 and 100"):
        replace(HYBRID, bounce=replace(BOUNCE, samples=50))
    for change in ({"members": 0}, {"samples": 0}, {"reach": -1}, {"spread": -0.1}):
        with pytest.raises(BadInput, match="bounce: members and samples must be positive"):
            replace(Ensemble(members=1, spread=0.1, reach=2, samples=10), **change)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("bounce.json", None, r"bounce\.json: no such file"),
        ("bounce.json", "{}", "does not say how the simulation is used"),
        ("01.json", '{"restitution": 0.5}', r"01\.json: must hold"),
    ],
)
def test_damaged_fits_are_refused(
    name: str, content: str | None, message: str, bouncing: Campaign, tmp_path: Path
) -> None:
    BOUNCE.fit(bouncing, FOLDS, 1, 0, tmp_path)
    (tmp_path / name).unlink()
    if content is not None:
        (tmp_path / name).write_text(content)
    with pytest.raises(BadInput, match=message):
        BOUNCE.read(tmp_path)


def test_the_ensemble_is_the_one_that_was_fitted(bouncing: Campaign, tmp_path: Path) -> None:
    """The command line evaluates without a profile, which is where the number of members stands."""
    BOUNCE.fit(bouncing, FOLDS, 1, 0, tmp_path)
    assert json.loads((tmp_path / "bounce.json").read_text())["members"] == 1
    assert replace(BOUNCE, members=0).read(tmp_path).ensemble.members == 1
