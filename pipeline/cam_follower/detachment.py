"""What every model of the follower's detachment can do, and several of them as one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from unmodelled.logs.trajectory import Campaign

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class Fitted(Protocol):
    """Fits of some folds, each with its repeats."""

    @property
    def folds(self) -> list[str]:
        """Names of the folds."""
        ...

    @property
    def parts(self) -> Mapping[str, Fitted]:
        """Name -> model that this one is built on, which predicts by itself too."""
        ...

    def detachment(self, fold: str, campaign: Campaign) -> Array:
        """Detachment eps of all runs by every repeat of a fold, m, (repeats, runs, steps)."""
        ...


class DetachmentRecipe(Protocol):
    """A model and its training, as a file of conf/model/ says."""

    @property
    def samples(self) -> int:
        """After which a run is cut off."""
        ...

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
        """Fit every fold and repeat, but what is in `out` already; the time that all took, core seconds."""
        ...

    def read(self, folder: Path) -> Fitted:
        """What `fit` wrote to `folder`."""
        ...


@dataclass(frozen=True)
class Family:
    """Models that are fitted and judged on the same folds, in one process.

    Attributes:
        members: name -> recipe; the fits of each lie in a folder of that name.
    """

    members: Mapping[str, DetachmentRecipe]

    @classmethod
    def of(cls, model: DetachmentRecipe | Family) -> Family:
        """A single model is a family of one, which has no name and no folder of its own."""
        return model if isinstance(model, Family) else cls({"": model})

    def fit(
        self,
        campaign: Campaign,
        folds: Mapping[str, Indices],
        repeats: int,
        seed: int,
        out: Path,
        device: str = "cpu",
    ) -> float:
        """Fit one member after the other; the time that all took, core seconds."""
        return sum(
            recipe.fit(campaign, folds, repeats, seed, out / name, device=device)
            for name, recipe in self.members.items()
        )
