"""Train the ReLU-ODE models on one-step-ahead predictions, eqs. 6.15 to 6.19."""

from typing import Protocol

import torch
from torch import Generator, Tensor

from pipeline.cam_follower.conditions import Bench
from pipeline.cam_follower.dataset import Dataset
from pipeline.cam_follower.dynamics import Dynamics
from pipeline.cam_follower.sampler import Sampler, input_scale
from unmodelled.base.arrays import Indices
from unmodelled.base.progress import Counter
from unmodelled.learning.adam import Adam


class Networked(Protocol):
    """A constructor of a stack of models that contain a network."""

    def __call__(self, bench: Bench, scale: Tensor, generator: Generator) -> Dynamics: ...


def new_model(build: Networked, dataset: Dataset, folds: list[Indices], generator: Generator) -> Dynamics:
    """Return a stack of untrained models, with inputs scaled by each fold's own experiments (n,)."""
    probe = build(dataset.bench, torch.ones(1, 1), generator)
    values = probe.inputs(dataset.theta, dataset.omega, dataset.conditions[dataset.owner()])
    return build(dataset.bench, input_scale(values, dataset, folds), generator)


def fit(
    build: Networked,
    dataset: Dataset,
    folds: list[Indices],
    seed: int,
    steps: int,
    learning_rate: float,
    batch: int,
    group: int,
    warm_up: int = 0,
    horizon: int = 1,
) -> Dynamics:
    """Train a stack of models with Adam on mini-batches of one-step predictions.

    A model with a memory is led along the first samples of measured windows and then runs freely
    (backpropagation through time).

    Args:
        build: constructor of the stack of models.
        dataset: measured trajectories.
        folds: training experiments of each model of the stack, each of shape (experiments,).
        seed: seed of the initial weights and the mini-batches.
        steps: number of mini-batches.
        learning_rate: learning rate of Adam at the start; it falls to zero along a cosine.
        batch: number of samples per mini-batch and model.
        group: number of models that are trained side by side; larger groups share operator calls but exceed
            the cache.
        warm_up: number of measured samples at the start of a window that only fill the memory; default 0.
        horizon: number of samples that are predicted after it, each from the prediction before; default 1.

    Returns:
        The trained stack.
    """
    generator = Generator().manual_seed(seed)
    whole = new_model(build, dataset, folds, generator)
    groups = range(0, len(folds), group)
    states = []
    with Counter(len(groups) * steps, f"training {len(folds)} models") as counter:
        for done, first in enumerate(groups):
            members = folds[first : first + group]
            model = new_model(build, dataset, members, generator)
            sampler = Sampler(dataset, members, generator)
            optimiser = Adam(model.parameters(), lr=learning_rate)
            schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps)
            for k in range(steps):
                _step(model, dataset, sampler.draw(batch, warm_up + horizon), optimiser, warm_up, horizon)
                schedule.step()
                counter.update(done * steps + k + 1)
            states.append(model.state_dict())
    # every tensor of a model has the stack as its first axis
    whole.load_state_dict({key: torch.cat([s[key] for s in states]) for key in states[0]})
    return whole


def _step(
    model: Dynamics,
    dataset: Dataset,
    drawn: tuple[Tensor, Tensor],
    optimiser: torch.optim.Optimizer,
    warm_up: int,
    horizon: int,
) -> None:
    runs, now = drawn
    q = dataset.conditions[runs]
    theta, omega = dataset.theta[now], dataset.omega[now]
    memory, loss = model.begin(theta, omega, q), torch.zeros(len(now))
    for k in range(warm_up + horizon):
        acceleration, memory = model.react(memory, theta, omega, q)
        if k < warm_up:
            theta, omega = dataset.theta[now + k + 1], dataset.omega[now + k + 1]
            continue
        theta, omega = theta + dataset.period * omega, omega + dataset.period * acceleration
        loss = loss + (omega - dataset.omega[now + k + 1]).square().mean(1)
    optimiser.zero_grad(set_to_none=True)
    # the models share nothing, so that the sum trains each of them on its own mean
    (loss.sum() / horizon).backward()  # type: ignore[no-untyped-call]
    optimiser.step()
