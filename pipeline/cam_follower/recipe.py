"""Models of the drivetrain and their training, with the interface of all models."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.dataset import Dataset
from pipeline.cam_follower.dynamics import Dynamics
from pipeline.cam_follower.held_out import explore, simulate_tests
from unmodelled.base.arrays import Indices
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.base.files import write_json
from unmodelled.base.ownership import check_name
from unmodelled.learning.checkpoint import read_checkpoint, restore, save
from unmodelled.learning.recipe import Recipe, Tables, check_folds, refused
from unmodelled.learning.splits import Split

#: Signals that models of the drivetrain read: time (s), angle (rad) and speed (rad/s) of the cam.
SIGNALS = ["t", "theta", "omega"]


@dataclass(frozen=True)
class DrivetrainRecipe(Recipe):
    """A model of the drivetrain and its training.

    Tables of `evaluate` are errors and examples, see `pipeline.cam_follower.held_out.Simulations`; for a
    split that explores, also force, see `pipeline.cam_follower.held_out.explore`.

    Attributes:
        dynamics: constructor of a stack of models.
        fit: function `fit(dynamics, dataset, folds, seed) -> Dynamics` that trains a stack; the training
            experiments of a model have the shape (experiments,).
        features: store of the runs, written by featurize.
        mechanism: constants of the cam-follower bench.
    """

    dynamics: Callable[..., Dynamics]
    fit: Callable[[Callable[..., Dynamics], Dataset, list[Indices], int], Dynamics]
    features: Path
    mechanism: CamFollower

    def __post_init__(self) -> None:
        path = Path(str(self.features))  # a config file hands over a text
        check_name("model.features", path)
        object.__setattr__(self, "features", path)

    def campaign(self) -> Campaign:
        """Read the runs of the store `features`.

        Raises:
            BadInput: when the store is missing, damaged, or lacks a signal.
        """
        return Campaign.read(self.features, SIGNALS)

    def train(
        self,
        system: Path | None,
        logs: Path | None,
        split: Split,
        profile: Mapping[str, Any],
        start: Path | None,
        device: str,
        seed: int,
        out: Path,
    ) -> None:
        refused(system, logs, start)
        campaign, repeats = self.campaign(), profile["repeats"]
        folds = split.folds(campaign.experiments)
        dataset = Dataset.of(campaign, self.mechanism)
        stack = [fold.train for fold in folds for _ in range(repeats)]
        begin = time.monotonic()
        fitted = self.fit(self.dynamics, dataset, stack, seed)
        about = {"folds": [fold.name for fold in folds], "repeats": repeats, "seed": seed}
        save(fitted, out / "model.pt", about)
        trained = sum(p.numel() for p in fitted.parameters()) // len(stack)
        write_json(out / "fit.json", {**about, "seconds": time.monotonic() - begin, "parameters": trained})

    def evaluate(self, system: Path | None, logs: Path | None, fits: Path, split: Split) -> Tables:
        refused(system, logs)
        campaign = self.campaign()
        dataset = Dataset.of(campaign, self.mechanism)
        fitted, about = load(fits / "model.pt", self.dynamics, dataset)
        folds = split.folds(campaign.experiments)
        check_folds(folds, about["folds"], fits / "model.pt")
        exp = campaign.experiments["exp"].to_numpy()
        results = simulate_tests(fitted, dataset, folds, about["repeats"], exp)
        tables = {"errors": results.errors, "examples": results.examples}
        if split.explore:
            tables["force"] = explore(fitted, dataset, folds, about["repeats"], exp)
        return tables


def load(path: Path, dynamics: Callable[..., Dynamics], dataset: Dataset) -> tuple[Dynamics, dict[str, Any]]:
    """Read a fitted stack and the facts that were saved with it."""
    content = read_checkpoint(path)
    model = _like(content["state"], dynamics, dataset)
    if model is None:
        raise BadInput(
            f"{path}: is a checkpoint of {content['class']}, another model than the configured one"
        )
    restore(model, content, path)
    return model, content["about"]


def _like(state: dict[str, Any], dynamics: Callable[..., Dynamics], dataset: Dataset) -> Dynamics | None:
    """A stack as large as the one saved; None if `dynamics` is not made from such a state."""
    try:
        if "network.scale" in state:
            scale = 1.0 / state["network.scale"][:, 0]
            return dynamics(bench=dataset.bench, scale=scale, generator=torch.Generator())
        return dynamics(bench=dataset.bench, batch=len(next(iter(state.values()))))
    except (TypeError, ValueError, AttributeError, LookupError, RuntimeError, StopIteration):
        return None
