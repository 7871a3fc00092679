"""Fit the linear model in closed form."""

from collections.abc import Callable

import torch

from pipeline.cam_follower.conditions import Bench
from pipeline.cam_follower.dataset import Dataset
from pipeline.cam_follower.linear import Linear
from pipeline.cam_follower.sampler import once_per_fold
from unmodelled.base.arrays import Indices

#: Singular values below this share of the largest count as zero: inputs are in single precision.
RANK = 1e-6


def fit(build: Callable[[Bench, int], Linear], dataset: Dataset, folds: list[Indices], seed: int) -> Linear:
    """Minimise the one-step error of eq. 6.16 in closed form.

    Args:
        build: constructor of the stack of models.
        dataset: measured trajectories.
        folds: training experiments of each model of the stack, each of shape (experiments,).
        seed: unused, because nothing is random.

    Returns:
        The fitted stack.
    """
    model = build(dataset.bench, len(folds))
    model.weights.data[:] = once_per_fold(
        folds, lambda distinct: [_solve(model, dataset, f) for f in distinct]
    )
    return model


def _solve(model: Linear, dataset: Dataset, fold: Indices) -> torch.Tensor:
    """Weights (inputs, 1) of the model that sees the experiments `fold`."""
    owner = dataset.owner()
    now = dataset.samples_of(fold)
    now = now[owner[now] == owner[(now + 1).clamp_max(len(owner) - 1)]][:-1]
    inputs = model.inputs(dataset.theta[now], dataset.omega[now], dataset.conditions[owner[now]])
    target = (dataset.omega[now + 1] - dataset.omega[now]) / dataset.period
    # in double precision throughout, and without directions that hardly vary: where settings are collinear in
    # training, rounding would decide the weights, and with the driver gelsy what happens to be in memory
    weight = dataset.lengths[owner[now]].double().rsqrt()[:, None]
    left, right = inputs.double() * weight, target[:, None].double() * weight
    solution: torch.Tensor = torch.linalg.lstsq(left, right, rcond=RANK, driver="gelsd").solution
    return solution.float()
