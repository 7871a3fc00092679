"""Which of some fitted models is named, and what is said to be alike."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnosis.benches import Bench
from tests.diagnosis.studies import ANGLE, JOINT, TORQUE, effect, fitted, study
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.fitted import Fitted
from unmodelled.diagnosis.fitting.hypothesis import Hypothesis
from unmodelled.diagnosis.search.choose import AT_FLOOR, PARSIMONY, Scores, above_floor, explained


def scores(found: Study) -> Scores:
    """The known physics; dry friction; a load; a gain; friction and gain."""
    known = Hypothesis.known(found)
    friction = known.plus(effect("coulomb_friction"), JOINT)
    return Scores(
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
def rubbing(tmp_path_factory: pytest.TempPathFactory) -> Scores:
    return scores(study(tmp_path_factory.mktemp("rubbing"), Bench(samples=400)))


@pytest.fixture(scope="module")
def flawless(tmp_path_factory: pytest.TempPathFactory) -> Scores:
    return scores(study(tmp_path_factory.mktemp("flawless"), Bench(samples=400, friction=0.0)))


def test_losses_are_logarithms_of_likelihoods_on_a_common_scale(rubbing: Scores) -> None:
    assert rubbing.losses.shape == (5, 3) and (rubbing.losses > 0.0).all()
    true, count = rubbing.losses[1].sum(), rubbing.count
    assert count == rubbing.fits[0].recording.steps.sum()
    assert true == pytest.approx(0.5 * count, rel=0.15)
    assert rubbing.losses[0].sum() > true + 100.0
    assert rubbing.total == pytest.approx(
        rubbing.losses.sum(1) + PARSIMONY * count * np.array([f.hypothesis.complexity for f in rubbing.fits])
    )


def test_what_is_left_above_the_noise(rubbing: Scores, flawless: Scores) -> None:
    known, friction, *_ = rubbing.fits
    assert above_floor(known) > 1.0 and explained(known, friction) and not explained(known, known)
    assert abs(above_floor(friction)) < 2.0 * AT_FLOOR and abs(above_floor(flawless.fits[0])) < 2.0 * AT_FLOOR
    assert explained(flawless.fits[0], flawless.fits[0])


def test_the_planted_effect_is_named_and_no_further_one(rubbing: Scores) -> None:
    assert rubbing.chosen() == 1
    assert rubbing.ranked(1)[0] == 1 and rubbing.ranked(2) == [4] and rubbing.ranked(0) == [0]
    assert rubbing.pays(0, 1) and not rubbing.pays(1, 4)
    assert rubbing.alike(1) == {0: ()}


@pytest.mark.parametrize(("nearest", "named"), [(1.0, 4), (3e4, 1)], ids=["near the noise", "far from it"])
def test_complexity_pays_by_the_gap_where_no_model_comes_near_the_noise(
    rubbing: Scores, nearest: float, named: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = dict(zip(rubbing.fits, (1e6, 3.4e4, 5e5, 5e5, nearest), strict=True))
    monkeypatch.setattr("unmodelled.diagnosis.search.choose.above_floor", left.__getitem__)
    monkeypatch.setattr(Scores, "chosen", lambda self: 4)
    assert rubbing.named() == named


def test_nothing_is_named_where_nothing_is_missing(flawless: Scores) -> None:
    assert flawless.chosen() == 0
    assert not any(flawless.pays(0, k) for k in range(1, 4))
    assert flawless.alike(0) == {}


@pytest.fixture(scope="module")
def biased(tmp_path_factory: pytest.TempPathFactory) -> Scores:
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
    return Scores(tuple(fitted(hypothesis) for hypothesis in hypotheses))


def test_what_these_data_cannot_tell_is_said(biased: Scores) -> None:
    """What stands for one of two effects stands beside the other, whichever was added first."""
    assert biased.chosen() in (4, 5)
    told = [{k: [e.family for e in es] for k, es in biased.alike(named).items()} for named in (4, 5)]
    assert told == [{0: [], 1: ["actuator_offset"]}, {0: ["constant_load"], 1: []}]


def test_a_single_learned_experiment_has_no_spread(rubbing: Scores) -> None:
    """Losses of one experiment are compared as they are."""
    one = rubbing.fits[0].recording.among([rubbing.fits[0].recording.runs[0]])
    known = rubbing.fits[0].hypothesis
    friction = known.plus(effect("coulomb_friction"), JOINT)
    alone = Scores(tuple(Fitted.of(hypothesis, one) for hypothesis in (known, friction)))
    assert alone.losses.shape == (2, 1)
    assert alone.chosen() == 1 and alone.alike(1) == {0: ()}
