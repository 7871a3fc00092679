"""An answer does not contradict itself: titles, terminal, tables and notes say one thing."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.diagnosis.diagnoses import FRICTION, Said, diagnosis, known
from tests.diagnosis.studies import HORIZON, JOINT
from tests.machines.folders import changed
from unmodelled.base.sure_numbers import REMARKS, doubt
from unmodelled.diagnosis.answer import diagnose as story
from unmodelled.diagnosis.answer.augmented import FILE, write_augmented, write_changes
from unmodelled.diagnosis.answer.sentences import sentences
from unmodelled.diagnosis.answer.summary import summary
from unmodelled.diagnosis.data.result import DiagnosedEffect, Diagnosis, LogFault, Verdict
from unmodelled.diagnosis.where.where import where
from unmodelled.report.answers import _main_amount
from unmodelled.report.diagnosis_tables import identified_table, parameter_tables
from unmodelled.report.headline import headline, outcome
from unmodelled.systems.reader import read_system

ROWS = sorted((Path(__file__).parents[2] / "docs" / "decisions").glob("001[56]/*.jsonl"))
#: Laws with one number, with words of their own, and with a number without unit.
LAWS = [
    FRICTION,
    Said("backlash", JOINT, {"F_b": 0.2, "delta": 0.01}, "friction"),
    Said("actuator_gain", replace(JOINT, kind="actuator", name="torque"), {"g": 0.07}),
]
SIZES = {"zero": (-0.1, 0.4), "effort": (0.9, 1.1), "": (0.9, 1.1)}


def doubted(found: Diagnosis, kind: str) -> Diagnosis:
    """The diagnosis with a remark of a kind on every number of its effects."""

    def one(effect: DiagnosedEffect) -> DiagnosedEffect:
        ends = SIZES.get(kind, SIZES["effort"])
        each = {
            n: replace(e, interval=(ends[0] * e.value, ends[1] * e.value), remarks=(kind,) if kind else ())
            for n, e in effect.estimates.items()
        }
        return replace(effect, estimates=each)  # type: ignore[arg-type]

    return replace(found, effects=tuple(map(one, found.effects)))


def content_of(found: Diagnosis) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(json.dumps(summary(found, where(found))))
    return content


@pytest.fixture(scope="module", params=range(len(LAWS)))
def named(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    return diagnosis(tmp_path_factory.mktemp("case"), LAWS[request.param])


@pytest.mark.parametrize("kind", ["", *(kind for kind in REMARKS if kind not in ("sign", "common_factor"))])
def test_a_number_with_a_remark_is_not_in_a_title(named: Diagnosis, kind: str) -> None:
    content = content_of(doubted(named, kind))
    (effect,) = content["effects"]
    titles = [headline(content), outcome(content), _main_amount(effect)]
    told = [line for line in sentences(content) if line.startswith(("- ", "    "))]
    assert bool(doubt(effect)) == bool(kind)
    assert ("text" in effect) == bool(named.effects[0].added.phrase and not kind)
    for title in titles[: 3 if kind else 0]:
        assert "size uncertain" in title or "size implausible" in title
    if kind == "zero":
        assert all(re.search(r"size uncertain: \S+ to \S", title) for title in titles)
    assert bool(kind) == any("size " in line for line in told if line.startswith("- "))
    numbers = [line for line in told if " = " in line]
    assert all(bool(kind) == (REMARKS.get(kind, "?") in line) for line in numbers) and numbers
    (table,) = parameter_tables(content)
    assert all(bool(kind) == (REMARKS.get(kind, "?") in row[0].note) for row in table.rows)


def test_a_remark_on_a_parameter_is_beside_its_number(tmp_path: Path) -> None:
    found = diagnosis(tmp_path, FRICTION)
    found = replace(found, parameters={"b": replace(found.parameters["b"], remarks=("sign",))})
    content = content_of(found)
    (line,) = (line for line in sentences(content) if line.startswith("b = "))
    assert line.endswith("in the system file, changed its sign")
    assert identified_table(content, {}).rows[0][0].note == "changed its sign"


def test_an_effect_that_pays_only_with_another_one_says_so(tmp_path: Path) -> None:
    load = Said("constant_load", JOINT, {"F_0": 0.1})
    found = diagnosis(tmp_path, FRICTION, load)
    small, large = found.effects
    small = replace(small, shrink=0.0, only_with=(large.added,))
    content = content_of(replace(found, effects=(replace(large, shrink=0.9, step=1), small)))
    lines = [line for line in sentences(content) if line.startswith("- ")]
    assert [line.split(" at ")[0] for line in lines] == ["- Constant load", "- Coulomb friction"]
    assert (
        "explains 0 % of the squared gap above the noise floor by itself, and pays only together " in lines[1]
    )
    assert "only together" not in lines[0]


@pytest.mark.parametrize("verdict", ["no_gap", "unknown"])
def test_a_right_model_raises_no_alarm(
    verdict: Verdict, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    system, logs = known(tmp_path)
    found = replace(diagnosis(tmp_path), verdict=verdict)

    def pushed(_: object, alarm: bool) -> LogFault:
        told = "run1 needs 0.3 N m, then diagnose again" if alarm else "run1 needs 0.3 N m"
        return LogFault(("joint",), "outside_force", 0.4, ("run1",), told, False)

    monkeypatch.setattr(story, "diagnose_gap", lambda *_: found)
    monkeypatch.setattr(story, "outside_forces", pushed)
    content = story.findings(system, logs, HORIZON).content
    lines = sentences(content)
    if verdict == "unknown":
        assert lines[0].startswith("run1 needs") and content["logs"] and "chance: " in "\n".join(lines)
        return
    assert not content["logs"] and content["notes"][-1] == "run1 needs 0.3 N m"
    assert lines[0].startswith("verdict: no gap that matters") and "chance: " not in "\n".join(lines)
    assert not any("diagnose again" in line for line in lines)


@pytest.mark.parametrize("file", ROWS, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_saved_answers_name_effects_where_the_verdict_does_and_none_twice(file: Path) -> None:
    rows = [row for row in map(json.loads, file.read_text().splitlines()) if "verdict" in row]
    for row in rows:
        assert (row["verdict"] in ("effect", "main_effect")) == bool(row["named"]), row["case"]
        said = re.sub(r" \(or \d+ more\)", "", row["said"]).split(" + ")
        assert len(set(said)) == len(said), row["case"]


def test_the_file_is_that_of_the_user_with_a_few_lines_changed(tmp_path: Path) -> None:
    """Comments, numbers and order stay; the first lines say from which answer it came, and when."""
    found = diagnosis(tmp_path, FRICTION)
    file = tmp_path / "system.yaml"
    changes = ("parameters:", "# by hand\nparameters:  # of the drawing"), ("value: 0.02", "value: 2.0e-2")
    file.write_text(changed(file.read_text(), *changes))
    write_augmented(found, tmp_path / "out", "2026-12-01")
    write_augmented(replace(found, system=replace(found.system, source="")), tmp_path / "plain")
    lines = (tmp_path / "out" / FILE).read_text().splitlines()
    assert read_system(tmp_path / "out" / FILE) == read_system(tmp_path / "plain" / FILE)
    assert lines[0].startswith("# pendulum with Coulomb friction at joint (confidence ")
    assert lines[1] == "# from the answer beside this file, the diagnosis of system.yaml and logs, 2026-12-01"
    write_changes(found, tmp_path / "out", tmp_path / "changes.diff")
    told = (tmp_path / "changes.diff").read_text().splitlines()[2:]
    added, removed = ([line[1:].strip() for line in told if line[0] == sign] for sign in "+-")
    assert [line.split(":")[0] for line in removed] == ["joint"]
    assert [line.split(":")[0] for line in added[2:]] == ["F_c", "v_c", "joint"]
    assert {"# by hand", "parameters:  # of the drawing"} <= set(lines)
    assert any("value: 2.0e-2" in line for line in lines)
