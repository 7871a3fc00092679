"""Fit one model per fold and repeat of a split, all of them as one stack."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipeline.evaluation.splits import Split
from pipeline.files import write_json
from pipeline.learning.recipe import Recipe, save
from pipeline.models.dataset import Dataset
from pipeline.physics.mechanisms.cam_follower import CamFollower
from pipeline.trajectory import Campaign


def train(
    features: Path,
    mechanism: CamFollower,
    model: Recipe,
    split: Split,
    profile: Mapping[str, Any],
    seed: int,
    out: Path,
) -> None:
    """Write `out`/model.pt (weights) and `out`/fit.json (what was fitted, how long it took).

    Args:
        features: store written by featurize.
        mechanism: constants of the bench, known to every model.
        model: what to fit and how.
        split: the folds; a fold's model sees its training experiments and nothing else.
        profile: `repeats` models per fold, differing in seed.
        seed: of everything random.
        out: folder.

    Raises:
        BadInput: when the features are missing or too few.
    """
    campaign = Campaign.read(features, ["t", "theta", "omega"])
    folds = split.folds(campaign.experiments)
    dataset = Dataset.of(campaign, mechanism)
    stack = [fold.train for fold in folds for _ in range(profile["repeats"])]
    start = time.monotonic()
    fitted = model.train(dataset, stack, seed)
    about = {"folds": [fold.name for fold in folds], "repeats": profile["repeats"], "seed": seed}
    save(fitted, out / "model.pt", about)
    trained = sum(p.numel() for p in fitted.parameters()) // len(stack)
    write_json(out / "fit.json", {**about, "seconds": time.monotonic() - start, "parameters": trained})
