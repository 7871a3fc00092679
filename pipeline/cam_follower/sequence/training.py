"""Training of one network until its own training loss says that it has converged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequence import passes
from pipeline.cam_follower.sequence.arrays import Indices, filled_up, room
from pipeline.cam_follower.sequence.layout import flattened, restore, sizes
from pipeline.cam_follower.sequence.passes import Adam, Runs
from pipeline.cam_follower.sequences import Sequences


@dataclass(frozen=True)
class Training:
    """How a network is trained: Adam whose rate falls where the loss no longer does.

    The training loss is averaged over `epochs` epochs, or more where these are less than `updates`
    mini-batches. When `patience` such means in a row are not lower than the lowest before by the share
    `tolerance`, the rate is multiplied with `fall`; after `falls` of these the training has converged. Data
    that are not trained on play no part.

    Attributes:
        batch: most runs in a mini-batch. rate: first one. clip: longest gradient.
        most: updates after which training ends in any case.
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
    """Where a training stands.

    Attributes:
        losses, rates: mean loss of every check, and the rate that led to it. updates: mini-batches so far.
        diverged: whether the loss is no longer a number.
    """

    training: Training
    losses: list[float] = field(default_factory=list)
    rates: list[float] = field(default_factory=list)
    updates: int = 0
    diverged: bool = False
    _falls: int = 0
    _failures: int = 0
    _lowest: float = np.inf
    _pending: list[float] = field(default_factory=list)
    _since: int = 0

    @property
    def rate(self) -> float:
        """Of the next epoch."""
        return self.training.rate * self.training.fall**self._falls

    @property
    def converged(self) -> bool:
        """Whether the rate fell often enough."""
        return self._falls >= self.training.falls

    @property
    def over(self) -> bool:
        """Whether there is nothing more to do."""
        return self.converged or self.diverged or self.updates >= self.training.most

    def after_epoch(self, loss: float, batches: int) -> None:
        """Take the mean loss of an epoch of so many mini-batches into account."""
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
    """Endless epochs: all runs in random order, in mini-batches of equal size, each longest run first."""

    def __init__(self, lengths: Indices, batch: int, seed: int) -> None:
        self.edges = np.linspace(0, len(lengths), -(-len(lengths) // batch) + 1).astype(np.int64)
        self._which = np.repeat(np.arange(len(self.edges) - 1), np.diff(self.edges))
        self._lengths, self._generator = lengths, np.random.default_rng(seed)

    def epoch(self) -> Indices:
        """(runs,) the next order."""
        order = self._generator.permutation(len(self._lengths))
        return order[np.lexsort((-self._lengths[order], self._which))]


def standardised(sequences: Sequences, network: DetachmentNetwork) -> Runs:
    """`sequences` by the statistics that `network` holds."""
    scale = {name: b.detach().cpu().numpy().astype(np.float64) for name, b in network.named_buffers()}
    features = sequences.features.shape[2]
    tau = np.zeros((*sequences.target.shape, filled_up(features)), np.float32)
    tau[..., :features] = (sequences.features - scale["feature_mean"]) / scale["feature_scale"]
    q = (sequences.settings - scale["setting_mean"]) / scale["setting_scale"]
    target = sequences.target / scale["target_scale"]
    return Runs(tau, q.astype(np.float32), target.astype(np.float32), sequences.lengths)


class Start(NamedTuple):
    """A network before training, standardised by the runs that it learns from, and the seed of its draws."""

    network: DetachmentNetwork
    runs: Runs
    seed: int


def train(start: Start, training: Training, stopped: Callable[[], bool] = lambda: False) -> Course:
    """Train `start.network` in place, on one core; other threads run meanwhile.

    A loss that is no longer a number ends the training with the weights of the last check before.

    Args:
        stopped: says whether to give up.
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
