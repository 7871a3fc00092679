"""Training of hybrid models over windows of free run: eq. 4.9 with N = 1 (feedforward) or more
(recurrent).
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import torch
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput
from unmodelled.base.workers import threads_of
from unmodelled.engine.compiled.compiled import kernel
from unmodelled.engine.compiled.training import train
from unmodelled.engine.free_run import Integration
from unmodelled.models.nnap import Nnap
from unmodelled.models.rollout import Measured, arguments

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class Training(Protocol):
    """How a stack is trained: a frozen dataclass whose `repr` holds all that decides the result.

    Attributes:
        horizon: steps of free run that the loss looks ahead. epochs: of every member.
    """

    @property
    def horizon(self) -> int: ...

    @property
    def epochs(self) -> int: ...

    def train(self, problem: Problem, stack: list[Progress]) -> Iterator[int]:
        """Train `stack` to the end; it may be saved whenever the epochs done over all members are yielded."""
        ...


@dataclass(frozen=True)
class Windows:
    """How a stack is trained.

    Attributes:
        horizon: steps N that a window is simulated from its measured first state.
        epochs: passes over all windows. batch: windows per mini-batch.
        rate: of Adam at the start, for the weights; it falls to zero along a cosine.
        physics_rate: the same for the scaled parameters.
        clip: largest norm of the gradient of one mini-batch.
        workers: members of the stack that are trained side by side.
    """

    horizon: int
    epochs: int
    batch: int = 200
    rate: float = 3e-3
    physics_rate: float = 3e-3
    clip: float = 10.0
    workers: int = field(default=2, repr=False)

    def train(self, problem: Problem, stack: list[Progress]) -> Iterator[int]:
        """Train `stack` to the end, every member a few epochs at a time; `stack` may be saved between.

        Yields:
            Epochs done over all members.
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
    """Where the training of one member stands; everything that a checkpoint needs.

    Attributes:
        p: (parameters,) SI. xi: (trained,). weights: (size,). moments_p, moments_W: of Adam, (2, ...).
        epoch: finished epochs. batches: finished mini-batches. losses: mean loss of every epoch.
        history: (trained,) parameters after every epoch, SI. seconds: spent on each epoch.
        diverged: training met a loss that is not finite, and stopped with the weights of the epoch before.
        nodes: (segments, states) first states of segments, where they are trained.
    """

    p: Array
    xi: Array
    weights: Array
    moments_p: Array
    moments_W: Array
    epoch: int = 0
    batches: int = 0
    losses: list[float] = field(default_factory=list)
    history: list[Array] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    diverged: bool = False
    nodes: Array = field(default_factory=lambda: np.empty((0, 0)))

    @classmethod
    def start(cls, model: Nnap, member: int) -> Progress:
        """Nothing trained yet."""
        p, xi, weights = (
            a[member].detach().double().cpu().numpy().copy()
            for a in (model.physics(), model.xi, model.weights)
        )
        return cls(p, xi, weights, np.zeros((2, len(xi))), np.zeros((2, len(weights))))


@dataclass(frozen=True)
class Problem:
    """What is fitted to what: shared by all members of a stack.

    Attributes:
        model: the stack as it starts. data: measured samples.
        runs: training experiments of every member. bounds: (trained, 2) of the parameters, SI.
        penalties: (networks,) price of their mean squared effort.
        how: integration. seed: of the mini-batches.
    """

    model: Nnap
    data: Measured
    runs: list[Indices]
    bounds: Array
    penalties: Array
    how: Integration
    seed: int


def weighting(data: Measured, runs: Indices, horizon: int) -> Array:
    """(states,) diagonal of C, eq. 4.9: the loss is the share of the change over a window that is not
    explained.
    """
    starts = data.window_starts(runs, horizon)
    if not len(starts):
        return np.ones(data.x.shape[1])
    change = data.x[starts + horizon] - data.x[starts]
    power = np.mean(np.square(change), axis=0)
    return np.asarray(1.0 / np.where(power > 0.0, power, 1.0))


def train_epochs(problem: Problem, windows: Windows, stack: list[Progress], epochs: int) -> None:
    """Train every member by up to `epochs` more epochs, `windows.workers` of them side by side."""
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
    """First samples of the windows of one epoch, (batches, windows per batch).

    Drawn from the epoch's own seed, so that a resumed training sees the same mini-batches.

    Raises:
        BadInput: when no experiment is as long as the horizon.
    """
    starts = problem.data.window_starts(problem.runs[member], windows.horizon)
    if not len(starts):
        raise BadInput(f"no training experiment has more than {windows.horizon} samples, the horizon")
    rng = np.random.default_rng([problem.seed, member, windows.horizon, epoch])
    batch = min(windows.batch, len(starts))
    count = len(starts) // batch
    return rng.permutation(starts)[: count * batch].reshape(count, batch)


def fall(windows: Windows, epoch: int, count: int) -> Array:
    """(count,) learning rate of the mini-batches of an epoch, as a share of the first one: a cosine."""
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
    """`model` with the weights and parameters that training reached."""
    with torch.no_grad():
        for m, state in enumerate(stack):
            model.weights[m] = torch.from_numpy(state.weights)
            model.xi[m] = torch.from_numpy(state.xi)
    return model
