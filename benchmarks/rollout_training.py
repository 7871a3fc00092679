"""A training step through 300 integration steps: the compiled kernel against back-propagation in torch."""

from __future__ import annotations

import copy

import numpy as np
import torch

from benchmarks.slider_crank import BATCH, EPOCH, PERIOD, check_same_work, epoch, gradient, problem, settings
from benchmarks.timing import seconds, side_by_side
from unmodelled.base.threads import one_thread
from unmodelled.engine.free_run import Integration
from unmodelled.learning.windows import Problem, Progress, weighting

HORIZON = 300
PEER = f"torch {torch.__version__}, eager, the faster of float64 and float32"


class Eager:
    """The same step in torch: free run, loss of eq. 4.9, back-propagation, Adam."""

    def __init__(self, task: Problem, dtype: torch.dtype) -> None:
        self.dtype = str(dtype).removeprefix("torch.")
        data, window = task.data, np.arange(BATCH)[:, None] + np.arange(HORIZON + 1)
        self.model = copy.deepcopy(task.model).to(dtype)
        as_tensor = [torch.from_numpy(a).to(dtype) for a in (data.x[window], data.u[window], data.t[:BATCH])]
        self.x, self.u, self.t = as_tensor[0][None], as_tensor[1][None], as_tensor[2]
        self.c = self.x.new_zeros((1, BATCH, 0))
        self.C_x = torch.from_numpy(weighting(data, task.runs[0], HORIZON)).to(dtype)
        self.optimiser = torch.optim.Adam(self.model.parameters(), lr=settings(HORIZON).rate)

    def step(self) -> None:
        """One mini-batch."""
        self.optimiser.zero_grad()
        x, _ = self.model.simulate(self.x[:, :, 0], self.u, self.t, self.c, Integration(PERIOD))
        (self.C_x * (x - self.x)[:, :, 1:].square()).sum(-1).mean().backward()
        self.optimiser.step()

    def gradient(self) -> np.ndarray:
        """By weights and scaled parameters, of the step before."""
        parts = (self.model.weights.grad[0], self.model.xi.grad[0])
        return torch.cat(parts).double().numpy()


def run() -> dict[str, float]:
    """Slider-crank, F = eta(d, v) with 32 hidden units, N = 300, batch 200, Euler, one thread each."""
    single, windows = problem(HORIZON, batches=1), settings(HORIZON)
    long = problem(HORIZON, EPOCH)
    state = Progress.start(long.model, 0)
    with one_thread():
        expected, alone = gradient(single, windows), {}
        for dtype in (torch.float64, torch.float32):
            peer = Eager(single, dtype)
            peer.step()
            check_same_work(expected, peer.gradient())
            alone[peer] = min(seconds(peer.step) for _ in range(3))
        faster = min(alone, key=alone.__getitem__)
        result = side_by_side(lambda: epoch(long, windows, state), faster.step, steps=EPOCH)
    return {**result, "threads": 1, **{f"peer_{peer.dtype}": time for peer, time in alone.items()}}
