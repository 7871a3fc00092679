"""Every threshold says what it means, a study can vary it, and a user can set some of them as options."""

import inspect
import re
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import unmodelled as um
from tests.diagnosis.benches import Bench
from tests.diagnosis.studies import HORIZON, JOINT, effect
from unmodelled.diagnosis.data.study import Study, held_out
from unmodelled.diagnosis.data.thresholds import DEFAULT_THRESHOLDS, Thresholds
from unmodelled.diagnosis.fitting.hypothesis import Hypothesis

ROOM = Path(__file__).parents[2] / "unmodelled" / "diagnosis"


def test_every_threshold_has_meaning_unit_origin_and_sensitivity() -> None:
    for each in fields(Thresholds):
        assert set(each.metadata) == {"unit", "origin", "sensitivity"}, each.name
        assert all(each.metadata.values()), each.name
        assert f"\n    {each.name}: " in (inspect.getdoc(Thresholds) or "")


def test_every_threshold_is_used() -> None:
    """By the code of the room, outside the file that defines it."""
    code = "".join(path.read_text() for path in ROOM.rglob("*.py") if path.name != "thresholds.py")
    assert {each.name for each in fields(Thresholds)} <= set(re.findall(r"\.(\w+)\b", code))


def test_the_held_out_share_decides_how_many_are_held_out() -> None:
    table = pd.DataFrame({"id": [str(k) for k in range(8)], "file": "log.csv"})
    shares = {0.25: 2, 0.5: 4, 0.01: 1}
    assert {
        share: len(held_out(table, 0, replace(DEFAULT_THRESHOLDS, held_out_share=share))) for share in shares
    } == shares


def test_a_study_hands_its_thresholds_to_its_hypotheses(tmp_path: Path) -> None:
    system, logs = Bench(samples=120, groups=tuple("abab")).recorded(tmp_path)
    dear = Thresholds(local_complexity=10.0, input_timing=0.1)
    usual, other = (
        Hypothesis.known(Study.of(system, logs, HORIZON, 0, limits)) for limits in (DEFAULT_THRESHOLDS, dear)
    )
    place = replace(JOINT, factor="group", level="a")
    found = [h.plus(effect("coulomb_friction"), place).complexity for h in (usual, other)]
    assert found[1] - found[0] == pytest.approx(10.0 - DEFAULT_THRESHOLDS.local_complexity)
    timing = [next(u for u in h.unknowns if u.name.startswith("timing")) for h in (usual, other)]
    assert timing[1].high == pytest.approx(timing[0].high / 6.0)


def test_the_defaults_are_the_thresholds() -> None:
    assert um.Options().thresholds == DEFAULT_THRESHOLDS and um.Options().changed == {}


def test_every_option_reaches_the_threshold_of_its_name() -> None:
    for name, value in asdict(um.Options()).items():
        other = value + 1 if name == "most_equal" else 0.5 * value
        options = um.Options.of({name: other})
        assert getattr(options.thresholds, name) == other and options.changed == {name: other}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"level": 1.5}, "options: level: must be between 0 and 1, got 1.5"),
        ({"level": float("nan")}, "options: level: must be between 0 and 1, got nan"),
        ({"level": "high"}, "options: level: must be between 0 and 1, got high"),
        ({"most_equal": 2.5}, "options: most_equal: must be a whole number from 0 on, got 2.5"),
        ({"levle": 0.9}, "did you mean 'level'?"),
    ],
)
def test_what_cannot_be_used_is_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(um.BadInput) as fault:
        um.Options.of(given)
    assert said in str(fault.value) and "\n" not in str(fault.value)


@pytest.mark.long
def test_an_answer_is_made_with_them_and_says_so() -> None:
    """No model is so good."""
    system, logs = um.example("pendulum")
    usual, strict = um.diagnose(system, logs), um.diagnose(system, logs, options={"useful_error": 1e-4})
    assert usual.verdict == "effect" and "options" not in usual.content
    assert strict.verdict == "unknown" and strict.content["options"] == {"useful_error": 1e-4}
