"""Train a network on top of the identified motor, over windows of free run."""

import torch
from torch import Generator, Tensor

from pipeline.cam_follower import free_run
from pipeline.cam_follower.dataset import Dataset
from pipeline.cam_follower.integrate import step
from pipeline.cam_follower.motor import Motor, MotorHybrid
from pipeline.cam_follower.one_step import Networked, new_model
from pipeline.cam_follower.sampler import Sampler, once_per_fold
from unmodelled.base.arrays import Indices
from unmodelled.base.progress import track
from unmodelled.learning.adam import Adam


def identified_motors(dataset: Dataset, folds: list[Indices], seed: int) -> Tensor:
    """Identify motors (stack, 6); models with the same training experiments share one."""
    return once_per_fold(folds, lambda distinct: free_run.fit(Motor, dataset, distinct, seed).parameters_)


def window_error(model: MotorHybrid, dataset: Dataset, runs: Tensor, first: Tensor, horizon: int) -> Tensor:
    """Return the mean squared error (stack, windows), (rad/s)^2, over windows from measured states."""
    q = dataset.conditions[runs]
    theta, omega = dataset.theta[first], dataset.omega[first]
    total = torch.zeros_like(omega)
    for k in range(1, horizon + 1):
        k1 = model.acceleration(theta, omega, q)
        theta, omega = step(
            lambda a, w: model.acceleration(a, w, q), k1, theta, omega, dataset.period, model.method
        )
        total = total + (omega - dataset.omega[first + k]).square()
    return total / horizon


def fit(
    build: Networked,
    dataset: Dataset,
    folds: list[Indices],
    seed: int,
    steps: int,
    learning_rate: float,
    batch: int,
    horizon: int,
    penalty: float,
) -> MotorHybrid:
    """Identify the motor of every fold, then train the network on top of it.

    Args:
        build: constructor of the stack of models.
        dataset: measured trajectories.
        folds: training experiments of each model of the stack, each of shape (experiments,).
        seed: seed of the starts, the initial weights and the windows.
        steps: number of mini-batches.
        learning_rate: learning rate of Adam at the start; it falls to zero along a cosine.
        batch: number of windows per mini-batch and model.
        horizon: number of samples of a window.
        penalty: weight of the mean squared torque of the network, relative to `MotorHybrid.OUTPUT`, in
            (rad/s)^2; it keeps the torque at zero where the physics is right.

    Returns:
        The trained stack.

    Raises:
        TypeError: when `build` makes another model than a `MotorHybrid`.
    """
    generator = Generator().manual_seed(seed)
    model = new_model(build, dataset, folds, generator)
    if not isinstance(model, MotorHybrid):
        raise TypeError(f"multi-step training must get a MotorHybrid, got {type(model).__name__}")
    model.parameters_.data[:] = identified_motors(dataset, folds, seed)
    sampler = Sampler(dataset, folds, generator)
    optimiser = Adam(model.network.parameters(), lr=learning_rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps)
    for _ in track(range(steps), steps, f"training {len(folds)} hybrids"):
        runs, first = sampler.draw(batch, horizon)
        error = window_error(model, dataset, runs, first, horizon)
        inputs = model.inputs(dataset.theta[first], dataset.omega[first], dataset.conditions[runs])
        loss = error.mean(1) + penalty * model.network(inputs).square().mean(1)
        optimiser.zero_grad(set_to_none=True)
        loss.sum().backward()
        optimiser.step()
        schedule.step()
    return model
