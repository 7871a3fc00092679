"""Free-run simulation of what a fitted model has not seen."""

from __future__ import annotations

from pathlib import Path

from pipeline.errors import BadInput
from pipeline.evaluation.simulate import explore, simulate_tests
from pipeline.evaluation.splits import Split
from pipeline.files import replacing_folder
from pipeline.learning.recipe import Recipe, load
from pipeline.models.dataset import Dataset
from pipeline.physics.mechanisms.cam_follower import CamFollower
from pipeline.trajectory import Campaign


def evaluate(
    features: Path, fits: Path, mechanism: CamFollower, model: Recipe, split: Split, out: Path
) -> None:
    """Write `out`/errors.parquet, `out`/examples.parquet and, where the split explores, `out`/force.parquet.

    Args:
        features: store written by featurize.
        fits: folder written by train for the same model and split.
        mechanism: constants of the bench.
        model: the recipe that was fitted.
        split: the folds.
        out: folder, replaced as a whole.

    Raises:
        BadInput: when an input is missing or the fit belongs to another model or split.
    """
    campaign = Campaign.read(features, ["t", "theta", "omega"])
    dataset = Dataset.of(campaign, mechanism)
    fitted, about = load(fits / "model.pt", model.dynamics, dataset)
    folds = split.folds(campaign.experiments)
    if about["folds"] != [fold.name for fold in folds]:
        raise BadInput(f"{fits}/model.pt: was fitted on the folds {about['folds']}, another split")
    exp = campaign.experiments["exp"].to_numpy()
    results = simulate_tests(fitted, dataset, folds, about["repeats"], exp)
    with replacing_folder(out) as folder:
        results.errors.to_parquet(folder / "errors.parquet", index=False)
        results.examples.to_parquet(folder / "examples.parquet", index=False)
        if split.explore:
            explore(fitted, dataset, folds, about["repeats"], exp).to_parquet(
                folder / "force.parquet", index=False
            )
