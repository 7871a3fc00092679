"""Free-run simulation of what a fitted model has not seen."""

from __future__ import annotations

from pathlib import Path

from pipeline.errors import BadInput
from pipeline.evaluation.held_out import free_runs, surfaces
from pipeline.evaluation.simulate import explore, simulate_tests
from pipeline.evaluation.splits import Fold, Split
from pipeline.files import replacing_folder
from pipeline.learning.augmented import AugmentedRecipe, check_pairing
from pipeline.learning.fitting import load_fit
from pipeline.learning.recipe import Recipe, load
from pipeline.measurements.folder import read_logs
from pipeline.models.dataset import Dataset
from pipeline.models.rollout import Measured
from pipeline.physics.mechanisms.cam_follower import CamFollower
from pipeline.physics.system.reader import read_system
from pipeline.trajectory import Campaign


def evaluate(
    system: Path | None,
    logs: Path | None,
    features: Path,
    fits: Path,
    mechanism: CamFollower,
    model: Recipe | AugmentedRecipe,
    split: Split,
    out: Path,
) -> None:
    """Write `out`/errors.parquet and `out`/examples.parquet: test experiments, simulated from their first
    state.

    With `system` and `logs` also `out`/efforts.parquet, what the networks say on the training experiments,
    and `out`/surface.parquet, networks of two inputs on a grid; without, where the split explores,
    `out`/force.parquet.

    Args:
        system: system file.
        logs: log folder, or the store that ingest made of one.
        features: store written by featurize.
        fits: folder written by train for the same model and split.
        mechanism: constants of the cam-follower bench.
        model: the recipe that was fitted.
        split: the folds.
        out: folder, replaced as a whole.

    Raises:
        BadInput: when an input is missing or the fit belongs to another model or split.
    """
    check_pairing(model, system, logs)
    if isinstance(model, AugmentedRecipe):
        assert system is not None and logs is not None
        _evaluate_system(system, logs, fits, model, split, out)
    else:
        _evaluate_drivetrain(features, fits, mechanism, model, split, out)


def _evaluate_system(
    system: Path, logs: Path, fits: Path, model: AugmentedRecipe, split: Split, out: Path
) -> None:
    known = read_system(system)
    measured = read_logs(logs, known)
    fitted, about = load_fit(model, known, fits)
    folds = split.folds(measured.experiments_with_speed())
    _check_folds(folds, about["folds"], fits)
    results = free_runs(fitted, measured, folds, about["repeats"], model.integration(measured.period))
    # the first model as it was before training
    data, first = Measured.of(measured), [folds[0].train]
    initial = model.problem(known, data, measured.period, first, about["seed"]).model
    shapes = surfaces({"initial": initial, "converged": fitted}, measured)
    with replacing_folder(out) as folder:
        results.errors.to_parquet(folder / "errors.parquet", index=False)
        results.examples.to_parquet(folder / "examples.parquet", index=False)
        results.efforts.to_parquet(folder / "efforts.parquet", index=False)
        shapes.to_parquet(folder / "surface.parquet", index=False)
    units = {state.name: state.unit for state in known.states}
    for name, group in results.errors.groupby("state", sort=False):
        rmse, diverged = group["rmse"].median(), int(group["diverged"].sum())
        count = f"median of {len(group)}, {diverged} diverged"
        print(f"{name}: held-out free-run RMSE {rmse:.3g} {units[str(name)]} ({count})")


def _check_folds(folds: list[Fold], fitted: list[str], fits: Path) -> None:
    if fitted != [fold.name for fold in folds]:
        raise BadInput(f"{fits}/model.pt: was fitted on the folds {fitted}, another split")


def _evaluate_drivetrain(
    features: Path, fits: Path, mechanism: CamFollower, model: Recipe, split: Split, out: Path
) -> None:
    campaign = Campaign.read(features, ["t", "theta", "omega"])
    dataset = Dataset.of(campaign, mechanism)
    fitted, about = load(fits / "model.pt", model.dynamics, dataset)
    folds = split.folds(campaign.experiments)
    _check_folds(folds, about["folds"], fits)
    exp = campaign.experiments["exp"].to_numpy()
    results = simulate_tests(fitted, dataset, folds, about["repeats"], exp)
    with replacing_folder(out) as folder:
        results.errors.to_parquet(folder / "errors.parquet", index=False)
        results.examples.to_parquet(folder / "examples.parquet", index=False)
        if split.explore:
            explore(fitted, dataset, folds, about["repeats"], exp).to_parquet(
                folder / "force.parquet", index=False
            )
