"""What the stages of chapter 5 refuse: other fits, bad campaigns, wrong options and damaged tables."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.machines.known import Array
from tests.stages.jump_stages import BOTH, attribute, evaluate, tabulate, train
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput

pytestmark = pytest.mark.long


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


def with_gap(eps: Array, **signals: Array) -> dict[str, Array]:
    """Signals without the sample 100 of eps, which belongs to the first run."""
    return {**signals, "eps": np.where(np.arange(len(eps)) == 100, np.nan, eps)}


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (lambda c: replace(c, signals={k: v for k, v in c.signals.items() if k != "h_dot"}), "feature h_dot"),
        (lambda c: replace(c, signals=with_gap(**c.signals)), "feature eps .* sample 100"),
        (lambda c: replace(c, experiments=c.experiments.drop(columns="label")), "no column label"),
        (lambda c: replace(c, offsets=np.r_[0, 0, c.offsets[2:]]), "experiment 1: has no samples"),
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
        (["model=tau4"], "explained: unknown tau1, must be one of tau4"),
        (["model=f_h2"], "model: attribute needs a Family, got a DrivetrainRecipe: choose another model=..."),
        (["+groups.other=['sin(theta)']"], "groups: sin\\(theta\\) is in theta and in other"),
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
