"""The ruler that scores two entrants by classes and kinds, and tells how much of a difference is chance."""

from pathlib import Path
from typing import Any

import pytest
from hydra.core.override_parser.overrides_parser import OverridesParser

from benchmarks.withheld.ruler import in_words, main, of_words, overrides, scored
from unmodelled.base.errors import BadInput
from unmodelled.base.files import write_json

JOINT, SENSOR = "joint", "sensor:q"


def planted(family: str, channel: str = JOINT, **more: Any) -> dict[str, Any]:
    return {"family": family, "channel": channel, "alike": [], "material": True, **more}


def truth(*effects: dict[str, Any], verdict: str = "effect", chain: bool = False) -> dict[str, Any]:
    tolerated = [{"family": "sensor_lag", "channel": SENSOR}] if chain else []
    return {"effects": list(effects), "verdict": verdict, "tolerated": tolerated, "acts_at": {}}


def said(verdict: str, *effects: tuple[str, str], like: tuple[tuple[str, str], ...] = ()) -> dict[str, Any]:
    alike = [{"family": f, "port": p} for f, p in like]
    each = [{"family": f, "port": p, "indistinguishable": alike} for f, p in effects]
    return {"verdict": verdict, "effects": each, "confidence": 0.5}


COULOMB, DRAG = ("coulomb_friction", JOINT), ("quadratic_drag", JOINT)
LATE = ("sensor_delay", SENSOR)
ONE, TWO = truth(planted(COULOMB[0])), truth(planted(COULOMB[0]), planted(DRAG[0]))


@pytest.mark.parametrize(
    ("case", "answer", "wanted"),
    [
        (ONE, said("effect", COULOMB), {"first": True, "about": True, "right": True}),
        (ONE, said("effect", ("hysteresis", JOINT), like=(COULOMB,)), {"first": True, "right": True}),
        (ONE, said("effect", ("hysteresis", JOINT)), {"first": False, "about": True, "right": False}),
        (ONE, said("effect", ("coulomb_friction", "hub")), {"first": False, "about": False}),
        (ONE, said("effect", DRAG, like=(LATE, LATE, LATE, COULOMB)), {"first": False}),  # a fifth one
        (ONE, said("unknown"), {"first": False, "right": False}),
        (truth(planted("sensor_lag", SENSOR)), said("effect", LATE), {"first": True, "about": True}),
        (TWO, said("effect", COULOMB, DRAG), {"exact": True, "material": True, "right": True}),
        (TWO, said("main_effect", DRAG), {"exact": False, "material": False, "right": True}),
        (truth(verdict="no_gap"), said("no_gap"), {"first": None, "right": True}),
        (truth(verdict="no_gap"), said("main_effect", DRAG), {"right": False}),
        (truth(verdict="no_gap", chain=True), said("effect", LATE), {"right": True}),
        (truth(verdict="no_gap", chain=True), said("main_effect", LATE), {"right": False}),
        (truth(planted("x"), verdict="unknown", chain=True), said("main_effect", LATE), {"right": True}),
        (truth(planted("x"), verdict="unknown"), said("main_effect", DRAG), {"right": False}),
    ],
)
def test_an_answer_is_scored_by_classes(
    case: dict[str, Any], answer: dict[str, Any], wanted: dict[str, bool | None]
) -> None:
    found = scored(case, answer)
    assert {key: found[key] for key in wanted} == wanted


@pytest.mark.parametrize(
    ("text", "families", "verdicts"),
    [
        ("dry friction at the hinge. A sensor_gain is wrong", {"coulomb_friction"}, set[str]()),
        ("viscous friction any variant; quadratic_drag listed as alike", {"viscous_friction"}, set[str]()),
        ("`no_gap`, or `unknown`. An end_stop would be a false alarm", set[str](), {"no_gap", "unknown"}),
    ],
)
def test_words_on_a_measured_machine_name_what_is_right(
    text: str, families: set[str], verdicts: set[str]
) -> None:
    assert in_words(text) == (families, verdicts)
    answers = (said("effect", ("coulomb_friction", "hinge")), said("no_gap"))
    rights = [of_words(text, answer)["right"] for answer in answers]
    assert rights == ["coulomb_friction" in families, "no_gap" in verdicts]


def test_two_entrants_are_compared_on_the_cases_of_both(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answers = {"unmodelled": said("effect", DRAG), "file": said("effect", COULOMB)}
    for case in ("a", "b"):
        write(tmp_path / "truth" / case / "truth.json", ONE)
        for name, answer in answers.items():
            write(tmp_path / "answers" / name / case / "answer.json", answer)
            row = {"case": case, "kind": "single", "error": "", "cpu": 2.0, "truth": "t", "said": "s"}
            write(tmp_path / "rows" / name / f"{case}.json", {**row, "confidence": 0.9})
    main(["unmodelled", "file", f"out={tmp_path}"])
    lines = capsys.readouterr().out.splitlines()
    (first,) = [line for line in lines if "right class first" in line]
    assert "0 of 2: 0 %" in first and "2 of 2: 100 %" in first and "| 0 | 2 |" in first
    (wrong,) = [line for line in lines if "confidently wrong" in line]
    assert "2 of 2" in wrong and "0 of 2" in wrong
    assert [line.split("|")[1].strip() for line in lines if line.endswith("| new |")] == ["a", "b"]


def write(path: Path, content: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_json(path, content)


@pytest.mark.parametrize("words", [["unmodelled"], ["unmodelled", "file", "seed=3"], ["unmodelled", "file"]])
def test_words_that_compare_nothing_are_refused(words: list[str], tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"^ruler: "):
        main([*words, f"out={tmp_path}"])


def test_an_entrant_may_have_words() -> None:
    keys = overrides("planted:7052:3", 3, "old:.+seed=1", Path("a folder"))
    found = OverridesParser.create().parse_overrides(keys)
    assert {o.key_or_group: o.value() for o in found if o.key_or_group != "case"} == {
        "cases": "planted:7052:3",
        "entrant": "old:.+seed=1",
        "out": "a folder",
    }
