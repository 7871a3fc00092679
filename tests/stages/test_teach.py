"""The tutorial on a small bench: its tables, what they show, and bad input."""

import json
import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from pipeline.rigs.tutorial import TutorialCampaign
from pipeline.stages.acquire import acquire
from pipeline.stages.teach import teach
from unmodelled.base.errors import BadInput
from unmodelled.learning.structures import black_box, physics_only
from unmodelled.learning.windows import Windows

INPUTS = ["theta", "omega", "torque"]
SYSTEM = Path(__file__).parents[2] / "systems" / "pendulum.yaml"


def settings(raw: Path, out: Path) -> dict[str, Any]:
    return {
        **{"raw": raw, "system": SYSTEM, "out": out / "tables" / "tutorial", "reports": out / "reports"},
        "models": {"physics": physics_only(), "black_box": black_box(hidden=8, inputs=INPUTS)},
        "windows": Windows(10, 3, 200, 0.01, 0.01),
        **{"trained": 2, "repeats": 2, "hidden": [1, 32], "penalty": 1.0, "seeds": 2, "seed": 0},
    }


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("tutorial")
    acquire(TutorialCampaign(runs=3, far_runs=2), 0, out / "raw")
    teach(**settings(out / "raw", out))
    return out


def table(folder: Path, name: str) -> pd.DataFrame:
    return pd.read_parquet(folder / "tables" / "tutorial" / f"{name}.parquet")


def test_a_network_is_better_inside_and_worse_outside(folder: Path) -> None:
    found = json.loads((folder / "reports" / "metrics" / "chapter2.json").read_text())
    assert found["data"] == "virtual" and found["revision"]
    rmse = {
        region: {m: leaf["rmse"]["value"] for m, leaf in models.items()}
        for region, models in found["efficiency"].items()
    }
    assert rmse["inside"]["network"] < rmse["inside"]["physics"] < 0.01
    assert rmse["outside"]["network"] > 2 * rmse["outside"]["physics"]
    assert found["motor"]["resistance"]["value"] == pytest.approx(5.0, abs=0.3)  # warm, and all else in it


def test_every_network_has_a_curve_and_errors(folder: Path) -> None:
    errors, curves = table(folder, "network_errors"), table(folder, "networks")
    keys = ["hidden", "penalty", "seed"]
    assert len(errors) == 8 == len(curves[keys].drop_duplicates())
    assert len(curves) == 8 * len(table(folder, "truth"))
    free = errors[errors["penalty"] == 0.0].groupby("hidden")[["training", "new"]].median()
    assert free.loc[32, "training"] < 0.1 * free.loc[1, "training"]
    assert free.loc[32, "new"] > 10 * free.loc[32, "training"]


def test_models_are_judged_on_runs_they_have_not_seen(folder: Path) -> None:
    errors, forecasts = table(folder, "swing_errors"), table(folder, "forecasts")
    assert set(errors["id"]) == {"explored_run3", "unseen_run1", "unseen_run2"} == set(forecasts["id"])
    assert len(errors) == 2 * 2 * 3 and set(forecasts["fold"]) == {"repeat 1", "repeat 2"}
    inside = forecasts.groupby("group")["explored"].mean()
    assert inside["explored"] > 0.7 and inside["unseen"] < 0.6
    physics = errors[errors["model"] == "physics"].groupby("id")["rmse"]
    assert (physics.max() / physics.min() - 1.0).max() < 0.01  # random is the order of its windows only


def test_claims_and_equations_are_written(folder: Path) -> None:
    out = folder / "tables" / "tutorial"
    rows = json.loads((out / "claims.json").read_text())
    names = ["static_inside", "static_outside", "dynamic_explored", "dynamic_unseen"]
    assert [row["id"] for row in rows] == names
    assert {row["data"] for row in rows} == {"virtual"}
    block = json.loads((out / "equations.json").read_text())
    assert block["chapter"] == 2 and block["rows"][0]["text"] == "omega"


@pytest.mark.parametrize("trained", [0, 3])
def test_runs_to_train_on_and_to_hold_out_are_needed(trained: int, folder: Path, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=f"trained: must be 1 to 2, got {trained}"):
        teach(**{**settings(folder / "raw", tmp_path), "trained": trained, "hidden": [1], "seeds": 1})
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("file", ["bench.json", "training.csv", "truth.csv"])
def test_a_missing_file_is_named(file: str, folder: Path, tmp_path: Path) -> None:
    raw = shutil.copytree(folder / "raw", tmp_path / "raw")
    (raw / file).unlink()
    with pytest.raises(BadInput, match=f"{file}: [Nn]o such file"):
        teach(**settings(raw, tmp_path / "out"))
    assert not (tmp_path / "out").exists()
