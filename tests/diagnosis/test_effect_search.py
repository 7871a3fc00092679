"""A search that fits what linear systems rank finds what was planted."""

from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.benches import Bench
from tests.diagnosis.studies import study
from unmodelled.diagnosis.fitting.hypothesis import Hypothesis
from unmodelled.diagnosis.fitting.unknowns import Unknowns
from unmodelled.diagnosis.search.effect_search import EffectSearch
from unmodelled.diagnosis.search.proposal import Proposal

#: A column of experiments.csv with a level that holds for both kinds of runs.
GROUPS = ("new", "old", "new", "old", "new", "old")


def named(folder: Path, bench: Bench) -> tuple[EffectSearch, list[tuple[str, str]]]:
    search = EffectSearch(study(folder, bench))
    candidates = search.run()
    effects = candidates.fits[candidates.named()].hypothesis.effects
    return search, [(e.family, e.place.channel) for e in effects]


@pytest.mark.long
def test_what_was_planted_is_named(tmp_path: Path) -> None:
    """`test_diagnosed` has friction, friction with a gain, and nothing."""
    search, found = named(tmp_path, Bench(samples=400, friction=0.0, dead_zone=0.05))
    assert found == [("actuator_dead_zone", "actuator:torque")]
    assert search.around and frozenset() in search.around


@pytest.mark.long
def test_an_effect_in_one_group_is_named_there(tmp_path: Path) -> None:
    bench = Bench(runs=6, samples=300, groups=GROUPS, friction=tuple(0.06 * (g == "old") for g in GROUPS))
    search, _ = named(tmp_path, bench)
    candidates = search.candidates
    (effect,) = candidates.fits[candidates.named()].hypothesis.effects
    assert (effect.family, effect.place.factor, effect.place.level) == ("coulomb_friction", "group", "old")


@pytest.mark.long
def test_a_supply_that_differs_between_runs_is_scatter(tmp_path: Path) -> None:
    supply = (0.85, 1.1, 0.95, 1.2, 0.8, 1.05)
    _, found = named(tmp_path, Bench(runs=6, samples=300, friction=0.0, supply=supply))
    assert found == [("scatter", "actuator:torque")]


@pytest.fixture(scope="module")
def search(tmp_path_factory: pytest.TempPathFactory) -> EffectSearch:
    return EffectSearch(study(tmp_path_factory.mktemp("search"), Bench(samples=300, runs=3)))


def test_a_proposal_starts_at_its_linear_amounts(search: EffectSearch) -> None:
    chooser = search._chooser(search.base)
    best = chooser.singles[0]
    proposal = Proposal.of(search.base, chooser, best)
    (start, *_), (added,), atoms = proposal.starts, proposal.hypothesis.effects, proposal.atoms
    amounts = proposal.amounts[0] * atoms[0].scale
    assert proposal.key == Hypothesis.known(search.study).plus(atoms[0].effect, atoms[0].place).key
    np.testing.assert_allclose([start[name] for name in added.amplitudes], amounts)
    assert start["mgl"] == search.base.fit.values["mgl"]


def test_every_proposal_has_starts_within_bounds(search: EffectSearch) -> None:
    chooser = search._chooser(search.base)
    for one in chooser.singles:
        proposal = Proposal.of(search.base, chooser, one)
        unknowns = [u for u in proposal.hypothesis.unknowns if not u.own]
        for start in proposal.starts:
            assert {u.name for u in unknowns} <= set(start)
            vector = Unknowns(proposal.hypothesis.simulation(search.few), proposal.hypothesis.unknowns)
            assert np.isfinite(vector.vector(start)).all()


def test_fits_of_a_ripple_begin_at_several_numbers_per_turn(search: EffectSearch) -> None:
    chooser = search._chooser(search.base)
    ripple = next(one for one in chooser.singles if {name[0] for name in one.names} == {"torque_ripple"})
    every = [Proposal.of(search.base, chooser, one) for one in chooser.variants(ripple)]
    alike = [p.rough for p in every if p.key == every[0].key]
    assert len(alike) == len(set(alike)) == 2
