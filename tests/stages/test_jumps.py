"""Chapter 5 from features to claims, on a small campaign; what is refused, and what a kill leaves."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import hydra
import numpy as np
import pandas as pd
import pytest
from hydra import compose, initialize_config_dir
from numpy.typing import NDArray
from omegaconf import DictConfig, OmegaConf

from pipeline.__main__ import CONF
from pipeline.errors import BadInput
from pipeline.learning.sequence import recipe as recipes
from pipeline.trajectory import Campaign

#: Enough to run everything, not to learn anything.
TINY = {
    "repeats": 2,
    "sequence_updates": 3,
    "bounce_members": 1,
    "explained_runs": 3,
    "references": 4,
    "exact_runs": 1,
    "exact_references": 2,
}
BOTH = "uniform_and_factors"
CELLS = {BOTH: "detachment", "scarce": "detachment_blind"}
#: The shares that claims and explanations are about.
SHARES = "split.folds.shares=[0.05,0.3,0.5]"


def call(verb: str, *overrides: str, **paths: Path) -> None:
    """Run a stage as the command line does."""
    with initialize_config_dir(str(CONF), version_base="1.3"):
        has_profile = "profile:" in (CONF / f"{verb}.yaml").read_text()
        tiny = [f"profile.{key}={value}" for key, value in TINY.items()] if has_profile else []
        few = [SHARES] if verb in ("attribute", "tabulate_jumps") else []
        few = [SHARES.replace("folds", "folds.parts.uniform.folds")] if f"split={BOTH}" in overrides else few
        config = compose(verb, [*tiny, *few, *overrides, f"out={paths['out']}"])
    OmegaConf.resolve(config)
    arguments: dict[str, Any] = {
        str(key): hydra.utils.instantiate(value) if isinstance(value, DictConfig) else value
        for key, value in config.items()
        if key != "_target_"
    }
    hydra.utils.get_method(config["_target_"])(**arguments | paths)


def train(root: Path, model: str, split: str, *overrides: str, out: Path | None = None) -> None:
    place = out or root / "fits" / model / split
    call("train", f"model={model}", f"split={split}", *overrides, features=root / "features", out=place)


def evaluate(root: Path, model: str, split: str, *overrides: str, out: Path | None = None) -> None:
    place, fits = out or root / "predictions" / model / split, root / "fits" / model / split
    call(
        "evaluate",
        f"model={model}",
        f"split={split}",
        *overrides,
        features=root / "features",
        fits=fits,
        out=place,
    )


def attribute(root: Path, *overrides: str, out: Path | None = None) -> None:
    fits = root / "fits" / "detachment" / BOTH
    call("attribute", *overrides, features=root / "features", fits=fits, out=out or root / "attributions")


def tabulate(root: Path, *overrides: str, out: Path | None = None) -> None:
    given = {name: root / name for name in ("features", "predictions", "attributions", "fits", "reports")}
    call("tabulate_jumps", *overrides, **given, out=out or root / "tables")


@pytest.fixture(scope="module")
def root(jump_campaign: Campaign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with features, fits, predictions, attributions, tables and reports."""
    root = tmp_path_factory.mktemp("jumps")
    jump_campaign.write(root / "features")
    for split, model in CELLS.items():
        train(root, model, split)
        evaluate(root, model, split)
    attribute(root)
    tabulate(root)
    return root


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
    assert (chapter["data"], chapter["profile"]) == ("virtual", "quick") and chapter["seconds"] > 0
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


def test_a_single_model_needs_no_family(root: Path, tmp_path: Path) -> None:
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


def copied(root: Path, name: str, to: Path) -> Path:
    """A copy of `root` in which the folder `name` may be damaged."""
    for folder in ("features", "fits", "predictions", "attributions"):
        (to / folder).symlink_to(root / folder)
    (to / name).unlink()
    shutil.copytree(root / name, to / name)
    return to


def test_fits_of_other_features_are_refused(root: Path, tmp_path: Path) -> None:
    other = copied(root, "fits", tmp_path)
    folder = other / "fits/detachment" / BOTH
    shutil.rmtree(folder / "tau1")
    shutil.copytree(folder / "tau2", folder / "tau1")
    message = r"tau1/00_00\.pt: was fitted on the features .*F_dagger, not on"
    with pytest.raises(BadInput, match=message):
        evaluate(other, "detachment", BOTH, out=tmp_path / "out")
    with pytest.raises(BadInput, match=message):
        attribute(other, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_an_unfinished_training_is_refused(root: Path, tmp_path: Path) -> None:
    other = copied(root, "fits", tmp_path)
    (other / "fits/detachment" / BOTH / "tau3/fits.json").unlink()
    with pytest.raises(BadInput, match=r"tau3/fits\.json: no such file"):
        evaluate(other, "detachment", BOTH, out=tmp_path / "out")


def test_fits_of_another_split_are_refused(root: Path, tmp_path: Path) -> None:
    other = copied(root, "fits", tmp_path)
    shutil.rmtree(other / "fits/detachment" / BOTH)
    train(other, "detachment", "factors", out=other / "fits/detachment" / BOTH)
    with pytest.raises(BadInput, match=r"was fitted on the folds .*, another split"):
        evaluate(other, "detachment", BOTH, out=tmp_path / "out")
    with pytest.raises(BadInput, match=r"was fitted on the folds H, beta, m, not on 30%"):
        attribute(other, out=tmp_path / "out")


def with_gap(signal: NDArray[np.float64]) -> NDArray[np.float64]:
    """The signal without its sample 100, which belongs to the first run."""
    return np.where(np.arange(len(signal)) == 100, np.nan, signal)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (lambda c: replace(c, signals={k: v for k, v in c.signals.items() if k != "h_dot"}), "feature h_dot"),
        (
            lambda c: replace(c, signals={**c.signals, "eps": with_gap(c.signals["eps"])}),
            "feature eps .* sample 100",
        ),
        (lambda c: replace(c, experiments=c.experiments.drop(columns="label")), "no column label"),
        (
            lambda c: replace(c, offsets=np.concatenate([[0, 0], c.offsets[2:]])),
            "experiment 1: has no samples",
        ),
    ],
)
def test_a_bad_campaign_is_refused(
    changed: Any, message: str, jump_campaign: Campaign, tmp_path: Path
) -> None:
    changed(jump_campaign).write(tmp_path / "features")
    with pytest.raises(BadInput, match=message):
        train(tmp_path, "detachment", BOTH, out=tmp_path / "fit")
    assert not (tmp_path / "fit" / "fit.json").exists()


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["fold=20%"], "fold: unknown 20%, must be one of 5%, 30%"),
        (["explained=[tau9]"], "explained: unknown tau9, must be one of tau1"),
        (["model=tau4"], "model must be a family"),
        (
            ["+groups.other=['sin(theta)']"],
            "groups: sin\\(theta\\) is in theta and in other",
        ),
    ],
)
def test_what_cannot_be_explained_is_refused(
    root: Path, overrides: list[str], message: str, tmp_path: Path
) -> None:
    with pytest.raises(BadInput, match=message):
        attribute(root, *overrides, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_missing_and_damaged_tables_are_refused(root: Path, tmp_path: Path) -> None:
    other = copied(root, "attributions", tmp_path)
    (other / "attributions/overall.parquet").write_text("nonsense")
    with pytest.raises(BadInput, match=r"overall\.parquet: "):
        tabulate(other, out=tmp_path / "tables")
    (other / "attributions/overall.parquet").unlink()
    with pytest.raises(BadInput, match=r"overall\.parquet: no such file"):
        tabulate(other, out=tmp_path / "tables")
    assert not (tmp_path / "tables").exists()
    (other / "predictions").unlink()
    with pytest.raises(BadInput, match=r"predictions: no \*/\*/runs\.parquet"):
        tabulate(other, out=tmp_path / "tables")
