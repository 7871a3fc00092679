"""Train one network until its training loss converges."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequence import passes
from pipeline.cam_follower.sequence.arrays import filled_up, room
from pipeline.cam_follower.sequence.layout import flattened, restore, sizes
from pipeline.cam_follower.sequence.passes import Adam, Runs
from pipeline.cam_follower.sequences import Sequences
from unmodelled.base.arrays import Indices


@dataclass(frozen=True)
class Training:
    """Settings of a training: Adam with a learning rate that falls when the loss stops falling.

    The training loss is averaged over `epochs` epochs, or more if these contain fewer than `updates`
    mini-batches. If `patience` averages in a row are not lower than the lowest earlier average by the share
    `tolerance`, the learning rate is multiplied by `fall`. After `falls` such reductions the training has
    converged. Held-out data are not used.

    Attributes:
        batch: largest number of runs in a mini-batch; default 32.
        rate: learning rate at the start; default 0.01.
        clip: largest norm of the gradient; default 1.
        epochs: smallest number of epochs per average; default 10.
        updates: smallest number of mini-batches per average; default 100.
        tolerance: smallest relative improvement of the average that counts; default 0.03.
        patience: number of averages without improvement before the learning rate falls; default 2.
        fall: factor of the learning rate; default 0.5.
        falls: number of reductions of the learning rate after which training has converged; default 7.
        most: number of mini-batches after which training ends in any case; default 50000.
    """

    batch: int = 32
    rate: float = 0.01
    clip: float = 1.0
    epochs: int = 10
    updates: int = 100
    tolerance: float = 0.03
    patience: int = 2
    fall: float = 0.5
    falls: int = 7
    most: int = 50_000


@dataclass
class Course:
    """Progress of a training."""

    training: Training
    losses: list[float] = field(default_factory=list)  # averages
    rates: list[float] = field(default_factory=list)  # learning rate of every average
    updates: int = 0  # mini-batches so far
    diverged: bool = False  # the loss is no longer a finite number
    _falls: int = 0
    _failures: int = 0
    _lowest: float = np.inf
    _pending: list[float] = field(default_factory=list)
    _since: int = 0

    @property
    def rate(self) -> float:
        """Learning rate of the next epoch."""
        return self.training.rate * self.training.fall**self._falls

    @property
    def converged(self) -> bool:
        """Whether the learning rate has fallen often enough."""
        return self._falls >= self.training.falls

    @property
    def over(self) -> bool:
        """Whether the training has ended: converged, diverged, or out of mini-batches."""
        return self.converged or self.diverged or self.updates >= self.training.most

    def after_epoch(self, loss: float, batches: int) -> None:
        """Record the loss of an epoch, and lower the learning rate if the loss has stopped falling."""
        self.updates += batches
        self._since += batches
        self._pending.append(loss)
        if not np.isfinite(loss):
            self.diverged = True
        if len(self._pending) < self.training.epochs or self._since < self.training.updates:
            return
        mean = float(np.mean(self._pending))
        self.losses.append(mean)
        self.rates.append(self.rate)
        self._pending, self._since = [], 0
        better = mean < (1.0 - self.training.tolerance) * self._lowest
        self._failures = 0 if better else self._failures + 1
        self._lowest = min(self._lowest, mean)
        if self._failures >= self.training.patience:
            self._falls, self._failures = self._falls + 1, 0


class Draws:
    """Endless epochs: all runs in random order, in mini-batches of equal size, the longest run first."""

    def __init__(self, lengths: Indices, batch: int, seed: int) -> None:
        self.edges = np.linspace(0, len(lengths), -(-len(lengths) // batch) + 1).astype(np.int64)
        self._which = np.repeat(np.arange(len(self.edges) - 1), np.diff(self.edges))
        self._lengths, self._generator = lengths, np.random.default_rng(seed)

    def epoch(self) -> Indices:
        """Draw the order of the runs in the next epoch; gives (runs,)."""
        order = self._generator.permutation(len(self._lengths))
        return order[np.lexsort((-self._lengths[order], self._which))]


def standardised(sequences: Sequences, network: DetachmentNetwork) -> Runs:
    """Standardise runs with the statistics of a network."""
    scale = {name: b.detach().cpu().numpy().astype(np.float64) for name, b in network.named_buffers()}
    features = sequences.features.shape[2]
    tau = np.zeros((*sequences.target.shape, filled_up(features)), np.float32)
    tau[..., :features] = (sequences.features - scale["feature_mean"]) / scale["feature_scale"]
    q = (sequences.settings - scale["setting_mean"]) / scale["setting_scale"]
    target = sequences.target / scale["target_scale"]
    return Runs(tau, q.astype(np.float32), target.astype(np.float32), sequences.lengths)


class Start(NamedTuple):
    """A network before training."""

    network: DetachmentNetwork  # with initial weights
    runs: Runs  # standardised with the statistics of the network
    seed: int  # of the order of the runs and of the dropout


def train(start: Start, training: Training, stopped: Callable[[], bool] = lambda: False) -> Course:
    """Train a network in place, on one core; other threads can run at the same time.

    If the loss is no longer finite, training ends with the weights of the last check before.

    Args:
        start: network and training runs.
        training: settings of the training.
        stopped: function that tells whether to stop early; default: never.
    """
    network, runs, seed = start
    s, p = sizes(network), flattened(network)
    adam = Adam(p, *(np.zeros_like(p) for _ in range(3)))
    draws, course = Draws(runs.lengths, training.batch, seed), Course(training)
    loaded, work = room(runs.lengths, training.batch, s)
    kept, checks = p.copy(), 0
    while not course.over and not stopped():
        loss = passes.epoch(
            adam, runs, draws.epoch(), draws.edges, s, loaded, work,
            course.rate, training.clip, network.dropout.p, course.updates, seed,
        )  # fmt: skip
        course.after_epoch(loss, len(draws.edges) - 1)
        if len(course.losses) > checks and not course.diverged:
            kept, checks = adam.p.copy(), len(course.losses)
    restore(network, kept if course.diverged else adam.p)
    return course
