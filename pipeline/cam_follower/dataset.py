"""Resampled trajectories as tensors, ready to be drawn from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.conditions import Bench, Conditions
from unmodelled.base.campaign import Campaign

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Dataset:
    """Trajectories on one uniform clock.

    Attributes:
        bench: the mechanism and its cams.
        theta, omega: (samples,) angle (rad) and speed (rad/s), experiments one after the other.
        offsets: (n + 1,) experiment `i` owns `offsets[i]:offsets[i + 1]`.
        conditions: (n,) operating points.
        period: sampling period, s.
    """

    bench: Bench
    theta: Tensor
    omega: Tensor
    offsets: Tensor
    conditions: Conditions
    period: float

    @classmethod
    def of(cls, campaign: Campaign, mechanism: CamFollower) -> Dataset:
        """The dataset of a resampled campaign with signals t, theta, omega."""
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
        """(n,) samples of every experiment."""
        return self.offsets.diff()

    def samples_of(self, runs: Indices) -> Tensor:
        """Indices of all samples of the experiments `runs`."""
        return torch.cat([torch.arange(int(self.offsets[r]), int(self.offsets[r + 1])) for r in runs])

    def owner(self) -> Tensor:
        """(samples,) the experiment that owns each sample."""
        return torch.repeat_interleave(torch.arange(len(self.lengths)), self.lengths)

    def initial_state(self, runs: Tensor) -> tuple[Tensor, Tensor]:
        """First measured angle and speed of the experiments `runs`, in its shape."""
        first = self.offsets[runs]
        return self.theta[first], self.omega[first]
