"""One more experiment on withheld cases: the rig measures what was designed, and the table counts it."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.rigs.withheld.campaign import WithheldCampaign
from pipeline.rigs.withheld.cases import Case
from pipeline.rigs.withheld.experiments import run
from pipeline.stages import propose_withheld as proposing
from pipeline.stages.acquire import acquire
from pipeline.stages.tabulate_proposals import tabulate_proposals
from pipeline.withheld.proposals import write_limits
from tests.evaluation.withheld_cases import diagnosis, effect
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json, write_json
from unmodelled.design.limits import read_limits
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system

#: Of cases that begin with a hoist with Stribeck friction.
SEED, FIRST = 1566, "single_001"


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("withheld") / "single"
    acquire(WithheldCampaign("single", 1, SEED), 0, folder)
    return folder


def test_the_truth_gives_the_case_back(cases: Path) -> None:
    case = Case.of(read_json(cases / FIRST / "truth.json"))
    made = run(case)
    logs = read_logs(cases / FIRST / "logs", read_system(cases / FIRST / "system.yaml"))
    assert made.plan.runs == len(logs)
    for k, name in enumerate(logs.outputs):
        np.testing.assert_allclose(made.outputs[name].T.ravel(), logs.y[:, k], rtol=1e-7, atol=1e-9)


def test_limits_are_those_of_the_logs(cases: Path, tmp_path: Path) -> None:
    system = read_system(cases / FIRST / "system.yaml")
    logs = read_logs(cases / FIRST / "logs", system)
    write_limits(system, logs, tmp_path / "limits.yaml")
    limits = read_limits(tmp_path / "limits.yaml", system, logs)
    assert limits.samples == np.diff(logs.offsets)[0]
    assert (limits.inputs[0].low, limits.inputs[0].high) == (logs.u.min(), logs.u.max())
    x = logs.y[:, logs.outputs.index("x")]
    assert limits.travel["x"].low < x.min() < limits.start["x"] < x.max() < limits.travel["x"].high


def test_the_machine_of_the_case_runs_the_experiment(
    cases: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    system = read_system(cases / FIRST / "system.yaml")
    before = read_logs(cases / FIRST / "logs", system)
    u = before.u[before.rows(0)]

    def design(*_: Any) -> Any:
        return SimpleNamespace(found=SimpleNamespace(u=u), references={"chirp": None, "random": 0.9 * u})

    monkeypatch.setattr(proposing, "design", design)
    write_json(tmp_path / "diagnoses" / f"{FIRST}.json", {})
    proposing.propose_withheld(cases, tmp_path / "diagnoses", 2, 0, 1, tmp_path / "out")
    assert read_json(tmp_path / "out" / "notes" / f"{FIRST}.json")["measured"] == ["proposed", "random"]
    assert not (tmp_path / "out" / "chirp" / FIRST).exists()
    after = read_logs(tmp_path / "out" / "proposed" / FIRST / "logs", system)
    assert after.ids[: len(before)] == before.ids and len(after) == len(before) + 2
    np.testing.assert_array_equal(after.y[: len(before.y)], before.y)
    new = after.rows(len(before))
    np.testing.assert_allclose(after.u[new], u, rtol=1e-8)
    # the two repetitions have noise of their own
    one, two = (after.y[after.rows(k), 0] for k in (len(before), len(before) + 1))
    assert 0.0 < np.std(np.diff(one - two)) < 0.1 * np.std(one)

    def refused(*_: Any) -> Any:
        raise BadInput(f"{tmp_path}: no experiment")

    monkeypatch.setattr(proposing, "design", refused)
    proposing.propose_withheld(cases, tmp_path / "diagnoses", 2, 1, 1, tmp_path / "none")
    note = read_json(tmp_path / "none" / "notes" / f"{FIRST}.json")
    assert note["measured"] == [] and "no experiment" in note["why"]


def test_the_table_counts_named_and_listed_effects(cases: Path, tmp_path: Path) -> None:
    rail = effect("stribeck_friction", "rail", parameters={"F_c": {"interval": [1.0, 1.2]}})
    narrow = rail | {"parameters": {"F_c": {"interval": [1.0, 1.05]}, "F_s": {"interval": [None, 1.0]}}}
    alike = rail | {"indistinguishable": [{"family": "coulomb_friction", "port": "rail"}]}
    seen = {"oracle": {"seen": [True], "gap_seen": True, "shrink": 0.9}, "sparse_regression": None}
    write_json(tmp_path / "refits" / f"{FIRST}.json", seen)
    write_json(tmp_path / "first" / f"{FIRST}.json", diagnosis(alike))
    write_json(tmp_path / "again" / "proposed" / f"{FIRST}.json", diagnosis(narrow))
    tabulate_proposals(
        cases, tmp_path / "first", tmp_path / "refits", tmp_path / "again", tmp_path / "reports"
    )
    table = pd.read_csv(tmp_path / "reports" / "tables" / "proposals.csv")
    sizes = table[table["measure"] == "set_size"].set_index("experiment")["value"]
    assert sizes.to_dict() == {"none": 2.0, "proposed": 1.0, "chirp": 2.0, "random": 2.0}
    widths = table[table["measure"] == "width"].set_index("experiment")["value"]
    assert widths.to_dict() == pytest.approx({"none": 1.0, "proposed": 0.25, "chirp": 1.0, "random": 1.0})
    missed = pd.read_csv(tmp_path / "reports" / "tables" / "proposals_misses.csv")
    assert list(missed["experiment"]) == ["none", "chirp", "random"]
