"""A recurrent network for the residual of the bounce simulation, zero in simulated contact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pipeline.arrays import Array, Indices
from pipeline.cam_follower.bounce_gate import gated, residual
from pipeline.cam_follower.detachment import Fitted
from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequence.fits import Fits
from pipeline.cam_follower.sequence.recipe import SequenceRecipe
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from pipeline.cam_follower.simulation import BounceFits, BounceRecipe
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput

#: Folder of the simulation's parameters, beside one folder of networks per fold.
PHYSICS = "bounce"


@dataclass(frozen=True)
class HybridFits:
    """Simulations and networks of all folds; the inputs of a network depend on its fold.

    Attributes:
        physics: identified simulations.
        networks: networks by fold.
    """

    physics: BounceFits
    networks: Mapping[str, Fits]

    @property
    def folds(self) -> list[str]:
        """Names of the folds."""
        return list(self.networks)

    @property
    def parts(self) -> dict[str, Fitted]:
        """Models that the hybrid builds on: the simulation."""
        return {PHYSICS: self.physics}

    @property
    def explainable(self) -> dict[str, list[DetachmentNetwork]]:
        """Networks whose inputs are signals of the campaign: none, because the networks also read simulated
        signals.
        """
        return {}

    def detachment(self, fold: str, campaign: Campaign) -> Array:
        """Predict the detachment eps of all runs by every repeat of a fold.

        Gives (repeats, runs, steps) in m.
        """
        simulated, network = self.physics.simulated(fold, campaign), self.networks[fold]
        learned = network.detachment(fold, simulated)
        signals = Sequences.of(simulated, SequenceInputs(("gate", "eps_bounce")), network.samples).features
        return gated(signals[..., 0], signals[..., 1], learned)


@dataclass(frozen=True)
class BounceHybrid:
    """The bounce simulation and a network for its residual.

    Attributes:
        bounce: recipe of the simulation, which is identified first, on the same runs.
        network: recipe of the network, which reads signals of the simulation beside those of the campaign.

    Raises:
        BadInput: when both recipes cut off runs at different numbers of samples.
    """

    bounce: BounceRecipe
    network: SequenceRecipe

    def __post_init__(self) -> None:
        if self.bounce.samples != self.network.samples:
            raise BadInput(
                f"samples must be the same of bounce and network, got {self.bounce.samples} and "
                f"{self.network.samples}"
            )

    @property
    def samples(self) -> int:
        """Number of samples after which a run is cut off."""
        return self.network.samples

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
        """Write the parameters of the simulation, and one folder of networks per fold (see
        `SequenceRecipe.fit`).

        Args:
            campaign: runs with the signals that the model reads.
            folds: rows of the training runs by the name of the fold, each of shape (runs,).
            repeats: number of models per fold, which differ in their random start.
            seed: seed of the random generators.
            out: folder of the results.
            workers: number of fits that run side by side, each on one core; default 2.
            device: `cpu` for the compiled kernel (default), or a device of torch such as `cuda`.

        Returns:
            Time that all fits took, core seconds.

        Raises:
            BadInput: when the data do not suit the recipe, or `out` holds fits of other features.
        """
        seconds = self.bounce.fit(campaign, folds, repeats, seed, out / PHYSICS, workers)
        physics = self.bounce.read(out / PHYSICS)
        for k, (name, rows) in enumerate(folds.items()):
            rest, own = residual(physics.simulated(name, campaign)), out / f"{k:02d}"
            seconds += self.network.fit(rest, {name: rows}, repeats, seed, own, workers, device)
        return seconds

    def read(self, folder: Path) -> HybridFits:
        """Read the models that `fit` wrote.

        Args:
            folder: folder of the results.

        Raises:
            BadInput: when the training has not finished, or a file is missing, damaged or of other features.
        """
        physics = self.bounce.read(folder / PHYSICS)
        networks = {name: self.network.read(folder / f"{k:02d}") for k, name in enumerate(physics.folds)}
        return HybridFits(physics, networks)
