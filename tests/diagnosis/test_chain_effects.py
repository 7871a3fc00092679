"""Parts of the measurement chain that are effects: what makes most of a gap that matters."""

from pathlib import Path

import pytest

from tests.diagnosis.benches import PERIOD, Bench
from tests.diagnosis.studies import HORIZON, diagnosed
from unmodelled.diagnosis.data.result import Diagnosis

LATE = 5  # samples: within three priors of a delay
TIMING = {"sensor_delay", "input_delay"}


@pytest.fixture(scope="module")
def late(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    """The answer where the sensor is late and nothing else is missing."""
    folder = tmp_path_factory.mktemp("late")
    return diagnosed(folder, Bench(friction=0.0, delay=LATE, samples=400))


def test_a_delay_that_makes_most_of_the_gap_is_an_effect_with_its_twins(late: Diagnosis) -> None:
    (effect,) = late.effects
    assert late.verdict == "effect" and effect.kind == "timing" and late.confidence > 0.5
    families = {effect.added.family, *(twin.family for twin in effect.indistinguishable)}
    assert families >= TIMING
    assert len(effect.probabilities) == len(families) and sum(effect.probabilities) == pytest.approx(1.0)
    assert late.augmented.gap.value < 0.3 * late.reidentified.gap.value and effect.shrink > 0.9


def test_its_number_is_the_whole_delay_and_leaves_with_the_system(late: Diagnosis) -> None:
    """Parts that stand in for it are not beside it: they would share the number."""
    (effect,) = late.effects
    (number,) = effect.estimates.values()
    assert number.value == pytest.approx(PERIOD * LATE, abs=0.1 * PERIOD)
    assert not {part.added.family for part in late.chain} & TIMING
    (output,), (torque,) = late.augmented.system.outputs, late.augmented.system.inputs
    assert output.delay + torque.delay == pytest.approx(number.value)


def test_the_answer_is_no_gap_where_the_delay_does_not_matter(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, Bench(friction=0.0, delay=1, samples=400, noise=4e-3))
    assert found.verdict == "no_gap" and not found.effects


@pytest.mark.long
def test_a_delay_is_an_effect_beside_a_law(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, Bench(delay=2 * LATE, samples=400))
    kinds = {effect.kind: effect for effect in found.effects}
    assert set(kinds) == {"dry friction", "timing"}
    assert [step.label for step in found.steps][-1] == f"with {kinds['timing'].added.family} at sensor:theta"
    assert min(effect.shrink for effect in found.effects) > 0.05
    lengths = sorted({row.horizon for row in found.evidence})
    assert lengths == pytest.approx([HORIZON, 4.0 * HORIZON])
    (number,) = kinds["timing"].estimates.values()
    assert number.value == pytest.approx(2 * PERIOD * LATE, abs=PERIOD)  # when the input acts is open
