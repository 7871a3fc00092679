"""A law takes the place of a simpler one that it contains, and begins from the numbers of the simpler one."""

from __future__ import annotations

import pytest

from tests.diagnosis.benches import Bench
from tests.diagnosis.studies import JOINT, TORQUE, effect, study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.diagnosis.search.containing import Containing, containing
from unmodelled.diagnosis.search.effect_search import EffectSearch
from unmodelled.diagnosis.search.screen import Screened


@pytest.fixture(scope="module")
def screened(tmp_path_factory: pytest.TempPathFactory) -> list[Screened]:
    """All effects on top of a pendulum with the dry friction that it has."""
    folder = tmp_path_factory.mktemp("pendulum")
    search = EffectSearch(study(folder, Bench(friction=0.06)))
    dry = Hypothesis.known(search.study).plus(effect("coulomb_friction"), JOINT)
    return search.screen(FittedHypothesis.of(dry, search.fitted))


def test_what_contains_friction_takes_its_place(screened: list[Screened]) -> None:
    found = [one for one in containing(screened) if isinstance(one, Containing)]
    families = {(one.effect.family, one.effect.variant) for one in found}
    assert ("stribeck_friction", "") in families
    assert ("position_dependent_friction", "along_travel") in families
    assert not families & {("viscous_friction", ""), ("quadratic_drag", ""), ("constant_load", "")}
    for one in found:
        (law,) = one.hypothesis.effects
        assert (law.family, law.place) == (one.effect.family, JOINT)


def test_it_begins_where_the_simpler_law_ended(screened: list[Screened]) -> None:
    """Free runs of every start are those of the simpler law, but for the little that the screen adds."""
    found = [one for one in containing(screened) if isinstance(one, Containing)]
    base = found[0].base
    ended = _unfitted(base.hypothesis, base, base.fit.every)
    for one in found:
        assert len(one.starts) == len(one.screened.tries)
        for start in one.starts:
            assert _unfitted(one.hypothesis, base, start) < 1.1 * ended


def _unfitted(hypothesis: Hypothesis, base: FittedHypothesis, start: Start) -> float:
    """Deviation before a fit."""
    return FittedHypothesis.of(hypothesis, base.recording, [start], iterations=0).fit.left.value


def test_other_places_and_laws_with_memory_stay_beside_it(screened: list[Screened]) -> None:
    found = {(one.effect.family, one.place) for one in containing(screened) if isinstance(one, Containing)}
    assert {place for _, place in found} == {JOINT}
    assert ("hysteresis", JOINT) not in found and ("actuator_gain", TORQUE) not in found
