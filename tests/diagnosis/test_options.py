"""Numbers of a diagnosis that a user sets: refused with the reason, used, and told by the answer."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import pytest

import unmodelled as um
from unmodelled.diagnosis.data.thresholds import DEFAULT_THRESHOLDS


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
