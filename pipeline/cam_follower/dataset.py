"""Resampled trajectories of a campaign as tensors."""

from dataclasses import dataclass

import torch
from torch import Tensor

from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.conditions import Bench, Conditions
from unmodelled.base.arrays import Indices
from unmodelled.base.campaign import Campaign


@dataclass(frozen=True)
class Dataset:
    """Trajectories on one uniform clock, one experiment after the other."""

    bench: Bench
    theta: Tensor  # (samples,), angle of the cam, rad
    omega: Tensor  # (samples,), speed of the cam, rad/s
    offsets: Tensor  # (experiments + 1,), first samples of the experiments, and the number of all samples
    conditions: Conditions  # (experiments,)
    period: float  # s

    @classmethod
    def of(cls, campaign: Campaign, mechanism: CamFollower) -> "Dataset":
        """Convert a resampled campaign."""
        bench = Bench.of(mechanism, campaign.experiments)
        theta, omega = (torch.tensor(campaign.signals[k], dtype=torch.float32) for k in ("theta", "omega"))
        t = campaign.signals["t"]
        return cls(
            bench,
            theta,
            omega,
            torch.tensor(campaign.offsets),
            bench.conditions(campaign.experiments),
            round(float(t[1] - t[0]), 6),
        )

    @property
    def lengths(self) -> Tensor:
        """Number of samples of every experiment, shape (experiments,)."""
        return self.offsets.diff()

    def samples_of(self, runs: Indices) -> Tensor:
        """Return the indices (samples,) of all samples of some experiments (runs,)."""
        return torch.cat([torch.arange(int(self.offsets[r]), int(self.offsets[r + 1])) for r in runs])

    def owner(self) -> Tensor:
        """Return the number of the experiment of every sample; gives (samples,)."""
        return torch.repeat_interleave(torch.arange(len(self.lengths)), self.lengths)

    def initial_state(self, runs: Tensor) -> tuple[Tensor, Tensor]:
        """Return the first measured angle and speed of experiments, in the shape of `runs` (any)."""
        first = self.offsets[runs]
        return self.theta[first], self.omega[first]
