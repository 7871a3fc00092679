"""What was planted in a pendulum is recovered, and nothing where nothing was."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.benches import Bench
from tests.diagnosis.studies import HORIZON, JOINT
from unmodelled.diagnosis.answer.diagnose import diagnose_gap
from unmodelled.diagnosis.data.result import Diagnosis

RUBBING = Bench(runs=6, samples=400)
TRUTH = {"b": 0.015, "mgl": 1.2}


def diagnosis(folder: Path, bench: Bench, workers: int = 2) -> Diagnosis:
    return diagnose_gap(*bench.recorded(folder), HORIZON, 0, workers)


def said(found: Diagnosis) -> dict[str, list[str]]:
    """Family and channel -> what the data cannot tell from it."""
    at = lambda added: f"{added.family} at {added.place.channel}"  # noqa: E731
    return {at(e.added): list(map(at, e.indistinguishable)) for e in found.effects}


def fitted(found: Diagnosis) -> tuple[list[object], list[float]]:
    """What was named, and all numbers that were fitted or chosen by."""
    words = [found.verdict, said(found), found.held_out, [model.label for model in found.steps]]
    listed = [([(e.law, e.place) for e in c.effects], c.named) for c in found.comparison]
    models = (found.reidentified, found.augmented, found.neural, *found.steps)
    estimates = [*found.parameters.values(), *(v for e in found.effects for v in e.estimates.values())]
    return [*words, listed], [
        *(value for model in models for value in model.system.values),
        *(number for e in estimates for number in (e.value, *e.interval)),
        *(number for c in found.comparison for number in (c.score, c.difference, c.standard_error)),
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
    assert friction.verdict == "effect" and friction.remainder is None
    ((named, others),) = said(friction).items()
    assert "coulomb_friction at joint" in (named, *others)
    (found,) = friction.effects
    assert found.added.place == JOINT and found.confidence > 0.5 and friction.confidence > 0.5
    estimate = found.estimates["F_c"]
    assert estimate.value == pytest.approx(0.06, rel=0.03) and estimate.unit == "N m"
    low, high = estimate.interval
    assert low < estimate.value < high and high - low < 0.1 * estimate.value
    assert low - 1e-3 < 0.06 < high + 1e-3


@pytest.mark.long
def test_a_supply_that_varies_hides_no_delay(tmp_path: Path) -> None:
    supply = (1.0, 0.9, 1.12, 0.86, 1.05, 0.95, 1.1, 0.92)
    found = diagnosis(tmp_path, Bench(friction=0.0, supply=supply, delay=8, runs=8, samples=400))
    (effect,) = found.effects
    # the only output is late, or the only input
    assert effect.added.family in ("sensor_delay", "input_delay")
    late_by = found.augmented.system.outputs[0].delay + found.augmented.system.inputs[0].delay
    assert late_by == pytest.approx(0.016, abs=3e-4)
    (varies,) = (part for part in found.chain if part.per_experiment and part.added.place.kind == "actuator")
    assert varies.value == pytest.approx(np.std(supply), rel=0.1)


def test_the_gap_shrinks_to_the_floor(friction: Diagnosis) -> None:
    assert friction.shrink > 0.95 and friction.effects[0].shrink == pytest.approx(friction.shrink)
    low, high = friction.interval
    assert 0.9 < low <= friction.shrink <= high <= 1.0
    assert friction.known.gap.value > friction.reidentified.gap.value > 5.0 * friction.augmented.gap.value
    assert friction.augmented.gap.value < 1.3 * friction.floor
    named = f"with {friction.effects[0].added.title}"
    assert [model.label for model in friction.steps] == ["re-identified", named]
    assert friction.steps[-1] is friction.augmented


def test_parameters_that_were_wrong_are_identified(friction: Diagnosis) -> None:
    assert set(friction.parameters) == set(TRUTH)
    for name, truth in TRUTH.items():
        found = friction.parameters[name]
        assert found.value == pytest.approx(truth, rel=0.03)
        assert found.interval[0] - 0.01 * truth < truth < found.interval[1] + 0.01 * truth
    assert (friction.parameters["b"].known, friction.parameters["mgl"].known) == (0.03, 0.9)


def test_candidates_are_compared_with_the_named_one(friction: Diagnosis) -> None:
    scores = [c.score for c in friction.comparison]
    assert scores == sorted(scores)
    (named,) = (c for c in friction.comparison if c.named)
    assert [added.key for added in named.effects] == [friction.effects[0].added.key]
    assert (named.difference, named.standard_error) == (0.0, 0.0)
    for c in friction.comparison:
        assert c.difference == pytest.approx(c.score - named.score, abs=1e-9)
    assert min(scores) > named.score - 0.1  # what predicts better does so by little


@pytest.mark.long
def test_the_same_seed_gives_the_same_diagnosis(friction: Diagnosis, tmp_path: Path) -> None:
    """Whatever the number of threads."""
    again = diagnosis(tmp_path, RUBBING, workers=1)
    assert fitted(again)[0] == fitted(friction)[0] and again.notes == friction.notes
    assert fitted(again)[1] == pytest.approx(fitted(friction)[1], rel=1e-6, abs=1e-9)
    assert judged(again) == pytest.approx(judged(friction), rel=1e-6)
    assert again.confidence == pytest.approx(friction.confidence)


@pytest.mark.long
def test_nothing_is_missing_where_parameters_were_wrong(tmp_path: Path) -> None:
    found = diagnosis(tmp_path, replace(RUBBING, friction=0.0))
    assert (found.verdict, found.effects, found.remainder) == ("no_gap", (), None)
    assert found.augmented is found.reidentified and found.steps == (found.reidentified,)
    assert (found.shrink, found.interval) == (0.0, (0.0, 0.0))
    assert found.known.gap.value > 10.0 * found.reidentified.gap.value
    assert found.reidentified.gap.value < 1.3 * found.floor
    values = {name: estimate.value for name, estimate in found.parameters.items()}
    assert values == pytest.approx(TRUTH, rel=0.02)
    assert sum(c.named for c in found.comparison) == 1


@pytest.mark.long
def test_what_is_in_no_library_is_not_explained(tmp_path: Path) -> None:
    """A sensor misses counts in a run; no network predicts them either, and the error is too large."""
    missed = diagnosis(tmp_path, replace(RUBBING, friction=0.0, missed=0.2))
    assert missed.verdict in ("unknown", "main_effect")
    assert missed.shrink < 0.5 and missed.augmented.gap.value > 2.0 * missed.floor


@pytest.mark.long
def test_two_effects(tmp_path: Path) -> None:
    """Friction, and a sensor that shows too much, more than sensors usually do."""
    found = diagnosis(tmp_path, replace(RUBBING, samples=500, gain=1.3))
    assert found.verdict == "effect"
    gain, friction = found.effects
    assert gain.added.family == "sensor_gain" and friction.added.place == JOINT
    assert gain.estimates["g"].value == pytest.approx(0.3, rel=0.05)
    assert friction.estimates["F_c"].value == pytest.approx(0.06, rel=0.05)
    assert len(found.steps) == 3 and found.steps[1].label == "with sensor gain at sensor theta"
    first, second, third = (model.gap.value for model in found.steps)
    assert first > 1.2 * second > 1.2 * third and found.shrink > 0.95
    assert gain.shrink + friction.shrink == pytest.approx(found.shrink, abs=1e-3)
    assert gain.shrink > 0.9 and friction.shrink > 0.02


@pytest.mark.long
def test_two_experiments_are_enough(tmp_path: Path) -> None:
    """Each is predicted by a fit to the other."""
    found = diagnosis(tmp_path, replace(RUBBING, runs=2))
    assert found.verdict == "effect" and len(found.held_out) == 2
    assert "coulomb_friction at joint" in {n for name, others in said(found).items() for n in (name, *others)}
    assert found.effects[0].estimates["F_c"].value == pytest.approx(0.06, rel=0.05)


@pytest.mark.long
def test_a_late_sensor_whose_delay_is_known_and_short_experiments(tmp_path: Path) -> None:
    """A further delay is looked for as far as the windows leave room."""
    late = ("  theta: {unit: rad}\nparameters:", "  theta: {unit: rad, delay: 0.0063}\nparameters:")
    system, logs = Bench(samples=240, delay=6, friction=0.0).recorded(tmp_path, late)
    found = diagnose_gap(system, logs, HORIZON, 0)
    assert found.verdict == "effect"
    assert {"sensor_delay", "input_delay"} & {effect.added.family for effect in found.effects}
    late_by = found.augmented.system.outputs[0].delay + found.augmented.system.inputs[0].delay
    assert late_by == pytest.approx(0.012, abs=5e-4)
