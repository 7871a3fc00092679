"""Train hybrid models on short windows of free run: eq. 4.9 with N = 1 (feedforward) or more (recurrent)."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import torch

from unmodelled.base.arrays import Array, Indices
from unmodelled.base.errors import BadInput
from unmodelled.base.workers import threads_of
from unmodelled.engine.compiled.compiled import kernel
from unmodelled.engine.compiled.training import train
from unmodelled.engine.free_run import Integration
from unmodelled.learning.nnap import Nnap
from unmodelled.learning.rollout import Measured, arguments


class Training(Protocol):
    """Settings of a training: a frozen dataclass whose `repr` holds everything that decides the result."""

    @property
    def horizon(self) -> int:
        """Number of samples of free run that the loss looks ahead."""

    @property
    def epochs(self) -> int:
        """Number of passes over the training data, of every model of a stack."""

    def train(self, problem: Problem, stack: list[Progress]) -> Iterator[int]:
        """Train a stack to the end.

        Args:
            problem: models and data.
            stack: state of the training of every model, which is changed in place.

        Yields:
            Number of epochs done over all models; the stack may be saved whenever it is yielded.
        """
        ...


@dataclass(frozen=True)
class Windows:
    """Settings of a training on windows that start at measured states.

    Attributes:
        horizon: number of samples N that a window is simulated.
        epochs: passes over all windows.
        batch: windows per mini-batch.
        rate: learning rate of Adam for the weights at the start; it falls to zero along a cosine; default
            0.003.
        physics_rate: learning rate of the scaled parameters at the start; default 0.003.
        clip: largest norm of the gradient of one mini-batch; default 10.
        workers: number of models of a stack that are trained side by side; default 2.

    Examples:
        >>> Windows(horizon=20, epochs=100)
        Windows(horizon=20, epochs=100, batch=200, rate=0.003, physics_rate=0.003, clip=10.0)
    """

    horizon: int
    epochs: int
    batch: int = 200
    rate: float = 3e-3
    physics_rate: float = 3e-3
    clip: float = 10.0
    workers: int = field(default=2, repr=False)

    def train(self, problem: Problem, stack: list[Progress]) -> Iterator[int]:
        """Train a stack to the end, every model a few epochs at a time.

        Args:
            problem: models and data.
            stack: state of the training of every model, which is changed in place.

        Yields:
            Number of epochs done over all models; the stack may be saved whenever it is yielded.

        Raises:
            BadInput: when no training experiment of a model is as long as the horizon.
        """
        chunk = 1
        while any(s.epoch < self.epochs and not s.diverged for s in stack):
            begin = time.monotonic()
            train_epochs(problem, self, stack, chunk)
            yield sum(self.epochs if s.diverged else s.epoch for s in stack)
            # about a second at a time
            chunk = max(1, round(chunk / max(time.monotonic() - begin, 0.1)))


@dataclass
class Progress:
    """State of the training of one model: everything that a checkpoint needs."""

    p: Array  # (parameters,), of the system, in SI units
    xi: Array  # (trained,), scaled to order one
    weights: Array  # (size,), of all networks
    moments_p: Array  # (2, trained), of Adam
    moments_W: Array  # (2, size), of Adam
    epoch: int = 0  # number of finished epochs
    batches: int = 0  # number of finished mini-batches
    losses: list[float] = field(default_factory=list)  # mean of every epoch
    history: list[Array] = field(default_factory=list)  # (trained,), after every epoch, in SI units
    seconds: list[float] = field(default_factory=list)  # of every epoch
    diverged: bool = False  # a loss was not finite; the weights are those of the epoch before
    #: (segments, states), trained first states, in SI units; empty where none are trained.
    nodes: Array = field(default_factory=lambda: np.empty((0, 0)))

    @classmethod
    def start(cls, model: Nnap, member: int) -> Progress:
        """Return the state before training."""
        p, xi, weights = (
            a[member].detach().double().cpu().numpy().copy()
            for a in (model.physics(), model.xi, model.weights)
        )
        return cls(p, xi, weights, np.zeros((2, len(xi))), np.zeros((2, len(weights))))


@dataclass(frozen=True)
class Problem:
    """A stack of models and the data that they are fitted to."""

    model: Nnap  # untrained
    data: Measured
    runs: list[Indices]  # (experiments,), for training, of every model
    bounds: Array  # (trained, 2), in SI units
    penalties: Array  # (networks,), of the mean squared efforts, per squared unit
    how: Integration
    seed: int  # of the mini-batches


def weighting(data: Measured, runs: Indices, horizon: int) -> Array:
    """Return the weights (states,) of the states in the loss: the diagonal of C, eq. 4.9.

    With these weights the loss is the share of the change over a window that the model does not explain.
    """
    starts = data.window_starts(runs, horizon)
    if not len(starts):
        return np.ones(data.x.shape[1])
    change = data.x[starts + horizon] - data.x[starts]
    power = np.mean(np.square(change), axis=0)
    return np.asarray(1.0 / np.where(power > 0.0, power, 1.0))


def train_epochs(problem: Problem, windows: Windows, stack: list[Progress], epochs: int) -> None:
    """Train every model of a stack by a few more epochs, `windows.workers` models side by side."""
    kernel(problem.model.structure)  # generated once, not by every thread
    with threads_of(windows.workers) as pool:
        jobs = [pool.submit(_member, problem, windows, stack[m], m, epochs) for m in range(len(stack))]
        for job in jobs:
            job.result()


def _member(problem: Problem, windows: Windows, state: Progress, member: int, epochs: int) -> None:
    runs, data = problem.runs[member], problem.data
    C_x = weighting(data, runs, windows.horizon)
    for _ in range(min(epochs, windows.epochs - state.epoch)):
        if state.diverged:
            return
        begin = time.perf_counter()
        kept = state.p.copy(), state.xi.copy(), state.weights.copy()
        losses = _epoch(problem, windows, state, member, C_x)
        if not np.all(np.isfinite(losses)):
            state.p, state.xi, state.weights = kept
            state.diverged = True
            return
        state.epoch += 1
        state.batches += len(losses)
        state.losses.append(float(losses.mean()))
        state.history.append(state.p[list(problem.model.structure.index)].copy())
        state.seconds.append(time.perf_counter() - begin)


def drawn_windows(problem: Problem, windows: Windows, member: int, epoch: int) -> Indices:
    """Draw the mini-batches (batches, windows per batch) of one epoch.

    They are drawn from the epoch's own seed, so that a resumed training sees the same mini-batches.
    """
    starts = problem.data.window_starts(problem.runs[member], windows.horizon)
    if not len(starts):
        raise BadInput(f"no training experiment has more than {windows.horizon} samples, the horizon")
    rng = np.random.default_rng([problem.seed, member, windows.horizon, epoch])
    batch = min(windows.batch, len(starts))
    count = len(starts) // batch
    return rng.permutation(starts)[: count * batch].reshape(count, batch)


def fall(windows: Windows, epoch: int, count: int) -> Array:
    """Return the learning rates (count,) of an epoch's mini-batches, relative to the first: a cosine.

    Examples:
        >>> fall(Windows(horizon=1, epochs=2), epoch=1, count=2).round(3).tolist()
        [0.5, 0.146]
    """
    done = (epoch + np.arange(count) / count) / windows.epochs
    return np.asarray(0.5 * (1.0 + np.cos(np.pi * done)))


def _epoch(problem: Problem, windows: Windows, state: Progress, member: int, C_x: Array) -> Array:
    drawn = drawn_windows(problem, windows, member, state.epoch)
    shares = fall(windows, state.epoch, len(drawn))
    model, how, data = problem.model, problem.how, problem.data
    unit = model.unit.cpu().numpy()
    scale, gain = (a[member].cpu().numpy() for a in (model.scale, model.gain))
    k = kernel(model.structure)
    losses: Array = train(
        *(k.evaluate, k.pull, k.layout, drawn, windows.rate * shares, windows.physics_rate * shares),
        *(state.batches, windows.clip, data.owner, data.x, data.u, data.c, data.t, windows.horizon),
        *(*arguments(how), state.p, state.weights, scale, gain),
        *(np.asarray(model.structure.index, np.int64), unit),
        *(problem.bounds[:, 0].copy(), problem.bounds[:, 1].copy(), C_x, problem.penalties),
        *(state.xi, state.moments_p, state.moments_W),
    )
    return losses


def finished(model: Nnap, stack: list[Progress]) -> Nnap:
    """Put the weights and parameters that training reached into a stack."""
    with torch.no_grad():
        for m, state in enumerate(stack):
            model.weights[m] = torch.from_numpy(state.weights)
            model.xi[m] = torch.from_numpy(state.xi)
    return model
