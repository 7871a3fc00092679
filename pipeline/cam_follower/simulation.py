"""The bounce simulation as a model of the detachment, without a network."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pipeline.arrays import Array, Indices
from pipeline.cam_follower.bounce import BounceParameters
from pipeline.cam_follower.bounce_fitting import AWAY, START, STRETCH, fit_bounce
from pipeline.cam_follower.bounce_gate import with_bounce
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.detachment import Fitted
from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json, write_json
from unmodelled.base.workers import threads_of

#: Written when all folds of a folder are there.
SUMMARY = "bounce.json"


@dataclass(frozen=True)
class Ensemble:
    """Settings of the averaged simulations.

    Attributes:
        members: number of simulations to average.
        spread: standard deviation of the logarithms of their parameters.
        reach: number of samples before and after a simulated flight that still count as flight.
        samples: number of samples after which a run is cut off.

    Raises:
        BadInput: when a setting is out of range.
    """

    members: int
    spread: float
    reach: int
    samples: int

    def __post_init__(self) -> None:
        if min(self.members, self.samples) < 1 or self.reach < 0 or self.spread < 0.0:
            raise BadInput(f"bounce: members and samples must be positive, the rest not negative, got {self}")


@dataclass(frozen=True)
class BounceFits:
    """Identified simulations of all folds.

    Attributes:
        mechanism: constants of the bench.
        ensemble: settings of the averaged simulations.
        parameters: identified parameters by fold.
    """

    mechanism: CamFollower
    ensemble: Ensemble
    parameters: Mapping[str, BounceParameters]

    @property
    def folds(self) -> list[str]:
        """Names of the folds."""
        return list(self.parameters)

    @property
    def parts(self) -> dict[str, Fitted]:
        """Models that the simulation builds on: none."""
        return {}

    @property
    def explainable(self) -> dict[str, list[DetachmentNetwork]]:
        """Networks of the folds: none, because a simulation has no network."""
        return {}

    def simulated(self, fold: str, campaign: Campaign) -> Campaign:
        """Simulate the first samples of every run, and add the signals eps_bounce (m), contact and gate (0 to
        1).
        """
        how = self.ensemble
        short = shortened(campaign, how.samples)
        return with_bounce(short, self.mechanism, self.parameters[fold], how.members, how.spread, how.reach)

    def detachment(self, fold: str, campaign: Campaign) -> Array:
        """Predict the detachment eps of all runs; zero in simulated contact.

        Gives (1, runs, steps) in m.
        """
        inputs = SequenceInputs(("eps_bounce", "gate"))
        signals = Sequences.of(self.simulated(fold, campaign), inputs).features
        return np.asarray(signals.prod(-1)[None])


@dataclass(frozen=True)
class BounceRecipe:
    """The bounce simulation and its identification.

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
        """Write the identified parameters of every fold, and bounce.json when all folds are complete.

        Nothing is random: all repeats are the same for every seed. All fits run on the processor.

        Args:
            campaign: resampled runs with the signals t, theta and eps.
            folds: rows of the training runs by the name of the fold, each of shape (runs,).
            repeats: unused, because all repeats are the same.
            seed: unused, because nothing is random.
            out: folder of the results.
            workers: number of fits that run side by side; default 2.
            device: unused, because all fits run on the processor.

        Returns:
            Time that all fits took, core seconds.

        Raises:
            BadInput: when the data do not suit the simulation.
        """
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
        """Read the simulations that `fit` wrote.

        Args:
            folder: folder of the results.

        Raises:
            BadInput: when a file is missing or damaged.
        """
        summary = read_json(folder / SUMMARY)
        try:
            ensemble = Ensemble(*(summary[name] for name in ("members", "spread", "reach", "samples")))
            names = [str(name) for name in summary["folds"]]
        except (KeyError, TypeError):
            raise BadInput(f"{folder / SUMMARY}: does not say how the simulation is used") from None
        parameters = {name: BounceParameters.read(folder / f"{k:02d}.json") for k, name in enumerate(names)}
        return BounceFits(self.mechanism, ensemble, parameters)


def _identified(campaign: Campaign, rows: Indices, mechanism: CamFollower) -> BounceParameters:
    """Identify the simulation on training runs; with hardly any flight in these runs, return the starting
    values.
    """
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
