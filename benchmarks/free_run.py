"""The compiled free-run residual of the motor against the batched torch reference."""

from __future__ import annotations

import numpy as np
import pandas as pd
import torch

from benchmarks.timing import side_by_side
from pipeline.cam_follower import free_run
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.dataset import Dataset
from pipeline.cam_follower.motor import Motor
from unmodelled.base.campaign import Campaign

PEER = f"torch {torch.__version__}, all runs in one batch"


def run() -> dict[str, float]:
    """Eighty runs of three seconds, two RK4 steps per sample, all threads."""
    n, samples = 80, 300
    generator = np.random.default_rng(0)
    table = pd.DataFrame(
        {"exp": range(n), "H": 0.03, "beta": np.pi, "m": 1.0, "V": generator.uniform(5, 9, n)}
    )
    t = np.arange(samples) * 0.01
    omega = np.concatenate([(3.5 * V - 9) * (1 - np.exp(-t / 0.1)) for V in table["V"]])
    theta = np.concatenate([np.cumsum(part) * 0.01 for part in omega.reshape(n, -1)])
    signals = {"t": np.tile(t, n), "theta": theta, "omega": omega}
    dataset = Dataset.of(Campaign(table, signals, np.arange(n + 1) * samples, {}), CamFollower())
    parameters = np.array([0.0045, 0.29, 0.075, 0.85, 0.2, 6.0])
    task = free_run.problem(dataset, np.arange(n), 3.0, 2, 0.15)
    motor = Motor(dataset.bench, 1)
    motor.parameters_.data[:] = torch.tensor(parameters)
    start = dataset.initial_state(torch.arange(n)[None])
    return side_by_side(
        lambda: task.residual(free_run.unit(parameters)),
        lambda: motor.simulate(*start, dataset.conditions, samples, 0.01),
    )
