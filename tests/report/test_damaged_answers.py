"""An answer of a stranger: each of its entries of another type is refused, or read, printed and listed."""

import json
from pathlib import Path
from typing import Any

import pytest

import unmodelled as um
from tests.edits import edits
from tests.report import case
from unmodelled.base.answers import check_content
from unmodelled.base.errors import BadInput

COMMAND = "\x1b]0;pwn\x07"


def whole() -> dict[str, Any]:
    """An answer with one of everything that diagnosis.json may hold."""
    errors = {
        "unit": "mm",
        "known": 14.0,
        "augmented": 0.2,
        "known_whole_run": 21.0,
        "augmented_whole_run": None,
    }
    number = {"value": 22.4, "unit": "N", "interval": [22.1, 22.8], "determined": True, "at_bound": False}
    shown = {
        "symbol": "F",
        "words": "half",
        "value": 2.0,
        "unit": "kN",
        "interval": [1.0, None],
        "whole": 5.0,
    }
    own = {**number, "unit": "1", "values": {"run1": 0.1, "run2": None}}
    oil = {
        "family": "drift",
        "variant": "load",
        "port": "rail",
        "parameter": "b",
        "factor": "oil",
        "level": 1.5,
    }
    effect = {**case.FRICTION, **oil, "text": "b = 5 N", "indistinguishable": [oil]}
    effect |= {"parameters": {"F_c": {**number, "shown": shown}, "b_deviation": own}}
    signal = {**case.FRICTION, "parameters": {}, "signal": "u"}
    fault = {
        "channel": "q",
        "problem": "unit",
        "explains": 0.9,
        "experiments": ["run1"],
        "sentence": "q is in deg",
    }
    fault |= {"indistinguishable": [{"channel": "v", "problem": "clock"}]}
    run = {"gap": 0.2, "units": {"q": {"unit": "m", "at_horizon": None, "whole_run": 0.1}}}
    change = {"element": "joint", "quantity": "damping", "unit": "N m", "given": None, "patched": 2.0}
    robot = {"file": "arm.xml", "supplement": "arm.py", "changes": [change]}
    robot |= {"missing": [{"what": "a law", "reason": "no place", "supplemented": True}]}
    robot |= {"replay": {"given": run, "patched": run, "supplemented": run, "improves": True}}
    law = {
        "name": "brake",
        "formula": "c*v",
        "numbers": {"c": {"unit": "N s/m", "plausible": 1.0}},
        "at": "port",
    }
    content = case.diagnosis()
    content["gap"]["units"] = {"q": {**errors, "shown": errors}}
    content["where"]["factors"] = [{"factor": "oil", "level": "old", "share": 0.4}]
    content["where"]["experiments"] = content["where"]["experiments"][:1]
    content["comparison"] = [{**content["comparison"][1], "effects": [oil]}]
    return content | {
        **{
            "verdict": "main_effect",
            "chance": 0.1,
            "effects": [effect, signal],
            "logs": [fault],
            "robot": robot,
        },
        "remainder": {"share": 0.1, "predictable": 0.05, "channel": "rail"},
        "refused": [{"file": "augmented_system.yaml", "reason": "J < 0", "keep": "crane.yaml"}],
        **{"laws": [law], "options": {"level": 0.9}, "sources": {"system": "crane.yaml", "logs": "logs"}},
    }


def written(folder: Path, text: str) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "diagnosis.json").write_text(text)
    return folder


def told(folder: Path) -> str:
    """All that a user can print of an answer, and its line in the list."""
    answer = um.read_answer(folder)
    tables = [answer.gaps, answer.units, answer.parameters, answer.comparison, answer.table()]
    texts = [*map(str, tables), *answer.refused, *answer.notes, *map(str, answer.effects), repr(answer.where)]
    assert 0.0 <= answer.shrink <= 1.0 and answer._repr_html_()
    return "\n".join([str(answer), *texts, str(um.list_answers(folder))])


@pytest.mark.long
def test_an_edited_answer_is_told_or_refused_in_one_line(tmp_path: Path) -> None:
    shown = refused = 0
    for edited in edits(whole()):
        try:
            check_content("here", edited, "diagnosis")
        except BadInput as fault:
            assert str(fault).startswith("here: ") and str(fault).isprintable() and len(str(fault)) < 250
            refused += 1
            continue
        shown += 1
        if shown % 7 == 0:  # each takes 30 ms
            told(written(tmp_path / "crane", json.dumps(edited)))
    assert shown > 500 and refused > 1500


def test_the_whole_answer_sends_no_command_to_the_terminal(tmp_path: Path) -> None:
    text = json.dumps(whole()).replace("rail", f"rail{json.dumps(COMMAND)[1:-1]}").replace("N m", "N\\u00a0m")
    said = told(written(tmp_path / "crane", text))
    assert "\x1b" not in said and "rail\\x1b]0;pwn\\x07" in said and "N\xa0m" in said


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[" * 50_000, "nested too deeply"),
        ('{"schema": "diagnosis/2", "seed": ' + "1" * 400 + "}", "is not a finite number"),
        ('{"schema": "diagnosis/2", "seed": 1.5}', "is missing: diagnose again"),
        (" " * 5_000_000, "has 5 MB, an answer has at most 4 MB"),
        ("[]", "is no answer of this version"),
    ],
    ids=["deep", "digits", "bare", "large", "list"],
)
def test_a_file_that_is_no_answer_is_one_line(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=said) as fault:
        um.read_answer(written(tmp_path / "crane", text))
    assert str(fault.value).startswith(f"{tmp_path}/crane/diagnosis.json: ")


def test_what_is_nested_beside_the_schema_is_refused_or_read(tmp_path: Path) -> None:
    for depth in (100, 400, 700, 900):
        text = json.dumps(whole())[:-1] + ', "more": ' + "[" * depth + "]" * depth + "}"
        try:
            told(written(tmp_path / "crane", text))
        except BadInput as fault:
            assert "nested too deeply" in str(fault)
