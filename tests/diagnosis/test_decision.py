"""Which of some fitted models is named, and what is said to be alike."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnosis.benches import Bench
from tests.diagnosis.studies import ANGLE, JOINT, TORQUE, effect, fitted, study
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.data.thresholds import DEFAULT_THRESHOLDS, Thresholds
from unmodelled.diagnosis.decide import decision
from unmodelled.diagnosis.decide.decision import (
    decide,
    gap_explained,
    indistinguishable,
    named_candidate,
)
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.search.candidates import Candidates, noise_ratio

#: The noise ratio of a true model, at most.
AT_FLOOR = DEFAULT_THRESHOLDS.at_floor


def candidates(found: Study) -> Candidates:
    """The known physics; dry friction; a load; a gain; friction and gain."""
    known = Hypothesis.known(found)
    friction = known.plus(effect("coulomb_friction"), JOINT)
    return Candidates(
        tuple(
            fitted(hypothesis)
            for hypothesis in (
                known,
                friction,
                known.plus(effect("constant_load"), JOINT),
                known.plus(effect("sensor_gain"), ANGLE),
                friction.plus(effect("sensor_gain"), ANGLE),
            )
        )
    )


@pytest.fixture(scope="module")
def rubbing(tmp_path_factory: pytest.TempPathFactory) -> Candidates:
    return candidates(study(tmp_path_factory.mktemp("rubbing"), Bench(samples=400)))


@pytest.fixture(scope="module")
def flawless(tmp_path_factory: pytest.TempPathFactory) -> Candidates:
    return candidates(study(tmp_path_factory.mktemp("flawless"), Bench(samples=400, friction=0.0)))


def test_losses_are_logarithms_of_likelihoods_on_a_common_scale(rubbing: Candidates) -> None:
    assert rubbing.losses.shape == (5, 3) and (rubbing.losses > 0.0).all()
    true, count = rubbing.losses[1].sum(), rubbing.count
    assert count == rubbing.fits[0].recording.steps.sum()
    assert true == pytest.approx(0.5 * count, rel=0.15)
    assert rubbing.losses[0].sum() > true + 100.0
    assert rubbing.penalised == pytest.approx(
        rubbing.losses.sum(1)
        + DEFAULT_THRESHOLDS.penalty * count * np.array([f.hypothesis.complexity for f in rubbing.fits])
    )


def test_what_is_left_above_the_noise(rubbing: Candidates, flawless: Candidates) -> None:
    known, friction, *_ = rubbing.fits
    assert noise_ratio(known) > 1.0 and gap_explained(known, friction) and not gap_explained(known, known)
    assert abs(noise_ratio(friction)) < 2.0 * AT_FLOOR and abs(noise_ratio(flawless.fits[0])) < 2.0 * AT_FLOOR
    assert gap_explained(flawless.fits[0], flawless.fits[0])


def test_the_planted_effect_is_named_and_no_further_one(rubbing: Candidates) -> None:
    assert rubbing.leading() == 1
    assert rubbing.ranked(1)[0] == 1 and rubbing.ranked(2) == [4] and rubbing.ranked(0) == [0]
    assert rubbing.pays(0, 1) and not rubbing.pays(1, 4)
    assert indistinguishable(rubbing, 1) == {0: ()}


@pytest.mark.parametrize(("nearest", "named"), [(1.0, 4), (3e4, 1)], ids=["near the noise", "far from it"])
def test_complexity_pays_by_the_gap_where_no_model_comes_near_the_noise(
    rubbing: Candidates, nearest: float, named: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = dict(zip(rubbing.fits, (1e6, 3.4e4, 5e5, 5e5, nearest), strict=True))
    monkeypatch.setattr(decision, "noise_ratio", left.__getitem__)
    monkeypatch.setattr(Candidates, "leading", lambda self: 4)
    assert named_candidate(rubbing) == named


def test_nothing_is_named_where_nothing_is_missing(flawless: Candidates) -> None:
    assert flawless.leading() == 0
    assert not any(flawless.pays(0, k) for k in range(1, 4))
    assert indistinguishable(flawless, 0) == {}


@pytest.fixture(scope="module")
def biased(tmp_path_factory: pytest.TempPathFactory) -> Candidates:
    """A load on the joint and an offset of the torque are one and the same, also beside friction."""
    found = study(tmp_path_factory.mktemp("biased"), Bench(samples=400))
    found = replace(found, logs=replace(found.logs, u=found.logs.u + 0.05))
    known = Hypothesis.known(found)
    friction = known.plus(effect("coulomb_friction"), JOINT)
    offset = known.plus(effect("actuator_offset"), TORQUE)
    hypotheses = (
        *(known, friction, known.plus(effect("constant_load"), JOINT), offset),
        friction.plus(effect("constant_load"), JOINT),
        offset.plus(effect("coulomb_friction"), JOINT),
    )
    return Candidates(tuple(fitted(hypothesis) for hypothesis in hypotheses))


def test_what_these_data_cannot_tell_is_said(biased: Candidates) -> None:
    """What stands for one of two effects stands beside the other, whichever was added first."""
    assert biased.leading() in (4, 5)
    told = [
        {k: [e.family for e in es] for k, es in indistinguishable(biased, named).items()} for named in (4, 5)
    ]
    assert told == [{0: [], 1: ["actuator_offset"]}, {0: ["constant_load"], 1: []}]


def test_a_single_learned_experiment_has_no_spread(rubbing: Candidates) -> None:
    """Losses of one experiment are compared as they are."""
    one = rubbing.fits[0].recording.among([rubbing.fits[0].recording.runs[0]])
    known = rubbing.fits[0].hypothesis
    friction = known.plus(effect("coulomb_friction"), JOINT)
    alone = Candidates(tuple(FittedHypothesis.of(hypothesis, one) for hypothesis in (known, friction)))
    assert alone.losses.shape == (2, 1)
    assert alone.leading() == 1 and indistinguishable(alone, 1) == {0: ()}


def test_a_decision_has_verdict_named_candidate_and_what_is_indistinguishable(
    rubbing: Candidates, flawless: Candidates
) -> None:
    found, nothing = decide(rubbing), decide(flawless)
    assert (found.verdict, found.named, found.indistinguishable) == ("effect", 1, {0: ()})
    assert (nothing.verdict, nothing.named, nothing.indistinguishable) == ("no_gap", 0, {})


@pytest.mark.parametrize(
    ("changed", "verdict", "named"),
    [
        ({}, "effect", 1),
        ({"significant_loss": 1e9}, "unknown", 0),
        ({"significant_loss": 1e9, "above_floor": 1e9}, "no_gap", 0),
        ({"above_floor": -1.0, "above_floor_share": -1.0}, "unknown", 1),
    ],
    ids=["default", "nothing is significant", "any error is noise", "no error is noise"],
)
def test_thresholds_decide(rubbing: Candidates, changed: dict[str, float], verdict: str, named: int) -> None:
    found = decide(replace(rubbing, thresholds=Thresholds(**changed)))  # type: ignore[arg-type]
    assert (found.verdict, found.named) == (verdict, named)
