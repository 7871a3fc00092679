"""A compiled epoch of training: kernel and optimiser for one mini-batch after the other."""

from typing import NamedTuple

import numpy as np

from pipeline.cam_follower.sequence.arrays import Batch, Sizes, Work
from pipeline.cam_follower.sequence.kernel import gradient
from pipeline.cam_follower.sequence.products import LEAST
from unmodelled.base.arrays import Indices, Single
from unmodelled.base.compiling import compiled

#: Of the Adam optimiser: how much of its moments stays, and what keeps it from dividing by zero.
FIRST, SECOND, EPSILON = 0.9, 0.999, np.float32(1e-8)
#: Apart enough for the random numbers of one mini-batch after the other.
STRIDE = 0x9E3779B1


class Runs(NamedTuple):
    """Standardised runs, padded to the longest."""

    tau: Single  # (runs, steps, features)
    q: Single  # (runs, settings)
    target: Single  # (runs, steps), scaled
    lengths: Indices  # (runs,), numbers of samples


class Adam(NamedTuple):
    """Weights and state of the optimiser Adam."""

    p: Single  # (weights,)
    m: Single  # (weights,), first moments
    v: Single  # (weights,), second moments
    slope: Single  # (weights,), last gradient


@compiled
def epoch(
    adam: Adam,
    runs: Runs,
    order: Indices,
    edges: Indices,
    s: Sizes,
    loaded: Batch,
    work: Work,
    rate: float,
    clip: float,
    dropout: float,
    done: int,
    seed: int,
) -> float:
    """Train on all mini-batches of one epoch, and return their mean loss.

    Mini-batch b contains the runs order[edges[b]:edges[b + 1]], the longest first.

    Takes order (runs,), edges (batches + 1,).
    """
    total = np.float64(0.0)
    for b in range(len(edges) - 1):
        batch = load(runs, order[edges[b] : edges[b + 1]], loaded)
        number = done + b + 1
        total += gradient(adam.p, batch, s, work, np.float32(dropout), seed + number * STRIDE, adam.slope)
        _step(adam, number, rate, clip)
    return total / (len(edges) - 1)


@compiled
def load(runs: Runs, rows: Indices, loaded: Batch) -> Batch:
    """Copy some runs into the arrays of a mini-batch. Takes rows (batch,)."""
    width, settings, steps = runs.tau.shape[2], runs.q.shape[1], runs.lengths[rows[0]]
    active, total, samples = len(rows), 0, 0
    for t in range(steps):
        while runs.lengths[rows[active - 1]] <= t:
            active -= 1
        loaded.first[t] = total
        total += (active + LEAST - 1) // LEAST * LEAST
        samples += active
    loaded.first[steps] = total
    loaded.tau[: total * width] = np.float32(0.0)
    loaded.share[:total] = np.float32(0.0)
    loaded.q[:] = np.float32(0.0)
    share = np.float32(1.0 / samples)
    for i in range(len(rows)):
        run = rows[i]
        for k in range(settings):
            loaded.q[i * settings + k] = runs.q[run, k]
        for t in range(runs.lengths[run]):
            row = loaded.first[t] + i
            loaded.target[row], loaded.share[row] = runs.target[run, t], share
            for j in range(width):
                loaded.tau[row * width + j] = runs.tau[run, t, j]
    return Batch(loaded.tau, loaded.q, loaded.target, loaded.share, loaded.first[: steps + 1])


@compiled
def _step(adam: Adam, number: int, rate: float, clip: float) -> None:
    """One step of Adam; a gradient longer than `clip` is shortened to it."""
    p, m, v, slope = adam
    norm = np.sqrt((slope * slope).sum())
    scale = np.float32(min(1.0, clip / norm) if norm > 0.0 else 1.0)
    pace = np.float32(rate / (1.0 - FIRST**number))
    correction = np.float32(1.0 / np.sqrt(1.0 - SECOND**number))
    a, b = np.float32(1.0 - FIRST), np.float32(1.0 - SECOND)
    for j in range(len(p)):
        g = scale * slope[j]
        m[j] += a * (g - m[j])
        v[j] += b * (g * g - v[j])
        p[j] -= pace * m[j] / (np.sqrt(v[j]) * correction + EPSILON)
