"""Chapter 5 from features to claims, on a small campaign, and what a kill leaves."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.cam_follower.sequence import recipe as recipes
from tests.stages.jump_stages import evaluate, train
from unmodelled.base.campaign import Campaign

pytestmark = pytest.mark.long


def test_tables_hold_what_was_not_trained_on(root: Path, jump_campaign: Campaign) -> None:
    runs = pd.read_parquet(root / "tables/runs.parquet")
    counts = runs[runs["model"] == "tau1"].groupby(["split", "fold"]).size()
    assert counts["uniform"].to_dict() == {"5%": 37, "30%": 27, "50%": 19}
    assert set(counts["factors"].index) == {"H", "beta", "m"}
    table = jump_campaign.experiments
    unseen = runs[(runs["fold"] == "H") & (runs["model"] == "tau4")]
    assert set(unseen["exp"]) == set(table.loc[(table["H"] == 0.03) & (table["label"] != "stall"), "exp"])
    assert set(runs.loc[runs["split"] == "scarce", "model"]) == {f"tau{k}_blind" for k in (1, 2, 3, 4)}
    repeats = pd.read_parquet(root / "tables/repeats.parquet")
    counts = repeats.groupby("model")["repeat"].unique().map(list).to_dict()
    # nothing is drawn at random in the simulation
    assert counts.pop("bounce") == [0] and list(counts.values()) == [[0, 1]] * 9
    assert len(repeats) == 2 * len(runs) - (runs["model"] == "bounce").sum()


def test_metrics_are_those_of_the_contract(root: Path) -> None:
    chapter = json.loads((root / "reports/metrics/chapter5.json").read_text())
    assert (chapter["data"], chapter["profile"]) == ("virtual", "quick")
    models = {"tau1", "tau2", "tau3", "tau4"}
    for percent in ("5", "30", "50"):
        for model in models:
            assert set(chapter["uniform"][percent][model]) == {"mse_jump", "mse_all", "accuracy"}
    for factor in ("H", "beta", "m"):
        assert models <= set(chapter["split"][factor])
    for place in (chapter["baseline"]["bounce"], chapter["hybrid"]):
        assert {"mse_jump", "mse_all", "accuracy", "uniform", "split"} <= set(place)
    assert 0.5 < chapter["baseline"]["f_dagger"]["accuracy"]["value"] <= 1.0
    found = chapter["attribution"]
    assert found["local_accuracy_max"]["value"] < 1e-9
    for model in models:
        assert sum(leaf["value"] for leaf in found["share"][model].values()) == pytest.approx(1.0)
    assert set(found["share"]["tau4"]) == {"F_dagger", "h", "h_dot", "h_ddot", "m", "H", "beta"}
    rows = json.loads((root / "tables/claims.json").read_text())
    assert len(rows) == 6 and {row["chapter"] for row in rows} == {5}
    assert (root / "reports/tables/jumps.csv").read_text().startswith("split,fold,model,")


def test_trajectories_of_attributions_add_up_to_the_first_repeat(root: Path) -> None:
    phi, explained, examples = (
        pd.read_parquet(root / f"tables/{name}.parquet") for name in ("phi", "explained", "examples")
    )
    shown = examples[(examples["fold"] == "30%") & (examples["model"] == "tau2")]
    for exp, own in explained[explained["model"] == "tau2"].groupby("exp"):
        total = phi[(phi["model"] == "tau2") & (phi["exp"] == exp)].groupby("step")["phi"].sum()
        np.testing.assert_allclose(own["base"].to_numpy() + total.to_numpy(), own["output"], atol=1e-12)
        example = shown[shown["exp"] == exp]
        between = own["output"].to_numpy()
        assert len(example) == len(own)
        assert (between > example["low"] - 1e-6).all() and (between < example["high"] + 1e-6).all()
    assert set(explained["exp"]) == set(shown.loc[shown["label"] == "jump", "exp"])


def test_exact_values_have_the_angle_as_one_player(root: Path) -> None:
    exact = pd.read_parquet(root / "attributions/exact.parquet")
    own = exact[(exact["model"] == "tau1") & (exact["method"] == "exact")]
    assert own["feature"].tolist() == ["theta", "omega", "alpha", "m", "H", "beta"]
    assert own["share"].sum() == pytest.approx(1.0)
    assert "theta" not in set(exact.loc[exact["model"] == "tau4", "feature"])


def test_a_model_alone_is_the_same_as_among_others(root: Path, tmp_path: Path) -> None:
    train(root, "tau4", "scarce", out=root / "fits/tau4/scarce")
    evaluate(root, "tau4", "scarce", out=tmp_path / "prediction")
    alone = pd.read_parquet(tmp_path / "prediction/runs.parquet")
    runs = pd.read_parquet(root / "tables/runs.parquet")
    family = runs[(runs["fold"] == "5%") & (runs["model"] == "tau4") & (runs["split"] == "uniform")]
    # the same fold and seeds, whatever else is trained beside
    np.testing.assert_array_equal(alone["mse"], family["mse"])
    shutil.rmtree(root / "fits/tau4")


def test_a_killed_training_goes_on(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    saved, save = [], recipes.save_fit

    def killed(path: Path, *rest: Any) -> None:
        if len(saved) == 3:
            raise KeyboardInterrupt
        saved.append(path)
        save(path, *rest)

    monkeypatch.setattr(recipes, "save_fit", killed)
    with pytest.raises(KeyboardInterrupt):
        train(root, "detachment_blind", "scarce", out=tmp_path / "fit")
    assert not (tmp_path / "fit/fit.json").exists()
    monkeypatch.setattr(recipes, "save_fit", save)
    before = {path: path.read_bytes() for path in saved}
    train(root, "detachment_blind", "scarce", out=tmp_path / "fit")
    assert before == {path: path.read_bytes() for path in saved}
    assert len([*(tmp_path / "fit").glob("*/*.pt")]) == 8
