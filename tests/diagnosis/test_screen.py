"""A linear look at all effects tells which of them was planted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.benches import PERIOD, Bench
from tests.diagnosis.studies import ANGLE, JOINT, ONE_FAULT, TORQUE, effect, fitted, study
from unmodelled.diagnosis.fitting.hypothesis import Hypothesis
from unmodelled.diagnosis.search.screen import Screened, screen
from unmodelled.diagnosis.search.tangent import Tangent
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place

#: A column of experiments.csv with a level that holds for both kinds of runs.
GROUPS = ("new", "old", "new", "old", "new", "old")


def screened(folder: Path, bench: Bench) -> list[Screened]:
    base = fitted(Hypothesis.known(study(folder, bench)))
    return screen(base, base.recording, workers=2)


def simplest(found: list[Screened]) -> Screened:
    """The simplest of those that gain as much as the first one, to a hundredth."""
    gains = [candidate.gain for candidate in found]
    assert gains == sorted(gains, reverse=True)
    return min(found, key=lambda c: (c.gain < 0.99 * gains[0], c.hypothesis.complexity))


def first(found: list[Screened]) -> tuple[str, Place]:
    added = simplest(found).hypothesis.effects[-1]
    return added.family, added.place


@pytest.mark.long
@pytest.mark.parametrize(("bench", "family", "place"), ONE_FAULT.values(), ids=ONE_FAULT)
def test_what_was_planted_comes_first(tmp_path: Path, bench: Bench, family: str, place: Place) -> None:
    found = screened(tmp_path, bench)
    assert first(found) == (family, place)
    if family == "input_delay":
        assert [c.effect.family for c in found if c.gain > 0.9 * found[0].gain][:2] == [
            family,
            "sensor_delay",
        ]
    assert found[0].gain > 500.0
    assert {c.hypothesis.effects[-1].family for c in found} == {
        e.family for e in effects() if e.places(found[0].base.hypothesis.study.system) and not e.at_levels
    }


def test_on_top_of_a_late_sensor_the_same_samples_are_compared(tmp_path: Path) -> None:
    known = Hypothesis.known(study(tmp_path, Bench(samples=400, friction=0.0, delay=8)))
    base = fitted(known.plus(effect("sensor_delay"), ANGLE))
    (delay,) = base.hypothesis.effects[-1].delays
    assert base.fit.values[delay] == pytest.approx(8 * PERIOD, abs=PERIOD)
    tangent = Tangent(base, base.recording)
    larger = base.hypothesis.plus(effect("coulomb_friction"), JOINT)
    # no amount of an effect changes no error, except at the ends of windows that are compared sooner
    assert np.abs(tangent.slopes(larger, [{"F_c": 0.0}]))[:, :, 1:-1].max() < 1e-6


@pytest.fixture(scope="module")
def nothing(tmp_path_factory: pytest.TempPathFactory) -> list[Screened]:
    return screened(tmp_path_factory.mktemp("nothing"), Bench(friction=0.0, samples=400))


@pytest.mark.long
def test_nothing_planted_no_gain_beyond_chance(nothing: list[Screened]) -> None:
    gains = {c.hypothesis.key: c.gain for c in nothing}
    assert max(gains.values()) < 10.0
    assert np.mean(list(gains.values())) < 0.0


@pytest.mark.long
def test_dry_friction_scatters_beside_a_friction_that_all_experiments_share(tmp_path: Path) -> None:
    known = fitted(Hypothesis.known(study(tmp_path, Bench(samples=300, runs=4))))
    rubbing = fitted(known.hypothesis.plus(effect("coulomb_friction"), JOINT))
    sites = [
        [
            s.place
            for s in screen(base, base.recording, 2)
            if (s.effect.family, s.effect.variant) == ("scatter", "dry_friction")
        ]
        for base in (known, rubbing)
    ]
    assert sites == [[], [JOINT]]


def test_every_candidate_has_starts_that_a_fit_can_take(nothing: list[Screened]) -> None:
    for candidate in nothing:
        assert candidate.starts and len({c.hypothesis.key for c in nothing}) == len(nothing)
        for start in candidate.starts:
            assert np.isfinite(list(start.values())).all()
            shared = [u for u in candidate.hypothesis.unknowns if not u.own]
            assert {u.name for u in shared} <= set(start)
            for u in shared:
                assert u.low * (1.0 - 1e-9) - 1e-12 <= start[u.name]
                if u.name not in candidate.hypothesis.delays:
                    assert start[u.name] <= u.high * (1.0 + 1e-9) + 1e-12


@pytest.fixture(scope="module")
def local(tmp_path_factory: pytest.TempPathFactory) -> list[Screened]:
    bench = Bench(runs=6, samples=300, groups=GROUPS, friction=tuple(0.06 * (g == "old") for g in GROUPS))
    return screened(tmp_path_factory.mktemp("local"), bench)


def is_coulomb(candidate: Screened) -> bool:
    added = candidate.hypothesis.effects[-1]
    return (added.family, added.variant) == ("coulomb_friction", "")


@pytest.mark.long
def test_an_effect_in_one_group_is_found_there(local: list[Screened]) -> None:
    assert first(local) == ("coulomb_friction", Place("port", "joint", "group", "old"))
    gains = {c.hypothesis.effects[-1].place: c.gain for c in local if is_coulomb(c)}
    old, new = (Place("port", "joint", "group", level) for level in ("old", "new"))
    assert set(gains) == {JOINT, old, new}
    assert gains[old] > 500.0 and max(gains[JOINT], gains[new]) < 0.3 * gains[old]


def test_a_start_is_close_to_what_was_planted(local: list[Screened]) -> None:
    (start, *_) = simplest(local).starts
    assert start["F_c"] == pytest.approx(0.06, rel=0.3) and start["mgl"] == pytest.approx(1.2, rel=0.05)


@pytest.mark.long
def test_levels_where_windows_are_left_out(tmp_path: Path) -> None:
    """Experiments of which no window is looked at do not count as members of a level."""
    bench = Bench(runs=16, samples=160, groups=("old", "new") * 8, friction=(0.06, 0.0) * 8)
    base = fitted(Hypothesis.known(study(tmp_path, bench)))
    every = base.recording
    mine = ~np.isin(every.owner, every.runs[-2:])
    few = replace(every, start=every.start[mine], steps=every.steps[mine])
    assert len(np.unique(few.owner)) == len(few.runs) - 2
    assert first(screen(base, few, workers=1)) == (
        "coulomb_friction",
        Place("port", "joint", "group", "old"),
    )


def test_numbers_of_an_effect_have_no_effects_of_their_own(tmp_path: Path) -> None:
    bench = Bench(samples=400, dead_zone=0.05)
    known = Hypothesis.known(study(tmp_path, bench))
    base = fitted(known.plus(effect("coulomb_friction"), JOINT))
    found = screen(base, base.recording, workers=1)
    seen = [c.hypothesis.effects[-1] for c in found]
    assert not [e for e in seen if e.family == "coulomb_friction" and e.place.channel == JOINT.channel]
    assert {e.place.name for e in seen if e.place.kind == "parameter"} == {"J", "b", "mgl"}
    assert first(found) == ("actuator_dead_zone", TORQUE)


@pytest.mark.long
def test_threads_do_not_matter(tmp_path: Path) -> None:
    base = fitted(Hypothesis.known(study(tmp_path, Bench(samples=200))))
    one, two = (screen(base, base.recording, workers) for workers in (1, 2))
    assert [(c.hypothesis.key, c.gain, c.starts) for c in one] == [
        (c.hypothesis.key, c.gain, c.starts) for c in two
    ]
