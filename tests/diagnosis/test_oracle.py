"""What can be found at best, on virtual machines with planted faults."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.rigs.withheld.campaign import write
from pipeline.rigs.withheld.cases import Case, Planted
from pipeline.withheld.oracle import Judged, Known, oracle
from pipeline.withheld.sparse_regression import Term, largest_term
from tests.machines.folders import read_case
from unmodelled.diagnosis.data.study import Study

COULOMB = Planted("coulomb_friction", "rail")


def study(folder: Path, *effects: Planted, level: float = 1.0) -> Study:
    """Of a hoist, logged for a second and a half a run."""
    case = Case("hoist", effects, level, 5)
    plan = case.plan()
    write(case, folder, replace(plan, samples=round(1.5 / plan.period)))
    return Study.of(*read_case(folder), 0.1, 0)


def known(*effects: Planted) -> list[Known]:
    return [Known(e.family, e.channel, e.factor, e.at) for e in effects]


def test_a_planted_effect_closes_the_gap(tmp_path: Path) -> None:
    found = oracle(study(tmp_path, COULOMB), known(COULOMB))
    assert found.seen == (True,) and found.gap_seen
    assert found.shrink > 0.95
    assert found.augmented < 1.3 * found.floor < found.reidentified


def test_where_nothing_is_planted_nothing_is_seen(tmp_path: Path) -> None:
    nothing = study(tmp_path)
    found = oracle(nothing, [])
    assert found.seen == () and not found.gap_seen and found.shrink < 0.5
    told = oracle(nothing, known(COULOMB))
    assert told.seen == (False,)
    assert told.reidentified == found.reidentified


@pytest.mark.long
def test_an_effect_at_one_level_is_known_there_only(tmp_path: Path) -> None:
    planted = replace(COULOMB, factor="m", at=1.5)
    runs = study(tmp_path, planted, level=2.0)
    there, everywhere = (oracle(runs, known(effect)) for effect in (planted, COULOMB))
    assert there.seen == (True,) and there.shrink > 0.9
    assert there.augmented < 0.8 * everywhere.augmented


@pytest.mark.long
def test_of_two_effects_each_is_judged_beside_the_other(tmp_path: Path) -> None:
    weak = Planted("actuator_offset", "actuator:u")
    runs = study(tmp_path, COULOMB)
    found = oracle(runs, known(weak, COULOMB))
    assert found.seen == (False, True)
    assert found.shrink > 0.95


def test_a_drift_is_that_of_the_parameters_at_its_channel(tmp_path: Path) -> None:
    system = study(tmp_path).system
    places = {place.channel for _, place in Known("drift", "rail").candidates(system)}
    assert places == {"rail", "parameter:b", "parameter:g"}
    assert {p.channel for _, p in Known("drift", "actuator:u").candidates(system)} == {"parameter:kf"}
    assert list(Known("sticky_valve", "actuator:u").candidates(system)) == []


def test_what_differs_from_run_to_run_is_known_from_the_held_out_runs_too(tmp_path: Path) -> None:
    scatter = Planted("scatter", "rail")
    found = oracle(study(tmp_path, scatter, level=2.0), known(scatter))
    assert found.seen == (True,) and found.shrink > 0.9


@pytest.mark.parametrize(
    ("rise", "worse"), [(np.full(40, 0.03), False), (np.full(40, 0.1), True), (np.eye(40)[0] * 40.0, False)]
)
def test_a_model_is_worse_by_more_than_noise_and_chance(rise: np.ndarray, worse: bool) -> None:
    """Square errors in units of the floor; a single window far off is chance."""
    good = Judged(np.full(40, 1.0), np.full(40, 100.0), 1.0)
    assert replace(good, square=good.square + rise).is_worse_than(good) == worse
    assert good.gap == 1.0 and not good.has_gap
    assert replace(good, square=good.square * 1.5).has_gap


@pytest.mark.long
def test_sparse_regression_names_what_is_large(tmp_path: Path) -> None:
    assert largest_term(study(tmp_path / "hoist", COULOMB, level=3.0)) == Term("coulomb_friction", "rail")
    assert largest_term(study(tmp_path / "none")) is None
