"""Resampled trajectories as tensors, ready to be drawn from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Generator, Tensor

from pipeline.models.conditions import Bench, Conditions
from pipeline.physics.mechanisms.cam_follower import CamFollower
from pipeline.trajectory import Campaign

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


class Sampler:
    """Draws training samples for a stack of models, each from its own experiments.

    Every experiment weighs the same however long it is, as in eq. 6.16.

    Args:
        dataset: where to draw from.
        folds: the training experiments of each model of the stack.
        generator: source of randomness.
    """

    def __init__(self, dataset: Dataset, folds: list[Indices], generator: Generator) -> None:
        self.dataset, self.generator = dataset, generator
        self.counts = torch.tensor([len(f) for f in folds])[:, None]
        self.runs = torch.zeros(len(folds), int(self.counts.max()), dtype=torch.long)
        for row, fold in zip(self.runs, folds, strict=True):
            row[: len(fold)] = torch.as_tensor(fold)

    def draw(self, size: int, horizon: int = 1) -> tuple[Tensor, Tensor]:
        """Experiments and first samples of `size` windows a model.

        Args:
            size: windows per model.
            horizon: samples that must follow the first one within its experiment.

        Returns:
            Experiments and samples, both (stack, size), int64.
        """
        shape = (len(self.counts), size)
        pick = (torch.rand(shape, generator=self.generator) * self.counts).long()
        runs = self.runs.gather(1, pick.clamp_max(self.counts - 1))
        room = (self.dataset.lengths[runs] - horizon).clamp_min(1)
        start = (torch.rand(shape, generator=self.generator) * room).long().clamp_max(room - 1)
        return runs, self.dataset.offsets[runs] + start


def input_scale(inputs: Tensor, dataset: Dataset, folds: list[Indices]) -> Tensor:
    """Standard deviation of every input over each model's own training samples, (stack, inputs).

    Args:
        inputs: (samples, inputs) the inputs at all samples of the dataset.
        dataset: owner of the samples.
        folds: the training experiments of each model of the stack.
    """
    scales: dict[bytes, Tensor] = {}
    for fold in folds:
        if fold.tobytes() not in scales:
            # an input that never varies in training keeps its own size: dividing by zero helps nobody
            std = inputs[dataset.samples_of(fold)].std(0)
            scales[fold.tobytes()] = torch.where(std > 1e-9, std, torch.ones_like(std))
    return torch.stack([scales[fold.tobytes()] for fold in folds])
