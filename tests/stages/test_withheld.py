"""The withheld check from cases to numbers, with diagnoses that are made up or real but small."""

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from pipeline.rigs.withheld.campaign import WithheldCampaign
from pipeline.stages import diagnose_withheld as diagnosing
from pipeline.stages.acquire import acquire
from pipeline.stages.refit_withheld import refit_withheld
from pipeline.stages.tabulate_withheld import tabulate_withheld
from tests.evaluation.withheld_cases import diagnosis, effect
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json, write_json

KINDS = ("single", "null")
#: Of cases that begin with a hoist, once with Stribeck friction and once without any fault.
SEED = 1566


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first case of two kinds."""
    folder = tmp_path_factory.mktemp("withheld")
    for kind in KINDS:
        acquire(WithheldCampaign(kind, 1, SEED), 0, folder / kind)
    return folder


def held_out(cases: Path, kind: str) -> list[str]:
    table = pd.read_csv(cases / kind / f"{kind}_001" / "logs" / "experiments.csv")
    return [str(name) for name in table["id"][:2]]


def said(cases: Path, kind: str) -> dict[str, Any]:
    """What a diagnosis may say of the first case."""
    verdicts = {"single": diagnosis(effect("stribeck_friction", "rail")), "null": diagnosis(verdict="no_gap")}
    content = verdicts[kind]
    return content | {"gap": content["gap"] | {"held_out": held_out(cases, kind)}}


def test_a_diagnosis_sees_no_truth_and_a_killed_run_goes_on(
    cases: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[str, ...]] = []

    def diagnosed(system: Any, logs: Any, horizon: float, seed: int, workers: int) -> str:
        asked.append((system.name, len(logs), horizon, seed, workers))
        return "found"

    for name, function in (("diagnose_gap", diagnosed), ("where", lambda found: f"where {found}")):
        monkeypatch.setattr(diagnosing, name, function)
    monkeypatch.setattr(diagnosing, "summary", lambda found, where: {"found": found, "where": where})
    real, out = cases / "single", tmp_path / "out"
    (tmp_path / "cases").mkdir()
    for k in (1, 2):
        (tmp_path / "cases" / f"single_{k:03d}").symlink_to(real / "single_001")
    write_json(tmp_path / "cases" / "provenance.json", {"sha256": "0"})
    opened: list[str] = []
    reading = Path.read_text
    monkeypatch.setattr(Path, "read_text", lambda self: opened.append(self.name) or reading(self))

    def killed(system: Any, logs: Any, horizon: float, seed: int, workers: int) -> str:
        if asked:
            raise KeyboardInterrupt
        return diagnosed(system, logs, horizon, seed, workers)

    monkeypatch.setattr(diagnosing, "diagnose_gap", killed)
    with pytest.raises(KeyboardInterrupt):
        diagnosing.diagnose_withheld(tmp_path / "cases", 0.1, 7, 1, out)
    assert not out.exists()
    monkeypatch.setattr(diagnosing, "diagnose_gap", diagnosed)
    diagnosing.diagnose_withheld(tmp_path / "cases", 0.1, 7, 1, out)
    assert asked == [("hoist", 9, 0.1, 7, 1)] * 2
    assert "truth.json" not in opened
    assert read_json(out / "single_002.json") == {"found": "found", "where": "where found"}
    cost = read_json(out / "costs" / "single_001.json")
    assert set(cost) == {"seconds", "memory"} and cost["memory"] > 10.0


@pytest.mark.long
def test_from_cases_to_numbers(cases: Path, tmp_path: Path) -> None:
    for kind in KINDS:
        write_json(tmp_path / "diagnoses" / kind / f"{kind}_001.json", said(cases, kind))
        cost = {"seconds": 20.0, "memory": 700.0}
        write_json(tmp_path / "diagnoses" / kind / "costs" / f"{kind}_001.json", cost)
    refit_withheld(cases, tmp_path / "diagnoses", 0.1, 1, tmp_path / "refits")
    found = read_json(tmp_path / "refits" / "single" / "single_001.json")["oracle"]
    assert found["seen"] == [True] and found["shrink"] > 0.9
    assert not read_json(tmp_path / "refits" / "null" / "null_001.json")["oracle"]["gap_seen"]
    tabulate_withheld(
        cases, tmp_path / "diagnoses", tmp_path / "refits", "quick", tmp_path / "out", tmp_path / "reports"
    )
    content = json.loads((tmp_path / "reports" / "metrics" / "withheld.json").read_text())
    assert (content["data"], content["profile"]) == ("virtual", "quick")
    assert content["single"]["top1"]["value"] == content["null"]["correct"]["value"] == 1.0
    assert content["systems"]["hoist"]["single"]["in_set"]["n"] == 1
    rows = pd.read_parquet(tmp_path / "out" / "cases.parquet")
    assert rows["right"].all() and set(rows["kind"]) == set(KINDS)
    assert (tmp_path / "reports" / "tables" / "withheld_misses.csv").read_text().count("\n") == 1
    assert "single.top1" in (tmp_path / "reports" / "tables" / "withheld.csv").read_text()


def test_a_case_without_diagnosis_is_refused(cases: Path, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"null_001\.json: no such file"):
        refit_withheld(cases, tmp_path / "diagnoses", 0.1, 1, tmp_path / "refits")
    with pytest.raises(BadInput, match="holds no campaign of withheld cases"):
        (tmp_path / "empty").mkdir()
        diagnosing.diagnose_withheld(tmp_path / "empty", 0.1, 0, 1, tmp_path / "out")
