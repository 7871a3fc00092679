"""Accuracy over the number of hidden units, on a random part of the contact runs (Fig. 6.16)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from pipeline.evaluation.simulate import simulate_tests
from pipeline.evaluation.splits import Split
from pipeline.files import replacing
from pipeline.learning.recipe import Recipe
from pipeline.models.dataset import Dataset
from pipeline.physics.mechanisms.cam_follower import CamFollower
from pipeline.trajectory import Campaign


def tune(
    features: Path,
    mechanism: CamFollower,
    model: Recipe,
    split: Split,
    profile: Mapping[str, Any],
    seed: int,
    out: Path,
) -> None:
    """Write `out`: columns hidden, repeat, omega_mse, the median over the validation runs, (rad/s)^2.

    Args:
        features: store written by featurize.
        mechanism: constants of the bench.
        model: recipe whose dynamics take `hidden`.
        split: one fold to train and validate on.
        profile: `repeats` and the numbers of hidden units `widths`.
        seed: of everything random.
        out: Parquet file.
    """
    campaign = Campaign.read(features, ["t", "theta", "omega"])
    dataset = Dataset.of(campaign, mechanism)
    folds, repeats = split.folds(campaign.experiments), profile["repeats"]
    stack = [fold.train for fold in folds for _ in range(repeats)]
    exp = campaign.experiments["exp"].to_numpy()
    tables = []
    for hidden in profile["widths"]:
        recipe = Recipe(partial(model.dynamics, hidden=hidden), model.fit)
        fitted = recipe.train(dataset, stack, seed)
        errors = simulate_tests(fitted, dataset, folds, repeats, exp).errors
        tables.append(errors.groupby("repeat")["omega_mse"].median().reset_index().assign(hidden=hidden))
    with replacing(out) as temporary:
        pd.concat(tables, ignore_index=True).to_parquet(temporary, index=False)
