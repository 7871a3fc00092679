"""The content of a JSON file is as it must be, or the place is named where it is not."""

import json
from pathlib import Path
from typing import Any

import pytest

from unmodelled.base.errors import BadInput
from unmodelled.base.shapes import read_shaped

SHAPE = {
    "verdict": frozenset({"yes", "no"}),
    "effects": [{"port": str, "shrink": (float, None)}],
    "limits": {"*": ([float], None)},
    "seen": bool,
}
FIRST: dict[str, Any] = {"port": "rail", "shrink": None}
GOOD: dict[str, Any] = {
    **{"verdict": "yes", "effects": [FIRST, {"port": "u", "shrink": 1}], "seen": True, "more": [{}]},
    "limits": {"b": [0.5, 2], "c": None},
}


def test_what_is_right_is_read(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(json.dumps(GOOD))
    assert read_shaped(tmp_path / "a.json", SHAPE) == GOOD


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ([], "must be an object, got a list"),
        ({**GOOD, "verdict": "maybe"}, "verdict: must be one of no, yes, got 'maybe'"),
        ({**GOOD, "verdict": ["yes"]}, "verdict: must be one of no, yes, got a list"),
        ({k: v for k, v in GOOD.items() if k != "seen"}, "seen is missing"),
        ({**GOOD, "seen": 1}, "seen: must be true or false, got 1"),
        ({**GOOD, "effects": {}}, "effects: must be a list, got an object"),
        ({**GOOD, "effects": [FIRST, {"port": "b"}]}, r"effects\[1\]: shrink is missing"),
        ({**GOOD, "effects": [{"port": 3, "shrink": 1}]}, r"effects\[0\]\.port: must be a text, got 3"),
        ({**GOOD, "effects": [{**FIRST, "shrink": True}]}, r"effects\[0\]\.shrink: must be a number or null"),
        ({**GOOD, "limits": {"b": [1, "2"]}}, r"limits\.b\[1\]: must be a number, got '2'"),
        ({**GOOD, "limits": {"b": 1}}, r"limits\.b: must be a list or null, got 1"),
    ],
)
def test_what_is_wrong_is_named(content: Any, words: str, tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(json.dumps(content))
    with pytest.raises(BadInput, match=rf"a\.json: {words}"):
        read_shaped(tmp_path / "a.json", SHAPE)


def test_an_entry_may_be_missing_but_not_be_of_another_kind(tmp_path: Path) -> None:
    shape = {"port": str, "level?": (float, None), "count?": int}
    good: list[dict[str, Any]] = [{"port": "rail"}, {"port": "rail", "level": None, "count": 2}]
    for content in good:
        (tmp_path / "a.json").write_text(json.dumps(content))
        assert read_shaped(tmp_path / "a.json", shape) == content
    for content, words in (
        ({"port": "rail", "level": "high"}, "level: must be a number or null, got 'high'"),
        ({"port": "rail", "count": 0.5}, "count: must be a whole number, got 0.5"),
    ):
        (tmp_path / "a.json").write_text(json.dumps(content))
        with pytest.raises(BadInput, match=words):
            read_shaped(tmp_path / "a.json", shape)
