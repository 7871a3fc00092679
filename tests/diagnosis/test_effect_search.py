"""A search that fits what linear systems rank finds what was planted."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.benches import Bench
from tests.diagnosis.studies import JOINT, TORQUE, study
from unmodelled.diagnosis.fitting.hypothesis import Hypothesis
from unmodelled.diagnosis.fitting.unknowns import Unknowns
from unmodelled.diagnosis.search.effect_search import EffectSearch
from unmodelled.diagnosis.search.proposal import Proposal
from unmodelled.effects.place import Place

#: A column of experiments.csv with a level that holds for both kinds of runs.
GROUPS = ("new", "old", "new", "old", "new", "old")
IN_GROUP = Bench(runs=6, samples=300, groups=GROUPS, friction=tuple(0.06 * (g == "old") for g in GROUPS))
SUPPLY = Bench(runs=6, samples=300, friction=0.0, supply=(0.85, 1.1, 0.95, 1.2, 0.8, 1.05))


@pytest.mark.long
@pytest.mark.parametrize(
    ("bench", "family", "place"),
    [
        (IN_GROUP, "coulomb_friction", replace(JOINT, factor="group", level="old")),
        (SUPPLY, "scatter", TORQUE),
    ],
    ids=["friction in one group", "a supply that differs between runs"],
)
def test_what_was_planted_is_named(bench: Bench, family: str, place: Place, tmp_path: Path) -> None:
    candidates = EffectSearch(study(tmp_path, bench)).run()
    (effect,) = candidates.fits[candidates.named()].hypothesis.effects
    assert (effect.family, effect.place) == (family, place)


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
