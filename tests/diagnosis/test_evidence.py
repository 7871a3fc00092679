"""A diagnosis by evidence, from the command line to the files that a user takes home."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.commands import exit_code
from tests.diagnosis.benches import Bench
from tests.diagnosis.studies import HORIZON, diagnosed, study
from tests.diagnosis.test_ports_between import damping_between, friction_of_the_load, logged
from unmodelled.api.diagnosis import diagnose
from unmodelled.api.simulation import simulate
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.judge.base import bases
from unmodelled.diagnosis.judge.chain import chain_of
from unmodelled.diagnosis.judge.left_out import LeftOutRuns
from unmodelled.diagnosis.judge.linear import Linearised
from unmodelled.diagnosis.judge.paying import paying_parts
from unmodelled.systems.reader import read_system

RUBBING = Bench(runs=4, samples=400)
LAWS = """schema: laws/1
laws:
  rub:
    formula: F*tanh(v/0.05)
    numbers:
      F: {unit: N m, plausible: 0.1, low: 0}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("evidence")


@pytest.fixture(scope="module")
def answered(folder: Path) -> Path:
    """Folder of the answer of the verb, with a law of the user."""
    RUBBING.recorded(folder)
    (folder / "laws.yaml").write_text(LAWS)
    words = (f"{name}={folder / file}" for name, file in (("system", "system.yaml"), ("logs", "logs")))
    own = f"laws={folder / 'laws.yaml'}", f"horizon={HORIZON}", f"out={folder / 'answer'}"
    assert exit_code("diagnose", *words, *own, "-q") == 0
    return folder / "answer"


def content(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "diagnosis.json").read_text())
    return found


@pytest.mark.long
def test_the_verb_names_friction_with_its_number_in_all_files(answered: Path) -> None:
    found = content(answered)
    assert found["verdict"] == "effect" and found["confidence"] > 0.5
    (effect,) = found["effects"]
    # the law of the user is the same friction
    listed = [e["family"] for e in (effect, *effect["indistinguishable"])]
    assert {"coulomb_friction", "rub"} <= set(listed) and effect["port"] == "joint"
    (number,) = effect["parameters"].values()
    low, high = number["interval"]
    assert low < 0.06 < high and high - low < 0.02 and number["determined"]
    assert found["gap"]["held_out"] == [f"run{k}" for k in range(RUBBING.runs)]
    assert found["gap"]["augmented"] < 0.2 * found["gap"]["reidentified"]
    for file in ("index.html", "augmented_system.yaml", "tables"):
        assert (answered / file).exists()


@pytest.mark.long
def test_the_written_file_has_the_numbers_and_nearly_the_gap_of_the_answer(answered: Path) -> None:
    found, system = content(answered), read_system(answered / "augmented_system.yaml")
    values = dict(zip((p.name for p in system.parameters), system.values, strict=True))
    ((name, number),) = found["effects"][0]["parameters"].items()
    assert values[name] == pytest.approx(number["value"], rel=1e-6)
    gap = simulate(answered / "augmented_system.yaml", answered.parent / "logs", HORIZON).value
    # experiments left out are predicted a little worse than those that a file was fitted to
    assert 0.8 * found["gap"]["augmented"] <= gap <= found["gap"]["augmented"] * (1.0 + 1e-6)


@pytest.mark.long
def test_nothing_is_named_where_nothing_is_missing(folder: Path) -> None:
    found = diagnosed(folder / "null", replace(RUBBING, friction=0.0))
    assert found.verdict == "no_gap" and not found.effects and found.remainder is None
    assert found.confidence > 0.5
    assert found.augmented.gap.value < 1.2 * found.floor
    (named,) = (row for row in found.comparison if row.named)
    assert named.effects == () and found.chance is not None and found.chance > 0.2
    assert found.parameters["mgl"].interval[0] < 1.2 < found.parameters["mgl"].interval[1]


def test_every_experiment_has_a_step_and_not_all_parts_of_the_chain_pay(folder: Path) -> None:
    found = study(folder / "left_out", RUBBING)
    fitted = FittedHypothesis.of(Hypothesis.known(found), found.recording)
    base = next(bases(found, fitted))
    around = Linearised.of(base.fitted, base.tau)
    assert np.all(LeftOutRuns.of(around).steps.shape == (len(found.learned), around.opened))
    kept = paying_parts(around)
    assert set(kept) < {part.key for part in chain_of(base.fitted.hypothesis)}


@pytest.mark.long
def test_a_port_between_two_masses_is_there_only_where_a_law_acts(tmp_path: Path) -> None:
    for effort, port, ports in (
        (damping_between, "motor_load", ("motor", "load", "motor_load")),
        (friction_of_the_load, "load", ("motor", "load")),
    ):
        answer = diagnose(*logged(tmp_path / port, effort), HORIZON, workers=1)
        assert answer.effects[0].port == port
        assert answer.system.port_names == ports
        assert any("the system file has no port" in note for note in answer.notes) is (len(ports) == 3)
