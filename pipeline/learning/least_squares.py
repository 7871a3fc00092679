"""Closed-form fit of the linear model."""

from __future__ import annotations

from collections.abc import Callable

import torch

from pipeline.models.conditions import Bench
from pipeline.models.dataset import Dataset, Indices
from pipeline.models.linear import Linear


def fit(build: Callable[[Bench, int], Linear], dataset: Dataset, folds: list[Indices], seed: int) -> Linear:
    """Minimise the one-step error of eq. 6.16 in closed form; `seed` has no effect.

    Args:
        build: constructor of the models.
        dataset: trajectories.
        folds: training experiments of each model of the stack.
        seed: unused, there is nothing random.
    """
    model = build(dataset.bench, len(folds))
    solved: dict[bytes, torch.Tensor] = {}
    owner = dataset.owner()
    for b, fold in enumerate(folds):
        if fold.tobytes() not in solved:
            now = dataset.samples_of(fold)
            now = now[owner[now] == owner[(now + 1).clamp_max(len(owner) - 1)]][:-1]
            inputs = model.inputs(dataset.theta[now], dataset.omega[now], dataset.conditions[owner[now]])
            target = (dataset.omega[now + 1] - dataset.omega[now]) / dataset.period
            weight = dataset.lengths[owner[now]].rsqrt()[:, None]
            solution = torch.linalg.lstsq((inputs * weight).double(), (target[:, None] * weight).double())
            solved[fold.tobytes()] = solution.solution.float()
        model.weights.data[b] = solved[fold.tobytes()]
    return model
