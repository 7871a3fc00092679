"""A recurrent network for the residual of the bounce simulation, zero in simulated contact."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pipeline.cam_follower.detachment import DetachmentRecipe, Fitted
from pipeline.cam_follower.sequence.fits import Fits
from pipeline.cam_follower.sequence.recipe import SequenceRecipe
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from pipeline.cam_follower.simulation import BounceFits, BounceRecipe, gated, residual
from unmodelled.base.arrays import Array, Indices
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput

#: Folder of the simulation's parameters, beside one folder of networks per fold.
PHYSICS = "bounce"


@dataclass(frozen=True)
class HybridFits(Fitted):
    """Simulations and networks of all folds; the inputs of a network depend on its fold."""

    physics: BounceFits
    networks: Mapping[str, Fits]  # by fold

    @property
    def folds(self) -> list[str]:
        return list(self.networks)

    @property
    def parts(self) -> dict[str, Fitted]:
        return {PHYSICS: self.physics}

    def detachment(self, fold: str, campaign: Campaign) -> Array:
        simulated, network = self.physics.simulated(fold, campaign), self.networks[fold]
        learned = network.detachment(fold, simulated)
        signals = Sequences.of(simulated, SequenceInputs(("gate", "eps_bounce")), network.samples).features
        return gated(signals[..., 0], signals[..., 1], learned)


@dataclass(frozen=True)
class BounceHybrid(DetachmentRecipe):
    """The bounce simulation and a network for its residual.

    `fit` writes the parameters of the simulation, and one folder of networks per fold.

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
        seconds = self.bounce.fit(campaign, folds, repeats, seed, out / PHYSICS, workers)
        physics = self.bounce.read(out / PHYSICS)
        for k, (name, rows) in enumerate(folds.items()):
            rest, own = residual(physics.simulated(name, campaign)), out / f"{k:02d}"
            seconds += self.network.fit(rest, {name: rows}, repeats, seed, own, workers, device)
        return seconds

    def read(self, folder: Path) -> HybridFits:
        physics = self.bounce.read(folder / PHYSICS)
        networks = {name: self.network.read(folder / f"{k:02d}") for k, name in enumerate(physics.folds)}
        return HybridFits(physics, networks)
