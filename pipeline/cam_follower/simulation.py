"""The bounce simulation as a model of the detachment, alone or with a network that is added in flight."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TypeVar

import numpy as np
from scipy.ndimage import maximum_filter1d
from torch import Tensor

from pipeline.cam_follower.bounce import BounceParameters, CamMotion, simulate
from pipeline.cam_follower.bounce_fitting import AWAY, START, STRETCH, fit_bounce
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.detachment import DetachmentRecipe, Fitted
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from unmodelled.base.arrays import Array, Indices
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json, write_json
from unmodelled.base.workers import threads_of

#: Written when all folds of a folder are there.
SUMMARY = "bounce.json"

Signal = TypeVar("Signal", Array, Tensor)


def gate(contact: Array, offsets: Indices, reach: int = 2) -> Array:
    """Return the factor (samples,), 0 to 1, that sets the prediction to zero in simulated contact."""
    flight = 1.0 - contact
    runs = [maximum_filter1d(flight[a:b], 2 * reach + 1) for a, b in pairwise(offsets)]
    return np.concatenate(runs)


def gated(opening: Signal, eps_bounce: Signal, network: Signal) -> Signal:
    """Return eps of the hybrid model (samples,), m: zero in contact, simulation plus network in flight."""
    return opening * (eps_bounce + network)


def with_bounce(
    campaign: Campaign,
    mechanism: CamFollower,
    parameters: BounceParameters,
    members: int = 1,
    spread: float = 0.1,
    reach: int = 2,
) -> Campaign:
    """Add the signals eps_bounce (m), contact and gate (both 0 to 1) to a campaign."""
    bounce = simulate(CamMotion.of(campaign, mechanism), parameters, members, spread)
    opening = gate(bounce.contact, campaign.offsets, reach)
    extra = {"eps_bounce": bounce.eps, "contact": bounce.contact, "gate": opening}
    return replace(campaign, signals={**campaign.signals, **extra})


def residual(campaign: Campaign) -> Campaign:
    """Replace the signal eps by the training target of the hybrid's network: gate * (eps - eps_bounce)."""
    eps, simulated, opening = (
        np.asarray(campaign.signals[name], np.float64) for name in ("eps", "eps_bounce", "gate")
    )
    return replace(campaign, signals={**campaign.signals, "eps": opening * (eps - simulated)})


@dataclass(frozen=True)
class Ensemble:
    """Settings of the averaged simulations."""

    members: int  # number of simulations to average
    spread: float  # standard deviation of the logarithms of their parameters
    reach: int  # number of samples before and after a simulated flight that still count as flight
    samples: int  # number after which a run is cut off

    def __post_init__(self) -> None:
        if min(self.members, self.samples) < 1 or self.reach < 0 or self.spread < 0.0:
            raise BadInput(f"bounce: members and samples must be positive, the rest not negative, got {self}")


@dataclass(frozen=True)
class BounceFits(Fitted):
    """Identified simulations of all folds."""

    mechanism: CamFollower
    ensemble: Ensemble
    parameters: Mapping[str, BounceParameters]  # by fold

    @property
    def folds(self) -> list[str]:
        return list(self.parameters)

    def simulated(self, fold: str, campaign: Campaign) -> Campaign:
        """Simulate the first samples of every run; add eps_bounce (m), contact and gate (0 to 1)."""
        how = self.ensemble
        short = shortened(campaign, how.samples)
        return with_bounce(short, self.mechanism, self.parameters[fold], how.members, how.spread, how.reach)

    def detachment(self, fold: str, campaign: Campaign) -> Array:
        inputs = SequenceInputs(("eps_bounce", "gate"))
        signals = Sequences.of(self.simulated(fold, campaign), inputs).features
        return np.asarray(signals.prod(-1)[None])


@dataclass(frozen=True)
class BounceRecipe(DetachmentRecipe):
    """The bounce simulation and its identification.

    `fit` writes the identified parameters of every fold, and bounce.json when all folds are complete. Nothing
    is random: all repeats are the same for every seed. All fits run on the processor. The detachment is zero
    in simulated contact.

    Attributes:
        mechanism: constants of the bench.
        members: number of simulations to average.
        spread: standard deviation of the logarithms of their parameters; default 0.1.
        reach: number of samples before and after a simulated flight that still count as flight; default 2.
        samples: number of samples after which a run is cut off; default 200.
    """

    mechanism: CamFollower
    members: int
    spread: float = 0.1
    reach: int = 2
    samples: int = 200

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
        ensemble = Ensemble(self.members, self.spread, self.reach, self.samples)
        begin = time.process_time()
        with threads_of(workers) as pool:
            found = list(pool.map(lambda rows: _identified(campaign, rows, self.mechanism), folds.values()))
        for k, parameters in enumerate(found):
            parameters.write(out / f"{k:02d}.json")
        how = {name: getattr(ensemble, name) for name in ("members", "spread", "reach", "samples")}
        write_json(out / SUMMARY, {"folds": list(folds), **how})
        return time.process_time() - begin

    def read(self, folder: Path) -> BounceFits:
        summary = read_json(folder / SUMMARY)
        try:
            ensemble = Ensemble(*(summary[name] for name in ("members", "spread", "reach", "samples")))
            names = [str(name) for name in summary["folds"]]
        except (KeyError, TypeError):
            raise BadInput(f"{folder / SUMMARY}: does not say how the simulation is used") from None
        parameters = {name: BounceParameters.read(folder / f"{k:02d}.json") for k, name in enumerate(names)}
        return BounceFits(self.mechanism, ensemble, parameters)


def _identified(campaign: Campaign, rows: Indices, mechanism: CamFollower) -> BounceParameters:
    """Identify on training runs; the starting values where these runs have hardly any flight."""
    t = campaign.signals["t"]
    last = round(STRETCH / float(t[1] - t[0]))
    flights = (
        np.any(np.abs(campaign.signals["eps"][a + 1 : max(a + 1, b - last)]) > AWAY)
        for a, b in zip(campaign.offsets[rows], campaign.offsets[rows + 1], strict=True)
    )
    return fit_bounce(campaign, rows, mechanism) if any(flights) else START


def shortened(campaign: Campaign, samples: int) -> Campaign:
    """Cut every run off after a number of samples."""
    lengths = np.minimum(np.diff(campaign.offsets), samples)
    offsets = np.append(0, np.cumsum(lengths))
    kept = np.repeat(campaign.offsets[:-1] - offsets[:-1], lengths) + np.arange(offsets[-1])
    signals = {name: values[kept] for name, values in campaign.signals.items()}
    return replace(campaign, signals=signals, offsets=offsets)
