"""Draw training samples for a stack of models, and scale their inputs."""

from collections.abc import Callable, Iterable

import torch
from torch import Generator, Tensor

from pipeline.cam_follower.dataset import Dataset
from unmodelled.base.arrays import Indices


class Sampler:
    """Random training samples for a stack of models, each from its own experiments.

    Every experiment has the same weight, short or long (eq. 6.16).
    """

    def __init__(self, dataset: Dataset, folds: list[Indices], generator: Generator) -> None:
        self.dataset, self.generator = dataset, generator
        self.counts = torch.tensor([len(f) for f in folds])[:, None]
        self.runs = torch.zeros(len(folds), int(self.counts.max()), dtype=torch.long)
        for row, fold in zip(self.runs, folds, strict=True):
            row[: len(fold)] = torch.as_tensor(fold)

    def draw(self, size: int, horizon: int = 1) -> tuple[Tensor, Tensor]:
        """Draw windows for every model; gives (stack, size)."""
        shape = (len(self.counts), size)
        pick = (torch.rand(shape, generator=self.generator) * self.counts).long()
        runs = self.runs.gather(1, pick.clamp_max(self.counts - 1))
        room = (self.dataset.lengths[runs] - horizon).clamp_min(1)
        start = (torch.rand(shape, generator=self.generator) * room).long().clamp_max(room - 1)
        return runs, self.dataset.offsets[runs] + start


def input_scale(inputs: Tensor, dataset: Dataset, folds: list[Indices]) -> Tensor:
    """Return the standard deviation (stack, inputs) of every input over each model's training samples."""

    def scale(fold: Indices) -> Tensor:
        std = inputs[dataset.samples_of(fold)].std(0)
        # an input that never varies in training keeps its own size: dividing by zero helps nobody
        return torch.where(std > 1e-9, std, torch.ones_like(std))

    return once_per_fold(folds, lambda distinct: [scale(fold) for fold in distinct])


def once_per_fold(folds: list[Indices], work: Callable[[list[Indices]], Iterable[Tensor]]) -> Tensor:
    """Compute a result once per distinct training set (experiments,), and repeat it for its models."""
    distinct = {fold.tobytes(): fold for fold in folds}
    results = dict(zip(distinct, work(list(distinct.values())), strict=True))
    return torch.stack([results[fold.tobytes()] for fold in folds])
