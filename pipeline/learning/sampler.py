"""Drawing training samples for a stack of models, and the scale of their inputs."""

from __future__ import annotations

import torch
from torch import Generator, Tensor

from pipeline.models.dataset import Dataset, Indices


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
