"""Which of some fitted candidates is named, and what is said to be indistinguishable from it."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.diagnosis.benches import FRICTION, Bench
from tests.diagnosis.studies import ANGLE, JOINT, TORQUE, effect, fitted, study
from unmodelled.diagnosis.answer import confirmed as module
from unmodelled.diagnosis.core.comparison import Comparison
from unmodelled.diagnosis.data.gap import Gap
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.data.thresholds import Thresholds
from unmodelled.diagnosis.decide.decision import Decision, decide, indistinguishable
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.judged_models import judged_model
from unmodelled.diagnosis.fitting.left_out import FEWEST_PARTS, LeftOut
from unmodelled.diagnosis.search.candidates import Candidates
from unmodelled.diagnosis.search.discovered import DiscoveredLaw
from unmodelled.diagnosis.search.network import fit_network
from unmodelled.effects.place import Place

#: Nothing is immaterial.
ANY_AMOUNT = {"material_share": 1e-9, "further_rest": 1e-9, "material_rest": 1e-9}
NOTHING_MATERIAL = {"material_share": 10.0, "further_rest": 1e-9, "material_rest": 0.999}
#: No chance is excluded.
ANY_CHANCE = {"level": 1e-9}


def compared(hypotheses: Sequence[Hypothesis]) -> Candidates:
    """Fitted to all windows; with numbers of single experiments, experiments are predicted by halves."""
    fits = [fitted(hypothesis) for hypothesis in hypotheses]
    return Candidates(tuple(LeftOut.of(fit) for fit in fits))


def candidates(found: Study) -> Candidates:
    """The known physics; dry friction; a load; a gain; friction and gain."""
    known = Hypothesis.known(found)
    friction = known.plus(effect("coulomb_friction"), JOINT)
    load, gain = known.plus(effect("constant_load"), JOINT), known.plus(effect("sensor_gain"), ANGLE)
    return compared([known, friction, load, gain, friction.plus(effect("sensor_gain"), ANGLE)])


def decided(found: Candidates) -> Decision:
    """With the network beside the named candidate."""
    named = found.fits[found.named()]
    network = fit_network(named, named.recording, 0)
    gap, before = (judged_model("", f).gap for f in (named, found.fits[0]))
    return decide(found, found.named(), beside(found, found.named(), network), gap, before)


def beside(found: Candidates, named: int, network: FittedHypothesis) -> Candidates:
    alike = (found.predictions[0], found.predictions[named], LeftOut.of(network))
    return replace(found, predictions=alike)


def limited(found: Candidates, **limits: float) -> Candidates:
    return replace(found, thresholds=Thresholds(**limits))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def rubbing(tmp_path_factory: pytest.TempPathFactory) -> Candidates:
    return candidates(study(tmp_path_factory.mktemp("rubbing"), Bench(samples=400)))


@pytest.fixture(scope="module")
def flawless(tmp_path_factory: pytest.TempPathFactory) -> Candidates:
    return candidates(study(tmp_path_factory.mktemp("flawless"), Bench(samples=400, friction=0.0)))


def test_a_comparison_counts_the_changes_of_signs_that_do_as_well() -> None:
    """Of the 64 changes of six signs, one does as well as all gains, and two with one small loss."""
    gains = np.array([0.4, 0.9, 0.1, 0.6, 0.3, 0.7])
    found = Comparison.of(gains)
    assert found.mean == pytest.approx(0.5)
    assert found.chance == 1.0 / 64.0
    assert found.error == pytest.approx(gains.std(ddof=1) / np.sqrt(6.0))
    assert found.is_significant(0.95) and not Comparison.of(-gains).is_significant(0.95)
    with_loss = Comparison.of(np.append(gains[:-1], -0.05))
    assert with_loss.chance == 2.0 / 64.0
    assert with_loss.is_significant(0.95) and not with_loss.is_significant(0.97)
    assert Comparison.of(gains[:1]).chance == 0.5


def test_a_law_that_acts_in_few_parts_is_better_beyond_chance() -> None:
    """Two large gains and six small ones: the mean is less than two standard errors."""
    gains = np.array([13.0, 18.0, 0.3, 0.1, 0.4, 0.2, 0.1, 0.3])
    found = Comparison.of(gains)
    assert found.mean < 2.0 * found.error and found.chance == 2.0**-8 and found.is_significant(0.95)


@pytest.mark.parametrize("parts", [8, 20])
def test_differences_by_chance_are_significant_in_one_case_of_twenty(parts: int) -> None:
    drawn = np.random.default_rng(0).standard_normal((2000, parts))
    share = np.mean([Comparison.of(gains).is_significant(0.95) for gains in drawn])
    assert share == pytest.approx(0.05, abs=0.015)


def test_the_planted_effect_is_named_and_no_further_one(rubbing: Candidates) -> None:
    assert rubbing.named() == 1
    assert rubbing.promising(1)[0] == 1 and rubbing.promising(2) == [4] and rubbing.promising(0) == [0]
    assert rubbing.beats(1, 0) and not rubbing.beats(4, 1) and not rubbing.beats(1, 4)
    found = decided(rubbing)
    assert (found.verdict, found.named, found.remainder) == ("effect", 1, None)
    assert found.indistinguishable == {0: ()}


def test_nothing_is_named_where_nothing_is_missing(flawless: Candidates) -> None:
    assert flawless.named() == 0
    assert not any(flawless.beats(k, 0) for k in range(1, 5))
    found = decided(flawless)
    assert (found.verdict, found.named, found.remainder) == ("no_gap", 0, None)
    assert found.indistinguishable == {}


def test_a_candidate_must_be_better_by_more_than_chance_and_by_a_material_amount(
    rubbing: Candidates, flawless: Candidates
) -> None:
    gain = rubbing.gain(0, 1)
    assert gain.is_significant(0.95) and not gain.is_significant(1.0 - 1e-12)
    assert not limited(rubbing, level=1.0 - 1e-12).beats(1, 0)
    removed = 1.0 - rubbing.remaining[1]
    for share, beats in ((0.99 * removed, True), (1.01 * removed, False)):
        assert limited(rubbing, material_share=share, further_rest=1e-9).beats(1, 0) == beats
    # what remains beside the effect is chance, and a better score alone is no reason to name more
    assert limited(rubbing, **ANY_AMOUNT).named() == 1 and limited(flawless, **ANY_AMOUNT).named() == 0
    assert limited(rubbing, **ANY_CHANCE).named() == 1 and limited(flawless, **ANY_CHANCE).named() == 0


def test_an_error_that_matters_to_no_one_is_no_reason_to_name_an_effect(rubbing: Candidates) -> None:
    """However much of the known physics' error it is: sensors of little noise show more than anyone needs."""
    known, friction = (np.exp(rubbing.predictions[k].scores()) for k in (0, 1))
    recording = rubbing.fits[0].recording
    unit = float((recording.noise / recording.scale)[0]) / rubbing.persistence
    removed = unit * float(np.sqrt((known - friction).max()))
    for error, beats in ((0.9 * removed, True), (1.1 * removed, False)):
        assert limited(rubbing, negligible_error=error).beats(1, 0) == beats
    assert limited(rubbing, negligible_error=1.1 * removed).named() == 0


def test_one_more_effect_must_remove_more_than_another_effect_in_its_place(rubbing: Candidates) -> None:
    """The same difference is enough for an exchange and too little for one more effect."""
    removed = float(1.0 - rubbing.remaining[1] / rubbing.remaining[2])
    limits = {"material_share": 10.0, "material_rest": 0.9 * removed, "further_rest": 1e-9}
    found = limited(rubbing, **limits)
    assert found.beats(1, 2) and not found.beats(1, 0) and not found.beats(4, 2)


def test_what_beats_another_candidate_has_the_lower_error(rubbing: Candidates) -> None:
    """So that the best candidate is never beaten, and a candidate to name always exists."""
    count = len(rubbing.fits)
    for one in range(count):
        assert not rubbing.beats(one, one)
        for other in range(count):
            if rubbing.beats(one, other):
                assert rubbing.remaining[one] < rubbing.remaining[other]
                assert not rubbing.beats(other, one)


LOCAL = Bench(runs=8, samples=300, groups=tuple("aababaab"))


@pytest.mark.parametrize(
    ("level", "everywhere", "named"), [(0.2, 0.0, "local"), (0.06, 0.06, "global"), (0.2, 0.06, "both")]
)
def test_an_effect_at_one_level_and_its_twin_in_all_experiments(
    level: float, everywhere: float, named: str, tmp_path: Path
) -> None:
    """In one group only, everywhere, or everywhere and more in one group."""
    friction = tuple(level if group == "b" else everywhere for group in LOCAL.groups)
    found = study(tmp_path, replace(LOCAL, friction=friction))
    known, law = Hypothesis.known(found), effect("coulomb_friction")
    at_b = replace(JOINT, factor="group", level="b")
    wide = known.plus(law, JOINT)
    among = {"known": known, "global": wide, "local": known.plus(law, at_b), "both": wide.plus(law, at_b)}
    assert list(among)[compared(list(among.values())).named()] == named


@pytest.mark.long
def test_numbers_of_single_experiments_are_named_only_if_they_beat_the_best_law(tmp_path: Path) -> None:
    scatter, bench = effect("scatter"), replace(LOCAL, groups=())
    # a law is missing: scatter of a parameter absorbs a part of it, and is not named beside it
    plain = Hypothesis.known(study(tmp_path / "law", bench))
    law = plain.plus(effect("coulomb_friction"), JOINT)
    damping = Place("parameter", "b")
    found = compared([plain, law, plain.plus(scatter, damping), law.plus(scatter, damping)])
    assert found.own.tolist() == [0, 0, 1, 1] and found.named() == 1
    # the friction differs from experiment to experiment: no law of the library says so
    varied = replace(bench, friction=(0.03, 0.09, 0.05, 0.08, 0.04, 0.1, 0.06, 0.07))
    known = Hypothesis.known(study(tmp_path / "scatter", varied, *FRICTION))
    friction = Place("parameter", "F_c")
    found = compared([known, known.plus(scatter, friction), known.plus(effect("constant_load"), JOINT)])
    assert found.own.tolist() == [0, 1, 0] and found.named() == 1
    # they must remove a share of what is left, whatever it is of the known physics' error
    assert limited(found, material_share=1e-9, further_rest=0.99).named() == 0
    # and no number of an experiment is named where all have the same friction
    same = Hypothesis.known(study(tmp_path / "same", bench, *FRICTION))
    assert compared([same, same.plus(scatter, friction)]).named() == 0


@pytest.fixture(scope="module")
def biased(tmp_path_factory: pytest.TempPathFactory) -> Candidates:
    """A load on the joint and an offset of the torque are one and the same, also beside friction."""
    found = study(tmp_path_factory.mktemp("biased"), Bench(samples=400))
    found = replace(found, logs=replace(found.logs, u=found.logs.u + 0.05))
    known = Hypothesis.known(found)
    friction = known.plus(effect("coulomb_friction"), JOINT)
    offset, load = known.plus(effect("actuator_offset"), TORQUE), effect("constant_load")
    both = friction.plus(load, JOINT), offset.plus(effect("coulomb_friction"), JOINT)
    return compared([known, friction, known.plus(load, JOINT), offset, *both])


def test_complexity_has_a_price_unless_what_is_left_is_explained(biased: Candidates) -> None:
    """The offset beside dry friction removes nearly all that is left above the noise."""
    removed, more = (float(v[1] - v[4]) for v in (biased.remaining, -biased.complexity))
    rest, after = (np.sqrt(np.exp(biased.scores[k].mean()) - 2.0) for k in (1, 4))
    left = float(after / rest)
    assert 0.0 < left < 0.2
    for share, beats in ((0.99 * removed / more, True), (1.01 * removed / more, False)):
        assert limited(biased, material_share=share, further_rest=1e-9).beats(4, 1) == beats
    for share, beats in ((1.01 * left, True), (0.99 * left, False)):
        assert limited(biased, material_share=10.0, further_rest=share).beats(4, 1) == beats
    assert limited(biased, material_share=10.0, further_rest=1e-9).is_material(4, 1, priced=False)


def test_a_formula_is_named_only_if_it_beats_the_laws_of_the_library(tmp_path: Path) -> None:
    """Gravity is missing: the formula predicts as well as the law."""
    without = [
        ("- mgl*sin(theta) - tau", "- tau"),
        ("  mgl: {value: 0.9, unit: N m, identify: true, bounds: [0.2, 5]}\n", ""),
    ]
    known = Hypothesis.known(study(tmp_path, Bench(samples=400), *without))
    formula, law = known.plus(DiscoveredLaw.named("sin(x)"), JOINT), known.plus(effect("gravity_load"), JOINT)
    found = compared([known, formula, law])
    assert found.beats(1, 0) and not found.beats(1, 2)
    assert found.named() == 2
    assert compared([known, formula, known.plus(effect("linear_spring"), JOINT)]).named() == 1


def test_what_these_data_cannot_tell_is_said(biased: Candidates) -> None:
    """What stands for one of two effects stands beside the other, whichever was added first."""
    assert biased.named() in (4, 5)
    first, second = (indistinguishable(biased, named) for named in (4, 5))
    assert {k: [e.family for e in es] for k, es in first.items()} == {0: [], 1: ["actuator_offset"]}
    assert {k: [e.family for e in es] for k, es in second.items()} == {0: ["constant_load"], 1: []}


@pytest.mark.parametrize(
    ("doubts", "refuses", "number"),
    [
        ({4: ["constant_load"], 5: []}, False, 5),
        ({4: ["constant_load"], 5: []}, True, 4),  # by the held-out experiments
        ({4: ["constant_load"], 5: ["actuator_offset"]}, False, 4),
        ({4: ["coulomb_friction"], 5: []}, False, 4),  # which has no equal
        ({4: [], 5: []}, False, 4),
    ],
)
def test_of_equals_the_one_without_doubtful_numbers_is_named(
    biased: Candidates,
    doubts: dict[int, list[str]],
    refuses: bool,
    number: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The class of effects that the logs cannot tell apart stays as it is."""

    def doubtful(found: Candidates, k: int) -> set[object]:
        return {e.key for e in found.fits[k].hypothesis.effects if e.family in doubts[k]}

    monkeypatch.setattr(module, "doubtful", doubtful)
    monkeypatch.setattr(module, "is_confirmed", lambda *_: not refuses)
    search: Any = SimpleNamespace(candidates=biased)
    chosen = module._less_doubtful(search, biased.fits[4], Gap.__new__(Gap))
    assert chosen is biased.fits[number]
    others = indistinguishable(biased, 4, number)
    classes = ({e.family, *(o.family for o in others[k])} for k, e in enumerate(chosen.hypothesis.effects))
    assert {frozenset(each) for each in classes} == {
        frozenset({"coulomb_friction"}),
        frozenset({"constant_load", "actuator_offset"}),
    }


def test_no_data_speak_against_what_is_alike(biased: Candidates, rubbing: Candidates) -> None:
    """What the named candidate does not beat, and is no more complex."""
    for found in (biased, rubbing):
        for i in range(len(found.fits)):
            beaten = [found.beats(i, j, priced=False) for j in range(len(found.fits))]
            simple = (found.complexity < found.complexity[i] + 1.0) | (found.numbers <= found.numbers[i])
            alike = [found.alike(i, j) for j in range(len(found.fits))]
            assert alike == (simple & ~np.array(beaten)).tolist() and alike[i]
    assert biased.alike(4, 5) and biased.alike(5, 4) and not biased.alike(0, 4) and not rubbing.alike(0, 1)
    # friction predicts as well as friction with a gain: the simpler one is alike, the more complex one is not
    assert rubbing.alike(4, 1) and not rubbing.alike(1, 4)
    assert indistinguishable(limited(biased, most_equal=0), 4) == {0: (), 1: ()}


@pytest.mark.parametrize(
    ("friction", "dead_zone", "verdict"), [(0.2, 0.05, "main_effect"), (0.0, 0.2, "unknown")]
)
def test_what_only_a_network_predicts_is_a_remainder(
    friction: float, dead_zone: float, verdict: str, tmp_path: Path
) -> None:
    """Dead zone of the torque beside friction or alone, of which no candidate is among the fitted ones."""
    bench = Bench(samples=400, dead_zone=dead_zone, friction=friction)
    found = study(tmp_path, bench)
    known = Hypothesis.known(found)
    law = known.plus(effect("coulomb_friction"), JOINT)
    said = decided(compared([known, law, known.plus(effect("constant_load"), JOINT)]))
    assert said.verdict == verdict and said.remainder is not None
    assert 0.0 < said.remainder.predictable <= said.remainder.share <= 1.0


def test_a_single_learned_experiment_is_divided(rubbing: Candidates) -> None:
    one = rubbing.fits[0].recording.among([rubbing.fits[0].recording.runs[0]])
    known = rubbing.fits[0].hypothesis
    friction = known.plus(effect("coulomb_friction"), JOINT)
    fits = [FittedHypothesis.of(hypothesis, one) for hypothesis in (known, friction)]
    alone = Candidates(tuple(LeftOut.of(fit) for fit in fits))
    assert alone.scores.shape == (2, FEWEST_PARTS)
    assert alone.named() == 1 and indistinguishable(alone, 1) == {0: ()}


@pytest.mark.parametrize(
    "limits", [{"level": 1.0 - 1e-12}, NOTHING_MATERIAL], ids=["all is chance", "nothing is material"]
)
def test_thresholds_decide(rubbing: Candidates, limits: dict[str, float]) -> None:
    for gap, verdict in ((1e9, "no_gap"), (1e-9, "unknown")):
        found = decided(limited(rubbing, **limits, unexplained_gap=gap))
        assert (found.verdict, found.named) == (verdict, 0)


@pytest.mark.parametrize(("named", "verdicts"), [(0, ("no_gap", "unknown")), (1, ("effect", "main_effect"))])
def test_a_gap_of_held_out_experiments_that_nothing_predicts_says_that_something_remains(
    flawless: Candidates, named: int, verdicts: tuple[str, str]
) -> None:
    chosen = flawless.fits[named]
    gap, network = judged_model("", chosen).gap, beside(flawless, named, chosen)
    before = replace(gap, value=1.0)
    most = flawless.thresholds.unexplained_gap * flawless.persistence
    for value, verdict in zip((gap.value, 2.0 * most), verdicts, strict=True):
        found = decide(flawless, named, network, replace(gap, value=value), before)
        assert found.verdict == verdict
        assert (found.remainder is None) == (value == gap.value)
        assert found.remainder is None or found.remainder.predictable == 0.0


@pytest.mark.parametrize(("named", "verdict"), [(1, "effect"), (2, "main_effect")], ids=["friction", "load"])
def test_an_effect_that_leaves_most_of_the_gap_does_not_explain_it(
    rubbing: Candidates, named: int, verdict: str
) -> None:
    found = limited(rubbing, unexplained_gap=1e9)
    chosen = found.fits[named]
    gap, before = (judged_model("", f).gap for f in (chosen, found.fits[0]))
    said = decide(found, named, beside(found, named, chosen), gap, before)
    assert said.verdict == verdict
