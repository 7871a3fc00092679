"""Predict with a fitted model what it has not seen."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pandas as pd

from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.dataset import Dataset
from pipeline.cam_follower.detachment import DetachmentRecipe, Family
from pipeline.cam_follower.held_out import explore, simulate_tests
from pipeline.cam_follower.recipe import Recipe, load
from pipeline.chapters import jumps
from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing_folder
from unmodelled.base.ownership import verb
from unmodelled.base.parquet import write_parquet
from unmodelled.base.progress import track
from unmodelled.evaluation.held_out import free_runs, surfaces
from unmodelled.evaluation.splits import Fold, Split
from unmodelled.learning.augmented import AugmentedRecipe, check_pairing
from unmodelled.learning.fitting import load_fit
from unmodelled.logs.folder import read_logs
from unmodelled.logs.trajectory import Campaign
from unmodelled.models.rollout import Measured
from unmodelled.systems.reader import read_system


@verb()
def evaluate(
    system: Path | None,
    logs: Path | None,
    features: Path,
    fits: Path,
    mechanism: CamFollower,
    model: Recipe | AugmentedRecipe | DetachmentRecipe | Family,
    split: Split,
    out: Path,
) -> None:
    """Write `out`/errors.parquet and `out`/examples.parquet: test experiments, simulated from their first
    state.

    With `system` and `logs` also `out`/efforts.parquet, what the networks say on the training experiments,
    and `out`/surface.parquet, networks of two inputs on a grid; without, where the split explores,
    `out`/force.parquet. A model of the follower's detachment (model=tau4, detachment, ...) is not simulated;
    `out` then holds runs.parquet, repeats.parquet and examples.parquet, see
    `pipeline.chapters.jumps.judge`, with a column `model`.

    Args:
        system: system file.
        logs: log folder, or the store that ingest made of one.
        features: store written by featurize.
        fits: folder written by train for the same model and split.
        mechanism: constants of the cam-follower bench.
        model: the recipe that was fitted.
        split: the folds.
        out: folder that is new, empty or was made by this verb; replaced as a whole.

    Raises:
        BadInput: when an input is missing or the fit belongs to another model or split.
    """
    check_pairing(model, system, logs)
    if isinstance(model, AugmentedRecipe):
        assert system is not None and logs is not None
        _evaluate_system(system, logs, fits, model, split, out)
    elif not isinstance(model, Recipe):
        _evaluate_detachment(features, fits, mechanism, Family.of(model), split, out)
    else:
        _evaluate_drivetrain(features, fits, mechanism, model, split, out)


def _evaluate_system(
    system: Path, logs: Path, fits: Path, model: AugmentedRecipe, split: Split, out: Path
) -> None:
    known = read_system(system)
    measured = read_logs(logs, known)
    fitted, about = load_fit(model, known, fits)
    folds = split.folds(measured.experiments_with_speed())
    _check_folds(folds, about["folds"], fits / "model.pt")
    results = free_runs(fitted, measured, folds, about["repeats"], model.integration(measured.period))
    # the first model as it was before training
    data, first = Measured.of(measured), [folds[0].train]
    initial = model.problem(known, data, measured.period, first, about["seed"]).model
    shapes = surfaces({"initial": initial, "converged": fitted}, measured)
    with replacing_folder(out) as folder:
        write_parquet(results.errors, folder / "errors.parquet")
        write_parquet(results.examples, folder / "examples.parquet")
        write_parquet(results.efforts, folder / "efforts.parquet")
        write_parquet(shapes, folder / "surface.parquet")
    units = {state.name: state.unit for state in known.states}
    for name, group in results.errors.groupby("state", sort=False):
        rmse, diverged = group["rmse"].median(), int(group["diverged"].sum())
        count = f"median of {len(group)}, {diverged} diverged"
        print(f"{name}: held-out free-run RMSE {rmse:.3g} {units[str(name)]} ({count})")


def _check_folds(folds: list[Fold], fitted: list[str], path: Path) -> None:
    if fitted != [fold.name for fold in folds]:
        raise BadInput(f"{path}: was fitted on the folds {fitted}, another split")


def _evaluate_detachment(
    features: Path, fits: Path, mechanism: CamFollower, model: Family, split: Split, out: Path
) -> None:
    campaign = Campaign.read(features)
    folds = split.folds(campaign.experiments)
    parts = []
    for name, recipe in track(model.members.items(), len(model.members), "predicting, models"):
        fitted, observed = recipe.read(fits / name), jumps.Observed.of(campaign, recipe.samples)
        _check_folds(folds, fitted.folds, fits / name)
        for (label, own), fold in product({name: fitted, **fitted.parts}.items(), folds):
            eps = own.detachment(fold.name, campaign)
            tables = jumps.judge(observed, fold, eps, mechanism.jump_share)
            parts.append({kind: table.assign(model=label) for kind, table in tables.items()})
    with replacing_folder(out) as folder:
        for kind in parts[0]:
            table = pd.concat([part[kind] for part in parts], ignore_index=True)
            write_parquet(table, folder / f"{kind}.parquet")


def _evaluate_drivetrain(
    features: Path, fits: Path, mechanism: CamFollower, model: Recipe, split: Split, out: Path
) -> None:
    campaign = Campaign.read(features, ["t", "theta", "omega"])
    dataset = Dataset.of(campaign, mechanism)
    fitted, about = load(fits / "model.pt", model.dynamics, dataset)
    folds = split.folds(campaign.experiments)
    _check_folds(folds, about["folds"], fits / "model.pt")
    exp = campaign.experiments["exp"].to_numpy()
    results = simulate_tests(fitted, dataset, folds, about["repeats"], exp)
    with replacing_folder(out) as folder:
        write_parquet(results.errors, folder / "errors.parquet")
        write_parquet(results.examples, folder / "examples.parquet")
        if split.explore:
            write_parquet(explore(fitted, dataset, folds, about["repeats"], exp), folder / "force.parquet")
