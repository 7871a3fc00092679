"""Accuracy over the number of hidden units, on a random part of the contact runs (Fig. 6.16)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.dataset import Dataset
from pipeline.cam_follower.held_out import simulate_tests
from pipeline.cam_follower.recipe import Recipe
from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing
from unmodelled.base.ownership import Out, verb
from unmodelled.base.parquet import write_parquet
from unmodelled.base.progress import track
from unmodelled.evaluation.splits import Split
from unmodelled.logs.trajectory import Campaign

#: No network of a few hundred runs is wider.
WIDEST = 100_000


@verb(Out.FILE)
def tune(
    features: Path,
    mechanism: CamFollower,
    model: Recipe,
    split: Split,
    profile: Mapping[str, Any],
    hidden: int | Sequence[int],
    seed: int,
    out: Path,
) -> float:
    """Write `out`: columns hidden, repeat, omega_mse, the median over the validation runs, (rad/s)^2.

    Args:
        features: store written by featurize.
        mechanism: constants of the bench.
        model: recipe whose dynamics take `hidden`.
        split: one fold to train and validate on.
        profile: `repeats` models for every number of hidden units.
        hidden: numbers of hidden units n_h to try, or one of them.
        seed: of everything random.
        out: Parquet file.

    Returns:
        The error of the best n_h, median over its repeats: what a sweeper minimises.

    Raises:
        BadInput: when `hidden` is not a whole number from 1 up, or several.
    """
    given: object = hidden  # a configuration may hold anything
    widths = list(given) if isinstance(given, Sequence) and not isinstance(given, str) else [given]
    if not widths or not all(type(width) is int and 0 < width <= WIDEST for width in widths):
        raise BadInput(f"hidden: must be whole numbers from 1 up, got {hidden}")
    campaign = Campaign.read(features, ["t", "theta", "omega"])
    dataset = Dataset.of(campaign, mechanism)
    folds, repeats = split.folds(campaign.experiments), profile["repeats"]
    stack = [fold.train for fold in folds for _ in range(repeats)]
    exp = campaign.experiments["exp"].to_numpy()
    tables = []
    for width in track(widths, len(widths), "numbers of hidden units"):
        recipe = Recipe(partial(model.dynamics, hidden=width), model.fit)
        fitted = recipe.train(dataset, stack, seed)
        errors = simulate_tests(fitted, dataset, folds, repeats, exp).errors
        tables.append(errors.groupby("repeat")["omega_mse"].median().reset_index().assign(hidden=width))
    tried = pd.concat(tables, ignore_index=True)
    with replacing(out) as temporary:
        write_parquet(tried, temporary)
    return float(tried.groupby("hidden")["omega_mse"].median().min())
