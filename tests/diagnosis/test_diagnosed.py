"""What was planted in a pendulum is recovered, and nothing where nothing was."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.benches import Bench, pendulum
from tests.diagnosis.studies import HORIZON, JOINT, effect
from unmodelled.diagnosis.answer.diagnose_gap import diagnose_gap
from unmodelled.diagnosis.data.result import Diagnosis
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.diagnosis.search.effect_search import EffectSearch
from unmodelled.logs.preparation import prepare

RUBBING = Bench(runs=6, samples=400)
TRUTH = {"b": 0.015, "mgl": 1.2}


def diagnosis(folder: Path, bench: Bench, workers: int = 2) -> Diagnosis:
    system = pendulum(folder)
    return diagnose_gap(system, bench.logs(folder / "logs", system), HORIZON, 0, workers)


def said(found: Diagnosis) -> dict[str, list[str]]:
    """Family and channel -> what the data cannot tell from it."""
    return {
        f"{e.added.family} at {e.added.place.channel}": [
            f"{o.family} at {o.place.channel}" for o in e.indistinguishable
        ]
        for e in found.effects
    }


def fitted(found: Diagnosis) -> tuple[list[object], list[float]]:
    """What was named, and all numbers that were fitted or chosen by."""
    words = [found.verdict, said(found), found.held_out, [model.label for model in found.steps]]
    listed = [([(e.law, e.place) for e in c.effects]) for c in found.candidates]
    models = (found.reidentified, found.augmented, found.neural, *found.steps)
    estimates = [*found.parameters.values(), *(v for e in found.effects for v in e.estimates.values())]
    scale = found.known.gap.scale["theta"]  # of all experiments: errors in rad do not depend on it
    return [*words, listed], [
        *(value for model in models for value in model.system.values),
        *(number for e in estimates for number in (e.value, *e.interval)),
        *(number for c in found.candidates for number in (scale * c.gap, c.evidence)),
    ]


def judged(found: Diagnosis) -> list[float]:
    """All numbers that come from the held-out experiments."""
    models = (found.known, found.reidentified, found.augmented, found.neural, *found.steps)
    gaps = [value for m in models for value in (m.gap.value, *m.gap.per_experiment.values())]
    return [*gaps, found.floor, found.shrink, *found.interval, *(e.shrink for e in found.effects)]


@pytest.fixture(scope="module")
def friction(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    return diagnosis(tmp_path_factory.mktemp("friction"), RUBBING)


def test_dry_friction_is_named_at_its_port_with_its_number(friction: Diagnosis) -> None:
    assert friction.verdict == "effect" and not friction.partial
    ((named, others),) = said(friction).items()
    assert "coulomb_friction at joint" in (named, *others)
    (found,) = friction.effects
    assert found.added.place == JOINT and found.confidence > 0.5 and friction.confidence > 0.5
    estimate = found.estimates["F_c"]
    assert estimate.value == pytest.approx(0.06, rel=0.03) and estimate.unit == "N m"
    low, high = estimate.interval
    assert low < estimate.value < high and high - low < 0.1 * estimate.value
    assert low - 1e-3 < 0.06 < high + 1e-3


def test_the_gap_shrinks_to_the_floor(friction: Diagnosis) -> None:
    assert friction.shrink > 0.95 and friction.effects[0].shrink == pytest.approx(friction.shrink)
    low, high = friction.interval
    assert 0.9 < low <= friction.shrink <= high <= 1.0
    assert friction.known.gap.value > friction.reidentified.gap.value > 5.0 * friction.augmented.gap.value
    assert friction.augmented.gap.value < 1.3 * friction.floor
    assert [model.label for model in friction.steps] == [
        "re-identified",
        f"with {friction.effects[0].added.family} at joint",
    ]
    assert friction.steps[-1] is friction.augmented


def test_parameters_that_were_wrong_are_identified(friction: Diagnosis) -> None:
    assert set(friction.parameters) == set(TRUTH)
    for name, truth in TRUTH.items():
        found = friction.parameters[name]
        assert found.value == pytest.approx(truth, rel=0.03)
        assert found.interval[0] - 0.01 * truth < truth < found.interval[1] + 0.01 * truth
    assert (friction.parameters["b"].known, friction.parameters["mgl"].known) == (0.03, 0.9)


def test_candidates_are_listed_by_evidence(friction: Diagnosis) -> None:
    evidence = [c.evidence for c in friction.candidates]
    assert evidence[0] == 0.0 and evidence == sorted(evidence, reverse=True)
    assert friction.candidates[0].effects == (friction.effects[0].added,)
    (without,) = (c for c in friction.candidates if not c.effects)
    assert without.evidence < -100.0 and without.gap > 5.0 * friction.candidates[0].gap


def test_the_models_have_the_gap_of_the_contract(friction: Diagnosis) -> None:
    assert len(friction.held_out) == 2
    for model in (friction.known, friction.augmented, friction.neural):
        expected = free_runs(model.system, model.logs, HORIZON, friction.held_out)
        assert model.gap.value == pytest.approx(expected.value, rel=1e-6)


def test_the_same_seed_gives_the_same_diagnosis(friction: Diagnosis, tmp_path: Path) -> None:
    """Whatever the number of threads."""
    again = diagnosis(tmp_path, RUBBING, workers=1)
    assert fitted(again)[0] == fitted(friction)[0] and again.notes == friction.notes
    assert fitted(again)[1] == pytest.approx(fitted(friction)[1], rel=1e-6, abs=1e-9)
    assert judged(again) == pytest.approx(judged(friction), rel=1e-6)
    assert again.confidence == pytest.approx(friction.confidence)


def test_held_out_experiments_take_no_part(friction: Diagnosis) -> None:
    """Upside down, and with a sensor that is ten times as noisy, they change nothing but their own gap."""
    logs = friction.logs
    held = np.isin(logs.owner, friction.held_out)[:, None]
    noise = 2e-3 * np.random.default_rng(0).standard_normal(logs.y.shape)
    y, u = np.where(held, noise - logs.y, logs.y), np.where(held, 2.0 * logs.u, logs.u)
    turned = prepare(friction.system, replace(logs, y=y, u=u))
    found = diagnose_gap(friction.system, turned, HORIZON, 0)
    assert found.held_out == friction.held_out
    assert found.augmented.gap.value > 50.0 * friction.augmented.gap.value
    assert fitted(found)[0] == fitted(friction)[0]
    assert fitted(found)[1] == pytest.approx(fitted(friction)[1], rel=1e-6, abs=1e-9)


def test_nothing_is_missing_where_parameters_were_wrong(tmp_path: Path) -> None:
    found = diagnosis(tmp_path, replace(RUBBING, friction=0.0))
    assert (found.verdict, found.effects, found.partial) == ("no_gap", (), False)
    assert found.augmented is found.reidentified and found.steps == (found.reidentified,)
    assert (found.shrink, found.interval) == (0.0, (0.0, 0.0))
    assert found.known.gap.value > 10.0 * found.reidentified.gap.value
    assert found.reidentified.gap.value < 1.3 * found.floor
    values = {name: estimate.value for name, estimate in found.parameters.items()}
    assert values == pytest.approx(TRUTH, rel=0.02)


def test_what_is_in_no_library_is_unknown(tmp_path: Path) -> None:
    """A sensor that misses counts in the middle of a run."""
    found = diagnosis(tmp_path, replace(RUBBING, friction=0.0, missed=0.2))
    assert found.verdict == "unknown" and found.partial == bool(found.effects)
    assert found.shrink < 0.5 and found.augmented.gap.value > 2.0 * found.floor


def test_two_effects(tmp_path: Path) -> None:
    """Friction, and a sensor that shows too much; what lowers the loss most comes first."""
    found = diagnosis(tmp_path, replace(RUBBING, samples=500, gain=1.1))
    assert found.verdict == "effect"
    gain, friction = found.effects
    assert gain.added.family == "sensor_gain" and friction.added.place == JOINT
    assert gain.estimates["g"].value == pytest.approx(0.1, rel=0.05)
    assert friction.estimates["F_c"].value == pytest.approx(0.06, rel=0.05)
    assert len(found.steps) == 3 and found.steps[1].label == "with sensor_gain at sensor:theta"
    first, second, third = (model.gap.value for model in found.steps)
    assert first > 1.2 * second > 1.2 * third and found.shrink > 0.95
    assert gain.shrink + friction.shrink == pytest.approx(found.shrink, abs=1e-9)
    assert gain.shrink > 0.2 and friction.shrink > 0.2


def test_two_experiments_are_enough(tmp_path: Path) -> None:
    """One to learn from and one to judge by."""
    found = diagnosis(tmp_path, replace(RUBBING, runs=2))
    assert found.verdict == "effect" and len(found.held_out) == 1
    assert "coulomb_friction at joint" in {
        name for pair in said(found).items() for name in (pair[0], *pair[1])
    }
    assert found.effects[0].estimates["F_c"].value == pytest.approx(0.06, rel=0.05)


def test_a_late_sensor_whose_delay_is_known_and_short_experiments(tmp_path: Path) -> None:
    """A further delay is looked for as far as the windows leave room."""
    late = ("  theta: {unit: rad}\nparameters:", "  theta: {unit: rad, delay: 0.0063}\nparameters:")
    system = pendulum(tmp_path, late)
    logs = Bench(samples=240, delay=6, friction=0.0).logs(tmp_path / "logs", system)
    found = diagnose_gap(system, logs, HORIZON, 0)
    assert found.verdict == "effect"
    ((named, others),) = said(found).items()
    assert "sensor_delay at sensor:theta" in (named, *others)
    late_by = found.augmented.system.outputs[0].delay + found.augmented.system.inputs[0].delay
    assert late_by == pytest.approx(0.012, abs=5e-4)


def test_a_search_ends_when_nothing_is_left(friction: Diagnosis) -> None:
    told: list[str] = []
    search = EffectSearch(Study.of(friction.system, friction.logs, HORIZON, 0), 2, told.append)
    scores = search.run()
    named = scores.fits[scores.leading()].hypothesis
    assert named.key == frozenset((e.added.family, e.added.variant, e.added.place) for e in friction.effects)
    assert scores.fits[0] is search.base and search.base.hypothesis.key == frozenset()
    assert max(len(f.hypothesis.effects) for f in scores.fits) == 1
    assert told[0] == "re-identify the known physics" and len(told) == 3
    before = len(search.fits)
    (added,) = named.effects
    assert search.fitted_with(search.base.hypothesis, added) is search.fits[named.key]
    drag = search.base.hypothesis.plus(effect("quadratic_drag"), JOINT)
    search.fits.pop(drag.key, None)
    again = search.fitted_with(search.base.hypothesis, drag.effects[0])
    assert again.hypothesis.key == drag.key and len(search.fits) >= before
