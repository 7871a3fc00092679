"""Tabulate the accuracy over the number of hidden units (Fig. 6.16)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from pipeline.cam_follower.dataset import Dataset
from pipeline.cam_follower.held_out import simulate_tests
from pipeline.cam_follower.recipe import DrivetrainRecipe
from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing
from unmodelled.base.ownership import Out, verb
from unmodelled.base.parquet import write_parquet
from unmodelled.base.progress import track
from unmodelled.learning.splits import Split

#: No network of a few hundred runs is wider.
WIDEST = 100_000


@verb(Out.FILE)
def tune(
    model: DrivetrainRecipe,
    split: Split,
    profile: Mapping[str, Any],
    hidden: int | Sequence[int],
    seed: int,
    out: Path,
) -> float:
    """Write `out`: columns hidden, repeat, omega_mse, the median over the validation runs, (rad/s)^2.

    Args:
        model: model of the drivetrain whose dynamics take the argument `hidden`.
        split: division of the runs into training and validation runs, of one fold.
        profile: number of models for every number of hidden units: `repeats`.
        hidden: numbers of hidden units n_h to try, or one number.
        seed: seed of the random generators.
        out: Parquet file of the results.

    Returns:
        Error of the best n_h, (rad/s)^2, median over its repeats; a sweeper minimises it.

    Raises:
        BadInput: when `hidden` is not one whole number from 1 on, or a list of them.
    """
    given: object = hidden  # a configuration may hold anything
    widths = list(given) if isinstance(given, Sequence) and not isinstance(given, str) else [given]
    if not widths or not all(type(width) is int and 0 < width <= WIDEST for width in widths):
        raise BadInput(f"hidden: must be whole numbers from 1 up, got {hidden}")
    campaign = model.campaign()
    dataset = Dataset.of(campaign, model.mechanism)
    folds, repeats = split.folds(campaign.experiments), profile["repeats"]
    stack = [fold.train for fold in folds for _ in range(repeats)]
    exp = campaign.experiments["exp"].to_numpy()
    tables = []
    for width in track(widths, len(widths), "numbers of hidden units"):
        fitted = model.fit(partial(model.dynamics, hidden=width), dataset, stack, seed)
        errors = simulate_tests(fitted, dataset, folds, repeats, exp).errors
        tables.append(errors.groupby("repeat")["omega_mse"].median().reset_index().assign(hidden=width))
    tried = pd.concat(tables, ignore_index=True)
    with replacing(out) as temporary:
        write_parquet(tried, temporary)
    return float(tried.groupby("hidden")["omega_mse"].median().min())
