"""Diagnoses of measured machines become numbers and tables; what is damaged is named."""

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from pipeline.chapters.known import KnownCase, read_machines
from pipeline.chapters.real import judged, said
from pipeline.stages.tabulate_real import tabulate_real
from tests.conftest import stages
from tests.report import case
from tests.report.case import put
from unmodelled.base.errors import BadInput
from unmodelled.effects.library import effects

ROOT = Path(__file__).parents[2]
NUMBER = {"value": 20.0, "unit": "N", "interval": [19.0, 21.0]}
FRICTION = {**case.FRICTION, "parameters": {"F_c": NUMBER}}
LEVEL = {"factor": "group", "level": "pulses"}


def diagnosis(**changes: Any) -> dict[str, Any]:
    found = case.diagnosis()
    found |= {"confidence": 0.8, "effects": [FRICTION], "comparison": [], "notes": ["v was estimated"]}
    found |= {"parameters": {"M": {"known": 95.0, "identified": 94.0, "interval": None}}}
    found["where"] |= {"factors": [{**LEVEL, "share": 0.5}, {"factor": "m", "level": 1.25, "share": 0.25}]}
    found["where"] |= {"experiments": [{"id": "plain_1", "known": 0.3, "augmented": 0.02}]}
    found["gap"] |= {"reidentified": 0.2, "augmented": 0.05, "neural": None, "floor": 0.01, "shrink": 0.94}
    found["gap"] |= {"interval": [0.9, 0.97], "held_out": ["plain_1", "pulses_2"]}
    return {**found, **changes}


def put_diagnosis(folder: Path, content: Any) -> None:
    put(folder / "diagnosis.json", content)
    put(folder / "tables" / "about.json", {"data": "measured"})


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    emps = tmp_path / "diagnoses" / "emps"
    put_diagnosis(emps / "coulomb_withheld", diagnosis())
    put_diagnosis(emps / "nothing_withheld", diagnosis(verdict="unknown", effects=[]))
    return tmp_path


def tabulate(folder: Path) -> Path:
    tabulate_real(folder / "diagnoses", ROOT / "systems", "quick", folder / "reports")
    return folder / "reports"


def test_numbers(folder: Path) -> None:
    content = json.loads((tabulate(folder) / "metrics" / "real.json").read_text())
    assert content["data"] == "measured" and content["profile"] == "quick" and content["revision"]
    assert set(content["emps"]) == {"coulomb", "nothing"}
    assert [content["cases"][name]["value"] for name in ("diagnosed", "holds", "harmful")] == [2, 2, 0]
    found = content["emps"]["coulomb"]
    assert found["verdict"] == {"value": "effect", "n": 2}
    assert found["effects"]["value"] == "coulomb_friction at rail: F_c*sign(v) (or stribeck_friction at rail)"
    assert found["shrink"] == {"value": 0.94, "unit": "1", "interval": [0.9, 0.97], "n": 2}
    assert found["remainder"]["value"] == pytest.approx(5.0)
    assert "neural" not in found["gap"] and found["gap"]["reidentified"]["value"] == 0.2
    other = content["emps"]["nothing"]["effects"]["value"]
    assert (content["emps"]["nothing"]["verdict"]["value"], other) == ("unknown", "none")


def test_an_effect_of_one_level_is_told_with_it() -> None:
    assert said(diagnosis(effects=[{**FRICTION, **LEVEL}])) == (
        "coulomb_friction at rail: F_c*sign(v) where group = pulses (or stribeck_friction at rail)"
    )


def test_tables(folder: Path) -> None:
    tables = tabulate(folder) / "tables"
    told = pd.read_csv(tables / "real.csv").set_index(["machine", "withheld"])
    assert told.loc[("emps", "coulomb"), "numbers inside"] == "1 of 1"
    assert told.loc[("emps", "viscous"), "verdict"] == "not diagnosed"
    assert "XL330=" in told.loc[("xl330", "friction"), "effects"]
    gaps = pd.read_csv(tables / "real_gaps.csv")
    assert gaps["neural"].isna().all() and gaps["withheld"].tolist() == ["coulomb", "nothing"]
    numbers = pd.read_csv(tables / "real_numbers.csv").set_index(["withheld", "of", "parameter"])
    friction = numbers.loc[("coulomb", "coulomb_friction at rail", "F_c")]
    assert (friction["reference low"], friction["inside"]) == (20.39, "yes")
    assert numbers.loc[("coulomb", "known physics", "M"), "given"] == 95.0
    assert numbers.loc[("coulomb", "known physics", "F_v"), "inside"] == "not identified"
    left = pd.read_csv(tables / "real_left_over.csv")
    where = ["rail", "v from -0.02 to 0.02", "group = pulses", "m = 1.25", "plain_1", "v was estimated"]
    assert left[left["withheld"] == "coulomb"]["where"].tolist() == where
    about = json.loads((tables / "real.json").read_text())
    assert about["data"] == "measured" and about["chapter"] is None and about["title"]


def test_without_any_diagnosis_every_case_says_how_to_give_its_data(tmp_path: Path) -> None:
    table = pd.read_csv(tabulate(tmp_path) / "tables" / "real.csv")
    cases = {f"{r.machine}/{r.withheld}" for r in table.itertuples()}
    files = (ROOT / "systems").glob("*/*_withheld.yaml")
    assert cases == {f"{path.parent.name}/{path.stem.removesuffix('_withheld')}" for path in files}
    assert (table["verdict"] == "not diagnosed").all() and table["effects"].str.contains("=").all()


RIGHT = KnownCase(
    "friction",
    frozenset({"effect", "main_effect"}),
    (frozenset({"coulomb_friction at rail"}), frozenset({"viscous_friction at rail"})),
    frozenset({"constant_load at rail"}),
    (),
)
VISCOUS = {**FRICTION, "family": "viscous_friction", "indistinguishable": []}
ELSEWHERE = {**VISCOUS, "port": "motor"}
MISPLACED = {"effects": [FRICTION, ELSEWHERE]}


@pytest.mark.parametrize(
    ("changes", "names", "places", "holds", "harmful", "failed"),
    [
        ({"effects": [FRICTION, VISCOUS]}, "2 of 2", "2 of 2", "yes", "no", ""),
        ({"effects": [FRICTION]}, "1 of 2", "1 of 2", "no", "no", "search: viscous_friction"),
        ({"effects": [FRICTION], "verdict": "main_effect"}, "1 of 2", "1 of 2", "yes", "no", ""),
        (MISPLACED, "2 of 2", "1 of 2", "no", "yes", "choice: viscous_friction at motor"),
        ({"effects": [], "verdict": "unknown"}, "0 of 2", "0 of 2", "no", "no", "search: coulomb_friction"),
        ({"effects": [], "verdict": "no_gap"}, "0 of 2", "0 of 2", "no", "yes", "noise floor"),
        ({"effects": [], "verdict": "check_logs"}, "0 of 2", "0 of 2", "no", "yes", "check of the logs"),
    ],
)
def test_judgement(
    changes: dict[str, Any], names: str, places: str, holds: str, harmful: str, failed: str
) -> None:
    row = judged(RIGHT, diagnosis(**changes))
    assert (row["names right"], row["places right"]) == (names, places)
    assert (row["holds"], row["harmful"]) == (holds, harmful)
    assert failed in row["failed at"] and bool(failed) == bool(row["failed at"])


def test_one_effect_stands_for_one_withheld_effect() -> None:
    either = {**FRICTION, "indistinguishable": [{"family": "viscous_friction", "port": "rail"}]}
    row = judged(RIGHT, diagnosis(effects=[either]))
    assert row["places right"] == "1 of 2"
    assert row["failed at"].startswith("choice: one effect is named in place of viscous_friction at rail")


def test_an_effect_that_was_fitted_and_not_chosen() -> None:
    viscous = [{"family": "viscous_friction", "port": "rail"}]
    tried = [
        {"effects": [FRICTION], "score": 0.9, "difference": 0.0, "standard_error": 0.0, "named": True},
        {"effects": viscous, "score": 1.4, "difference": 0.5, "standard_error": 0.1, "named": False},
        {"effects": [*viscous, ELSEWHERE], "score": 1.3, "difference": 0.4, "named": False},
    ]
    row = judged(RIGHT, diagnosis(effects=[FRICTION], comparison=tried))
    assert row["failed at"].endswith(
        "viscous_friction at rail was fitted, its score is 0.4 nats from that of the named candidate"
    )


@pytest.mark.parametrize(
    ("name", "content", "complaint"),
    [
        ("diagnosis.json", "{", "not a JSON file"),
        ("diagnosis.json", {"schema": "x"}, "schema: must be one of diagnosis/2, got 'x'"),
        ("tables/about.json", None, "about.json: no such file"),
    ],
)
def test_a_damaged_input_is_named(name: str, content: Any, complaint: str, folder: Path) -> None:
    (file := folder / "diagnoses/emps/coulomb_withheld" / name).unlink()
    if content is not None:
        put(file, content)
    with pytest.raises(BadInput, match=complaint):
        tabulate(folder)
    assert not (folder / "reports").exists()


def test_the_graph_diagnoses_the_machines_whose_data_are_given() -> None:
    graph, families = stages(), {effect.family for effect in effects()}
    make = (ROOT / "Makefile").read_text()
    for machine in read_machines(ROOT / "systems"):
        assert (ROOT / "conf" / "source" / f"{machine.name}.yaml").exists()
        assert f"{machine.name}:{machine.variable}" in make
        names = [name for case in machine.cases.values() for name in case.right]
        assert {name.partition(" at ")[0] for name in names} <= families
    for name in ("acquire_real", "diagnose_real"):
        assert graph[name]["matrix"]["machine"] == "${real}"
