"""Fit one model per fold and repeat of a split, all of them as one stack."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.dataset import Dataset
from pipeline.cam_follower.detachment import DetachmentRecipe, Family
from pipeline.cam_follower.recipe import Recipe
from unmodelled.base.files import write_json
from unmodelled.base.ownership import verb
from unmodelled.evaluation.splits import Split
from unmodelled.learning.augmented import AugmentedRecipe, check_pairing
from unmodelled.learning.checkpoint import save
from unmodelled.learning.fitting import Members, fit
from unmodelled.logs.folder import read_logs
from unmodelled.logs.trajectory import Campaign
from unmodelled.systems.reader import read_system

#: What to do with the result (`unmodelled.cli.written`).
NEXT = "next: {program} evaluate fits={out} with the same keys"


@verb()
def train(
    system: Path | None,
    logs: Path | None,
    features: Path,
    mechanism: CamFollower,
    model: Recipe | AugmentedRecipe | DetachmentRecipe | Family,
    split: Split,
    profile: Mapping[str, Any],
    start: Path | None,
    device: str,
    seed: int,
    out: Path,
) -> None:
    """Write `out`/model.pt (weights) and `out`/fit.json (what was fitted, how long it took).

    With `system` and `logs` a hybrid model of that system (model=hybrid, nnap, ...) is fitted, and
    `out`/history.parquet tells its parameters and loss after every epoch; killed, it goes on where it was.
    Without them a model of the cam-follower's drivetrain (model=f_h2, motor, ...) is fitted to `features`, or
    one of the follower's detachment (model=tau4, detachment, ...), which writes a file per fold and repeat in
    place of model.pt and goes on after the last of them when it was killed.

    Args:
        system: system file.
        logs: log folder, or the store that ingest made of one.
        features: store written by featurize.
        mechanism: constants of the cam-follower bench, known to every model.
        model: what to fit and how.
        split: the folds; a fold's model sees its training experiments and nothing else.
        profile: `repeats` models per fold, differing in seed.
        start: folder of a fit of the same model and split to start from; null: from scratch.
        device: cpu runs the compiled kernels; cuda (or another device of torch) the torch reference.
        seed: of everything random.
        out: folder that is new, empty or was made by this verb.

    Raises:
        BadInput: when the data are missing or too few, or do not suit the model.
    """
    check_pairing(model, system, logs)
    if isinstance(model, AugmentedRecipe):
        assert system is not None and logs is not None
        known = read_system(system)
        measured = read_logs(logs, known)
        folds = split.folds(measured.experiments_with_speed())
        members = Members.of([f.name for f in folds], [f.train for f in folds], profile["system_repeats"])
        fit(model, known, measured, members, seed, start, device, out)
    elif not isinstance(model, Recipe):
        _fit_detachment(features, Family.of(model), split, profile["repeats"], seed, device, out)
    else:
        _fit_drivetrain(features, mechanism, model, split, profile["repeats"], seed, out)


def _fit_detachment(
    features: Path, model: Family, split: Split, repeats: int, seed: int, device: str, out: Path
) -> None:
    campaign = Campaign.read(features)
    folds = {fold.name: fold.train for fold in split.folds(campaign.experiments)}
    seconds = model.fit(campaign, folds, repeats, seed, out, device)
    about = {"folds": list(folds), "repeats": repeats, "seed": seed, "seconds": seconds}
    write_json(out / "fit.json", about)


def _fit_drivetrain(
    features: Path, mechanism: CamFollower, model: Recipe, split: Split, repeats: int, seed: int, out: Path
) -> None:
    campaign = Campaign.read(features, ["t", "theta", "omega"])
    folds = split.folds(campaign.experiments)
    dataset = Dataset.of(campaign, mechanism)
    stack = [fold.train for fold in folds for _ in range(repeats)]
    start = time.monotonic()
    fitted = model.train(dataset, stack, seed)
    about = {"folds": [fold.name for fold in folds], "repeats": repeats, "seed": seed}
    save(fitted, out / "model.pt", about)
    trained = sum(p.numel() for p in fitted.parameters()) // len(stack)
    write_json(out / "fit.json", {**about, "seconds": time.monotonic() - start, "parameters": trained})
