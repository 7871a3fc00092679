"""The training that the benchmarks of the compiled rollout share: slider-crank, F = eta(d, v), one thread."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch

from unmodelled.base.arrays import Array
from unmodelled.engine.compiled.structure import Augmented
from unmodelled.engine.free_run import Integration
from unmodelled.learning.augmented import AugmentedRecipe
from unmodelled.learning.nnap import Nnap
from unmodelled.learning.rollout import Measured, simulate
from unmodelled.learning.structures import one_per_port
from unmodelled.learning.windows import Problem, Progress, Windows, train_epochs
from unmodelled.systems.reader import read_system

SYSTEM = Path(__file__).parent.parent / "systems" / "slider_crank.yaml"
PERIOD, HIDDEN, BATCH = 5e-4, 32, 200
#: Mini-batches of an epoch of the bench's campaign at N = 300: 16 runs of 800 samples are trained on.
EPOCH = 40


def settings(horizon: int) -> Windows:
    """Batches of 200; no clipping, and so many epochs that the rate does not fall."""
    return Windows(horizon, epochs=10**6, batch=BATCH, clip=np.inf, workers=1)


def problem(horizon: int, batches: int) -> Problem:
    """One model; data of the bare physics under sines, in which `batches` mini-batches of windows begin."""
    system = read_system(SYSTEM)
    samples = horizon + batches * BATCH
    t = np.arange(samples) * PERIOD
    u = (3.3 * np.sin(18.2 * t + 0.2) + 2.5 * np.sin(42.1 * t + 1.5))[:, None]
    one = np.zeros(samples, np.int64)
    data = Measured(np.zeros((samples, 2)), u, t, np.zeros((1, 0)), one, np.array([0, samples]))
    none = torch.empty((1, 0), dtype=torch.float64)
    bare = Nnap(Augmented(system), torch.tensor([system.values]), none[0], none, none, none)
    x, _ = simulate(bare, 0, data, np.array([[0.3, 0.0]]), one[:1], samples - 1, Integration(PERIOD))
    data.x[:] = x[0]
    recipe = AugmentedRecipe(one_per_port(hidden=HIDDEN), settings(horizon), spread=0.2)
    return recipe.problem(system, data, PERIOD, [np.array([0])], seed=0)


def epoch(task: Problem, windows: Windows, state: Progress) -> None:
    """Train by one epoch with the compiled kernel."""
    train_epochs(task, windows, [state], 1)


def gradient(task: Problem, windows: Windows) -> Array:
    """Of the first mini-batch's loss, by the weights and the scaled parameters."""
    state = Progress.start(task.model, 0)
    epoch(task, windows, state)
    # Adam's first moment is a tenth of the first gradient
    return 10.0 * np.concatenate([state.moments_W[0], state.moments_p[0]])


def check_same_work(ours: Array, peer: Array) -> None:
    """Raise ArithmeticError where the peer's gradient is another: the times could not be compared."""
    for part in (slice(None, -3), slice(-3, None)):  # weights and scaled parameters
        error = float(np.linalg.norm(peer[part] - ours[part]) / np.linalg.norm(ours[part]))
        if not error < 1e-3:
            raise ArithmeticError(f"the peer's gradient differs from ours by {error:.1e} of its norm")
