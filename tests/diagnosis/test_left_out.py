"""Predictions of left-out experiments are those of fits without these experiments."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import t as student

from tests.diagnosis.benches import FRICTION, Bench
from tests.diagnosis.studies import JOINT, effect, fitted, shared_study, study
from tests.machines.folders import Array
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting import left_out
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.jackknife import interval
from unmodelled.diagnosis.fitting.left_out import FEWEST_PARTS, LeftOut, parts
from unmodelled.diagnosis.search.candidates import Candidates
from unmodelled.effects.place import Place

#: Eight experiments, of which two are held out: each of the others is a part.
BENCH = Bench(runs=8, samples=300)
#: Friction, N m, of every experiment, in no order; the mean is 0.065 N m.
FRICTIONS = (0.03, 0.09, 0.05, 0.08, 0.04, 0.1, 0.06, 0.07)
#: Friction, N m, that differs by less than half of its mean of 0.065 N m.
SOMEWHAT = (0.04, 0.085, 0.055, 0.075, 0.05, 0.09, 0.06, 0.065)
#: Smallest difference of scores that matters, nats.
SMALL = 0.02
#: Experiments with the same friction, whose law the file has, and with a friction of its own in every one.
alike = shared_study(BENCH, *FRICTION)
varied = shared_study(replace(BENCH, friction=FRICTIONS), *FRICTION)


def halves(found: FittedHypothesis) -> LeftOut:
    """Every experiment predicted by halves, as the search does with numbers of single experiments."""
    return LeftOut.of(found, parts(found.recording, 2 * len(found.recording.runs)))


def entry(found: FittedHypothesis, name: str) -> int:
    """Where a shared number is in the vector."""
    k = [u.name for u in found.unknowns.each].index(name)
    (at,) = np.flatnonzero(found.unknowns.unknown == k)
    return int(at)


def refitted(found: FittedHypothesis) -> Array:
    """Vectors of fits without each experiment, shape (experiments, entries)."""
    runs = np.unique(found.recording.owner).tolist()
    values = []
    for run in runs:
        others = found.recording.among([r for r in runs if r != run])
        again = FittedHypothesis.of(found.hypothesis, others, [found.fit.values])
        values.append(again.vector(again.unknowns))
    return np.array(values)


@pytest.mark.parametrize("missing", [True, False], ids=["friction is an effect", "friction is known"])
def test_one_newton_step_is_as_good_as_a_fit_without_the_experiment(
    missing: bool, alike: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hypothesis = Hypothesis.known(alike)
    if missing:
        hypothesis = Hypothesis.known(study(tmp_path, BENCH)).plus(effect("coulomb_friction"), JOINT)
    found = LeftOut.of(fitted(hypothesis))
    assert len(found.values) == len(found.fitted.recording.runs) == FEWEST_PARTS
    expected = refitted(found.fitted)
    reach = np.ptp(expected, axis=0)
    assert (np.abs(found.values - expected).max(0) < 0.2 * reach + 1e-6).all()
    with monkeypatch.context() as patch:
        patch.setattr(left_out, "_values", lambda *_: expected)
        true = LeftOut.of(found.fitted)
    np.testing.assert_allclose(found.score(), true.score(), atol=SMALL)


@pytest.mark.long
@pytest.mark.parametrize(
    "laws",
    [
        (("viscous_friction", "shear_thinning"), ("stribeck_friction", "")),
        (("stribeck_friction", ""), ("coulomb_friction", "gradual")),
    ],
)
def test_similar_laws_do_not_move_apart(
    laws: tuple[tuple[str, str], ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only the sum of two similar frictions is determined; an undamped step misjudged them by nats."""
    hypothesis = Hypothesis.known(study(tmp_path, replace(BENCH, friction=FRICTIONS)))
    for family, variant in laws:
        hypothesis = hypothesis.plus(effect(family, variant), JOINT)
    found = LeftOut.of(fitted(hypothesis))
    expected = refitted(found.fitted)
    with monkeypatch.context() as patch:
        patch.setattr(left_out, "LEAST_DAMPING", 1e-5)
        undamped = LeftOut.of(found.fitted).score().mean()
    monkeypatch.setattr(left_out, "_values", lambda *_: expected)
    true = LeftOut.of(found.fitted).score().mean()
    assert abs(found.score().mean() - true) < 0.25 < 1.0 < undamped - true


def test_a_prediction_is_worse_than_the_fit_and_near_the_noise(alike: Study) -> None:
    """ln 2 is the score of errors that are as large as the noise."""
    found = LeftOut.of(fitted(Hypothesis.known(alike)))
    whole = replace(found, squares=found.squares[1:].repeat(2, axis=0))
    assert np.log(1.5) < whole.score().mean() < np.log(2.5)
    recording, r = found.fitted.recording, found.fitted.errors[0]
    for k, run in enumerate(np.unique(recording.owner)):
        mine = recording.owner == run
        inside = np.log1p(np.sum(r[mine] ** 2) / recording.counted[mine].sum())
        assert whole.score()[k] > inside


def test_parts_are_experiments_or_contiguous_blocks_of_few(alike: Study) -> None:
    recording = alike.recording
    assert len(np.unique(parts(recording))) == len(recording.runs)
    few = recording.among(list(recording.runs)[:2])
    part = parts(few)
    assert sorted(set(part.tolist())) == list(range(FEWEST_PARTS))
    for run in np.unique(few.owner):
        mine = part[few.owner == run][np.argsort(few.start[few.owner == run])]
        assert (np.diff(mine) >= 0).all() and len(np.unique(mine)) == FEWEST_PARTS // 2
    assert not set(part[few.owner == few.owner[0]]) & set(part[few.owner != few.owner[0]])


@pytest.fixture(scope="module")
def one_rubs(tmp_path_factory: pytest.TempPathFactory) -> FittedHypothesis:
    """Of the experiments with friction, one is left."""
    groups = tuple("abaaabaa")
    rubs = tuple(0.1 * (name == "b") for name in groups)
    found = study(tmp_path_factory.mktemp("level"), replace(BENCH, groups=groups, friction=rubs))
    recording = found.recording
    learned = [k for k, name in enumerate(groups) if name == "b" and k not in found.held_out]
    one = recording.among([r for r in recording.runs if r not in learned[1:]])
    place = replace(JOINT, factor="group", level="b")
    return FittedHypothesis.of(Hypothesis.known(found).plus(effect("coulomb_friction"), place), one)


def test_an_amplitude_that_only_one_experiment_knows_is_zero_without_it(one_rubs: FittedHypothesis) -> None:
    runs, part = np.unique(one_rubs.recording.owner, return_inverse=True)
    prediction, at = LeftOut.of(one_rubs, part), entry(one_rubs, "F_c")
    table = one_rubs.hypothesis.study.logs.experiments
    (mine,) = np.flatnonzero(table["group"].to_numpy()[runs] == "b")
    assert prediction.values[mine, at] == 0.0
    assert (np.delete(prediction.values[:, at], mine) > 0.0).all()


def test_an_effect_that_only_one_experiment_shows_is_predicted_block_by_block(
    one_rubs: FittedHypothesis,
) -> None:
    prediction = LeftOut.of(one_rubs)
    count = len(np.unique(one_rubs.recording.owner))
    assert len(prediction.values) == count - 1 + FEWEST_PARTS
    assert (prediction.values[:, entry(one_rubs, "F_c")] > 0.0).all()
    base = LeftOut.of(FittedHypothesis.of(Hypothesis.known(one_rubs.hypothesis.study), one_rubs.recording))
    assert Candidates((base, prediction)).named() == 1
    # the other experiments do not see the end stop of one
    table, recording = one_rubs.hypothesis.study.logs.experiments, one_rubs.recording
    rubs = (table["group"] == "b").to_numpy()[recording.owner]
    alone = replace(base, squares=np.where(rubs[:, None], base.squares, prediction.squares))
    gain = Candidates((alone, prediction)).gain(0, 1)
    assert gain.chance == 0.5**FEWEST_PARTS and gain.mean > 1.0


@pytest.fixture(scope="module")
def scattered(tmp_path_factory: pytest.TempPathFactory) -> LeftOut:
    bench = replace(BENCH, friction=SOMEWHAT)
    known = Hypothesis.known(study(tmp_path_factory.mktemp("scattered"), bench, *FRICTION))
    return halves(fitted(known.plus(effect("scatter"), Place("parameter", "F_c"))))


def test_a_shared_number_is_known_as_well_as_the_mean_of_the_experiments_own_ones(scattered: LeftOut) -> None:
    """Six experiments know the mean friction of the machine within 2.57 standard errors of six numbers."""
    learned = np.array(SOMEWHAT)[np.unique(scattered.fitted.recording.owner)]
    error = learned.std(ddof=1) / np.sqrt(len(learned))
    low, high = interval(scattered, "F_c", 0.95)
    assert low < np.mean(SOMEWHAT) < high
    assert 0.5 * (high - low) == pytest.approx(student.ppf(0.975, len(learned) - 1) * error, rel=0.2)


def test_numbers_of_single_experiments_are_predicted_from_the_other_half(scattered: LeftOut) -> None:
    """The friction of an experiment is known from either half, and the other experiments do not tell it."""
    found = scattered.fitted
    unknowns, owner = found.unknowns, found.recording.owner
    (own,) = (k for k, u in enumerate(unknowns.each) if u.own)
    shared = entry(found, "F_c")
    part_of = {int(k): int(owner[scattered.part == k][0]) for k in np.unique(scattered.part)}
    assert len(part_of) == 2 * len(found.recording.runs)
    for part, run in part_of.items():
        (mine,) = np.unique(unknowns.entry[owner == run][:, own])
        values = scattered.values[part] * unknowns.scale
        assert values[shared] * (1.0 + values[mine]) == pytest.approx(SOMEWHAT[run], rel=0.1)
        whole = found.vector(unknowns) * unknowns.scale
        assert values[mine] != whole[mine]
    score = LeftOut.of(fitted(Hypothesis.known(found.hypothesis.study))).score()
    assert scattered.score().mean() < score.mean() - 1.0


def test_the_jackknife_interval_covers_the_truth_and_the_variation_between_runs(
    alike: Study, varied: Study
) -> None:
    same, other = (LeftOut.of(fitted(Hypothesis.known(each))) for each in (alike, varied))
    (low, high), (wide_low, wide_high) = (interval(each, "F_c", 0.95) for each in (same, other))
    assert low < 0.06 < high and high - low < 0.1 * 0.06
    learned = [FRICTIONS[run] for run in other.fitted.recording.runs]
    assert wide_low < np.mean(learned) < wide_high
    assert wide_high - wide_low > 5.0 * (high - low)
    assert wide_high - wide_low > np.std(learned)
    narrow = interval(same, "F_c", 0.5)
    assert low < narrow[0] < narrow[1] < high


def test_an_interval_is_cut_at_the_bounds(varied: Study) -> None:
    found = LeftOut.of(fitted(Hypothesis.known(varied)))
    assert interval(found, "F_c", 1.0 - 1e-9) == (0.0, 1.0)


def test_halves_of_an_experiment_are_not_two_experiments(scattered: LeftOut) -> None:
    """The interval of a shared number does not depend on how experiments are divided."""
    by_halves, by_runs = (interval(each, "b", 0.95) for each in (scattered, LeftOut.of(scattered.fitted)))
    assert by_halves == pytest.approx(by_runs, rel=0.02)
