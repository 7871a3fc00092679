"""Models of the detachment of the follower, with the interface of all models."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import pandas as pd

from pipeline.cam_follower import jumps
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.lstm import DetachmentNetwork
from unmodelled.base.arrays import Array, Indices
from unmodelled.base.campaign import Campaign
from unmodelled.base.files import write_json
from unmodelled.base.ownership import check_name
from unmodelled.base.progress import track
from unmodelled.learning.recipe import Recipe, Tables, check_folds, refused
from unmodelled.learning.splits import Split


class Fitted(ABC):
    """Fits of some folds, each with its repeats."""

    @property
    @abstractmethod
    def folds(self) -> list[str]:
        """Names of the folds."""

    @property
    def parts(self) -> Mapping[str, "Fitted"]:
        """Models that this model builds on and that also predict alone, by name; default: none."""
        return {}

    @property
    def explainable(self) -> Mapping[str, Sequence[DetachmentNetwork]]:
        """Networks of every fold whose inputs are signals of the campaign, one per repeat; default: none."""
        return {}

    @abstractmethod
    def detachment(self, fold: str, campaign: Campaign) -> Array:
        """Predict the detachment eps of all runs by every repeat of a fold.

        Args:
            fold: name of the fold.
            campaign: runs with the signals that the model reads.

        Returns:
            Detachment, m, shape (repeats, runs, steps); zero after the end of a run.
        """


class DetachmentRecipe(ABC):
    """A model of the detachment and its training, as a file of conf/detachment/ describes them."""

    @property
    @abstractmethod
    def samples(self) -> int:
        """Number of samples after which a run is cut off."""

    @abstractmethod
    def fit(
        self,
        campaign: Campaign,
        folds: Mapping[str, Indices],
        repeats: int,
        seed: int,
        out: Path,
        workers: int = 2,
        device: str = "cpu",
    ) -> float:
        """Fit the model to every fold and repeat that `out` does not hold yet.

        Args:
            campaign: runs with the signals that the model reads.
            folds: rows of the training runs by the name of the fold, each of shape (runs,).
            repeats: number of models per fold, which differ in their random start.
            seed: seed of the random generators.
            out: folder of the results.
            workers: number of fits side by side, each on one core; default 2.
            device: `cpu` for the compiled kernel (default), or a device of torch such as `cuda`.

        Returns:
            Time that all fits took, whenever they were made, core seconds.

        Raises:
            BadInput: when the data do not suit the model, or `out` holds a damaged fit or a fit of other
                features.
        """

    @abstractmethod
    def read(self, folder: Path) -> Fitted:
        """Read the models that `fit` wrote.

        Args:
            folder: folder of the results.

        Raises:
            BadInput: when the fits are not complete, or a file is missing, damaged or of another training.
        """


@dataclass(frozen=True)
class Family(Recipe):
    """Models of the detachment that are fitted and assessed on the same folds, in one process.

    Existing fits in the folder of `train` with the same data, settings and seed are kept: after an
    interruption, training continues with the next fit. The entry `seconds` of fit.json is the sum over all
    fits, core seconds. Tables of `evaluate` are runs, repeats and examples of
    `pipeline.cam_follower.jumps.judge`, with a column `model`.

    Attributes:
        members: recipes by name; the fits of each lie in a folder of that name.
        features: store of the runs, written by featurize.
        mechanism: constants of the cam-follower bench.
    """

    members: Mapping[str, DetachmentRecipe]
    features: Path
    mechanism: CamFollower

    def __post_init__(self) -> None:
        path = Path(str(self.features))  # a config file hands over a text
        check_name("model.features", path)
        object.__setattr__(self, "features", path)

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
        campaign, repeats = Campaign.read(self.features), profile["repeats"]
        folds = {fold.name: fold.train for fold in split.folds(campaign.experiments)}
        seconds = sum(
            recipe.fit(campaign, folds, repeats, seed, out / name, device=device)
            for name, recipe in self.members.items()
        )
        about = {"folds": list(folds), "repeats": repeats, "seed": seed, "seconds": seconds}
        write_json(out / "fit.json", about)

    def evaluate(self, system: Path | None, logs: Path | None, fits: Path, split: Split) -> Tables:
        refused(system, logs)
        campaign = Campaign.read(self.features)
        folds = split.folds(campaign.experiments)
        parts = []
        for name, recipe in track(self.members.items(), len(self.members), "predicting, models"):
            fitted, observed = recipe.read(fits / name), jumps.Observed.of(campaign, recipe.samples)
            check_folds(folds, fitted.folds, fits / name)
            for (label, own), fold in product({name: fitted, **fitted.parts}.items(), folds):
                eps = own.detachment(fold.name, campaign)
                tables = jumps.judge(observed, fold, eps, self.mechanism.jump_share)
                parts.append({kind: table.assign(model=label) for kind, table in tables.items()})
        return {kind: pd.concat([part[kind] for part in parts], ignore_index=True) for kind in parts[0]}
