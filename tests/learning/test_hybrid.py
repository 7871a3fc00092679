"""The bounce simulation as a model, and a network for what it leaves."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.cam_follower.bounce import BounceParameters
from pipeline.cam_follower.bounce_fitting import START
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.detachment import Family
from pipeline.cam_follower.jumps import Observed
from pipeline.cam_follower.sequence.hybrid import BounceHybrid
from pipeline.cam_follower.sequence.recipe import SequenceRecipe
from pipeline.cam_follower.sequence.training import Training
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from pipeline.cam_follower.simulation import BounceRecipe, Ensemble, shortened, with_bounce
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.learning.splits import Fold, Split

MECHANISM = CamFollower()
BOUNCE = BounceRecipe(MECHANISM, members=1, samples=100)
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


@pytest.fixture(scope="module")
def bouncing(jump_campaign: Campaign) -> Campaign:
    """The runs as the simulation with known parameters sees them."""
    simulated = with_bounce(jump_campaign, MECHANISM, TRUE)
    return replace(jump_campaign, signals={**jump_campaign.signals, "eps": simulated.signals["eps_bounce"]})


@pytest.fixture(scope="module")
def missing(bouncing: Campaign) -> Campaign:
    """The same with every flight 2 mm higher, which no impact explains."""
    eps = bouncing.signals["eps"]
    return replace(bouncing, signals={**bouncing.signals, "eps": np.where(eps > 3e-4, eps + 2e-3, eps)})


def error(campaign: Campaign, eps: NDArray[np.float64], rows: NDArray[np.int64]) -> float:
    """Mean squared error over the runs `rows`, mm^2."""
    return float(Observed.of(campaign, 100).squared_error(np.median(eps, 0))[rows].mean())


def test_the_simulation_is_identified_on_each_fold(bouncing: Campaign, tmp_path: Path) -> None:
    seconds = BOUNCE.fit(bouncing, FOLDS, 3, 0, tmp_path)
    fitted = BOUNCE.read(tmp_path)
    assert fitted.folds == ["half", "few"] and seconds > 0
    assert fitted.parameters["half"].restitution == pytest.approx(TRUE.restitution, abs=0.05)
    others = np.setdiff1d(np.arange(40), ROWS)
    eps = fitted.detachment("half", bouncing)
    assert eps.shape == (1, 40, 100)
    zero = error(bouncing, np.zeros_like(eps), others)
    assert error(bouncing, eps, others) < 0.02 * zero


def test_where_nothing_flies_the_parameters_stay(bouncing: Campaign, tmp_path: Path) -> None:
    flat = replace(bouncing, signals={**bouncing.signals, "eps": np.full(len(bouncing.signals["eps"]), 1e-5)})
    BOUNCE.fit(flat, {"one": np.array([3])}, 1, 0, tmp_path)
    assert BOUNCE.read(tmp_path).parameters["one"] == START


def test_a_short_campaign_holds_the_first_samples(jump_campaign: Campaign) -> None:
    short = shortened(jump_campaign, 90)
    lengths = np.diff(jump_campaign.offsets)
    assert np.diff(short.offsets).tolist() == np.minimum(lengths, 90).tolist() and lengths.min() < 90
    for i in (0, 4, 39):
        np.testing.assert_array_equal(short[i]["omega"], jump_campaign[i]["omega"][:90])


def test_the_network_learns_what_the_simulation_leaves(missing: Campaign, tmp_path: Path) -> None:
    HYBRID.fit(missing, {"half": ROWS}, 2, 0, tmp_path)
    fitted = HYBRID.read(tmp_path)
    assert fitted.parts == {"bounce": fitted.physics} and fitted.physics.parts == {}
    eps = fitted.detachment("half", missing)
    assert eps.shape == (2, 40, 100) and not np.array_equal(eps[0], eps[1])
    alone = fitted.physics.detachment("half", missing)
    others = np.setdiff1d(np.arange(40), ROWS)
    assert error(missing, eps, others) < 0.8 * error(missing, alone, others)
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
    family = Family(recipes, tmp_path / "features", MECHANISM)
    split, out = Split(lambda experiments: [Fold("few", FOLDS["few"], OTHERS)]), tmp_path / "fits"
    family.train(None, None, split, {"repeats": 1}, None, "cpu", 0, out)
    one, two = (recipe.read(out / name) for name, recipe in recipes.items())
    assert one.ensemble.members == 1 and two.ensemble.members == 2
    tables = family.evaluate(None, None, out, split)
    assert set(tables) == {"runs", "repeats", "examples"}
    assert tables["runs"].groupby("model").size().to_dict() == {"a": len(OTHERS), "b": len(OTHERS)}


def test_the_same_window_is_asked_for() -> None:
    with pytest.raises(BadInput, match="samples must be the same of bounce and network, got 50 and 100"):
        replace(HYBRID, bounce=replace(BOUNCE, samples=50))


@pytest.mark.parametrize("change", [{"members": 0}, {"samples": 0}, {"reach": -1}, {"spread": -0.1}])
def test_impossible_ensembles_are_refused(change: dict[str, float]) -> None:
    with pytest.raises(BadInput, match="bounce: members and samples must be positive"):
        Ensemble(**{"members": 1, "spread": 0.1, "reach": 2, "samples": 10, **change})  # type: ignore[arg-type]


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
