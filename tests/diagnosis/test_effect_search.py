"""A search that fits what linear systems rank finds what was planted."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.diagnosis.benches import Bench
from tests.diagnosis.planted import plant
from tests.diagnosis.studies import JOINT, TORQUE, effect, study
from tests.machines.folders import read_case
from unmodelled.diagnosis.answer.diagnose import diagnose_gap
from unmodelled.diagnosis.core import columns
from unmodelled.diagnosis.data.thresholds import Thresholds
from unmodelled.diagnosis.search.effect_search import EffectSearch
from unmodelled.effects.library import effects
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
    (found,) = candidates.fits[candidates.named()].hypothesis.effects
    assert (found.family, found.place) == (family, place)


#: Families of friction, which are the only ones that the next test compares.
FRICTION = ("viscous_friction", "coulomb_friction", "stribeck_friction", "hysteresis")


@pytest.mark.long
@pytest.mark.parametrize(("back", "exponent"), [(0.9, 3.0), (0.2, 1.5)])
def test_a_loop_of_another_shape_is_hysteresis(
    back: float, exponent: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant(tmp_path, effect("hysteresis", "bouc_wen"), numbers={"b_h": back, "n_h": exponent, "x_h": 0.1})
    monkeypatch.setattr(columns, "effects", lambda: tuple(e for e in effects() if e.family in FRICTION))
    # a loop of the fixed shape predicts nearly as well, and is named where complexity has its price
    cheap = Thresholds(material_share=0.005)
    found = diagnose_gap(*read_case(tmp_path), 0.2, 0, 1, thresholds=cheap)
    (named,) = found.effects
    assert (named.added.family, named.added.variant) == ("hysteresis", "bouc_wen")
    assert named.estimates["F_h"].value == pytest.approx(0.15, rel=0.05)
    assert named.estimates["x_h"].value == pytest.approx(0.1, rel=0.1)
    assert named.estimates["b_h"].value == pytest.approx(back, abs=0.1)
    assert named.estimates["n_h"].value == pytest.approx(exponent, rel=0.15)
