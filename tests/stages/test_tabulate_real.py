"""Diagnoses of measured machines become numbers and tables; what is damaged is named."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import yaml

from pipeline.stages.tabulate_real import tabulate_real
from tests.conftest import stages
from unmodelled.base.errors import BadInput

ROOT = Path(__file__).parents[2]
FRICTION = {
    "family": "coulomb_friction",
    "port": "rail",
    "law": "F_c*sign(v)",
    "parameters": {"F_c": {"value": 20.0, "unit": "N", "interval": [19.0, 21.0]}},
    "confidence": 0.9,
    "shrink": 0.95,
    "indistinguishable": [{"family": "stribeck_friction", "port": "rail"}],
}
LEVEL = {"factor": "group", "level": "pulses"}


def diagnosis(**changes: Any) -> dict[str, Any]:
    found = {
        "schema": "diagnosis/1",
        "verdict": "effect",
        "confidence": 0.8,
        "effects": [FRICTION],
        "where": {
            "channels": [{"port": "rail", "share": 0.96}],
            "regions": [{"signal": "v", "low": -0.02, "high": 0.02, "share": 0.61}],
            "factors": [{**LEVEL, "share": 0.5}, {"factor": "m", "level": 1.25, "share": 0.25}],
            "experiments": [{"id": "plain_1", "known": 0.3, "augmented": 0.02}],
        },
        "gap": {
            **{"known": 0.31, "reidentified": 0.2, "augmented": 0.05, "neural": None, "floor": 0.01},
            **{"shrink": 0.94, "interval": [0.9, 0.97], "held_out": ["plain_1", "pulses_2"]},
        },
        "parameters": {"M": {"known": 95.0, "identified": 94.0, "interval": None}},
        "notes": ["v was estimated"],
    }
    return {**found, **changes}


def put(path: Path, content: Any) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content if isinstance(content, str) else json.dumps(content))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    put(tmp_path / "diagnoses" / "emps" / "coulomb_withheld" / "diagnosis.json", diagnosis())
    nothing = diagnosis(verdict="unknown", effects=[{**FRICTION, **LEVEL, "partial": True}])
    put(tmp_path / "diagnoses" / "emps" / "nothing_withheld" / "diagnosis.json", nothing)
    put(tmp_path / "raw" / "emps" / "provenance.json", {"data": "measured"})
    return tmp_path


def tabulate(folder: Path) -> Path:
    tabulate_real(folder / "diagnoses", folder / "raw", "quick", folder / "reports")
    return folder / "reports"


def test_numbers(folder: Path) -> None:
    content = json.loads((tabulate(folder) / "metrics" / "real.json").read_text())
    assert content["data"] == "measured" and content["profile"] == "quick" and content["revision"]
    assert set(content["emps"]) == {"coulomb", "nothing"}
    found = content["emps"]["coulomb"]
    assert found["verdict"] == {"value": "effect", "n": 2}
    assert found["effects"]["value"] == "coulomb_friction at rail: F_c*sign(v)"
    assert found["shrink"] == {"value": 0.94, "unit": "1", "interval": [0.9, 0.97], "n": 2}
    assert found["remainder"]["value"] == pytest.approx(5.0)
    assert "neural" not in found["gap"] and found["gap"]["reidentified"]["value"] == 0.2
    other = content["emps"]["nothing"]["effects"]["value"]
    assert other == "coulomb_friction at rail: F_c*sign(v) where group = pulses (partial)"


def test_tables(folder: Path) -> None:
    tables = tabulate(folder) / "tables"
    said = pd.read_csv(tables / "emps.csv").set_index("withheld")
    assert said.loc["coulomb", "not told apart from"] == "stribeck_friction at rail"
    assert said.loc["nothing", "verdict"] == "unknown" and said["neural"].isna().all()
    numbers = pd.read_csv(tables / "emps_numbers.csv").set_index(["withheld", "parameter"])
    assert numbers.loc[("coulomb", "F_c"), "of"] == "coulomb_friction at rail"
    assert numbers.loc[("coulomb", "M"), "given"] == 95.0 and numbers["low"].count() == 2
    left = pd.read_csv(tables / "emps_left_over.csv")
    assert left[left["withheld"] == "coulomb"]["where"].tolist() == [
        *("rail", "v from -0.02 to 0.02", "group = pulses", "m = 1.25", "plain_1", "v was estimated")
    ]
    about = json.loads((tables / "emps.json").read_text())
    assert about["data"] == "measured" and about["chapter"] is None and about["title"]


@pytest.mark.parametrize(
    ("name", "content", "complaint"),
    [
        ("diagnoses/emps/coulomb_withheld/diagnosis.json", "{", "not a JSON file"),
        (
            "diagnoses/emps/coulomb_withheld/diagnosis.json",
            {"schema": "x"},
            "schema: must be one of diagnosis/1, got 'x'",
        ),
        ("raw/emps/provenance.json", None, "provenance.json: no such file"),
    ],
)
def test_a_damaged_input_is_named(name: str, content: Any, complaint: str, folder: Path) -> None:
    (folder / name).unlink()
    if content is not None:
        put(folder / name, content)
    with pytest.raises(BadInput, match=complaint):
        tabulate(folder)
    assert not (folder / "reports").exists()


def test_no_diagnosis_at_all(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"no \*/\*_withheld/diagnosis\.json"):
        tabulate(tmp_path)


def test_the_graph_diagnoses_every_system_file_and_only_where_data_are_at_hand() -> None:
    params = yaml.safe_load((ROOT / "params.yaml").read_text())
    graph = stages()
    for machine in params["machines"]:
        files = sorted((ROOT / "systems" / machine).glob("*.yaml"))
        assert files and all(path.stem.endswith("_withheld") for path in files)
        assert (ROOT / "conf" / "source" / f"{machine}.yaml").exists()
    assert graph["diagnose_real"]["matrix"]["machine"] == "${machines}"
    for name in ("acquire_real", "diagnose_real", "tabulate_real"):
        assert graph[name]["matrix"]["data"] == "${real}"
