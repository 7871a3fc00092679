"""Free-run simulation of held-out experiments by stacks of models."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray

from pipeline.evaluation.metrics import angle_mse, time_mse
from pipeline.evaluation.splits import Fold
from pipeline.learning.dataset import Dataset
from pipeline.models.contact import minimal_force
from pipeline.models.dynamics import Dynamics
from pipeline.progress import track

Array = NDArray[np.float64]

#: A simulation may take this much longer than the measurement to travel the same angle.
STRETCH = 1.6
#: A design point is simulated from standstill for four turns, or this long, s.
LONGEST = 5.0
#: Experiments per fold whose simulated trajectories are kept for figures.
EXAMPLES = 6


@dataclass(frozen=True)
class Simulations:
    """Results of free runs.

    Attributes:
        errors: fold, repeat, exp, omega_mse (over the angle), omega_mse_time, both (rad/s)^2.
        examples: fold, exp, t (s), theta (rad), omega (rad/s), of the first repeat.
    """

    errors: pd.DataFrame
    examples: pd.DataFrame


def simulate_tests(
    model: Dynamics, dataset: Dataset, folds: list[Fold], repeats: int, exp: NDArray[np.int64]
) -> Simulations:
    """Simulate every fold's test experiments from their own measured initial state.

    Args:
        model: stack of len(folds) * repeats models, folds slowest.
        dataset: trajectories.
        folds: with their test experiments.
        repeats: models per fold.
        exp: (n,) ids of the experiments.
    """
    errors, examples = [], []
    for f, fold in enumerate(track(folds, len(folds), "simulating")):
        runs = torch.as_tensor(fold.test)
        # short runs are not simulated as long as the longest one
        for part in runs[torch.argsort(dataset.lengths[runs])].chunk(4):
            theta, omega = _simulate(model, dataset, part)
            mine = slice(f * repeats, (f + 1) * repeats)
            for j, run in enumerate(part.tolist()):
                steps = int(int(dataset.lengths[run]) * STRETCH)
                angle, speed = _measured(dataset, run)
                for r, (a, w) in enumerate(zip(theta[mine, j, :steps], omega[mine, j, :steps], strict=True)):
                    mse = angle_mse(angle, speed, a, w)
                    errors.append((fold.name, r, int(exp[run]), mse, time_mse(speed, w)))
                if run in fold.test[:: max(1, len(fold.test) // EXAMPLES)]:
                    t = np.arange(steps) * dataset.period
                    columns = {"t": t, "theta": theta[mine.start, j, :steps], "omega": omega[mine.start, j, :steps]}
                    examples.append(pd.DataFrame({"fold": fold.name, "exp": int(exp[run]), **columns}))
    names = ["fold", "repeat", "exp", "omega_mse", "omega_mse_time"]
    return Simulations(pd.DataFrame(errors, columns=names), pd.concat(examples, ignore_index=True))


def _simulate(model: Dynamics, dataset: Dataset, runs: torch.Tensor) -> tuple[Array, Array]:
    start = dataset.initial_state(runs.expand(model.batch, -1))
    steps = int(int(dataset.lengths[runs].max()) * STRETCH)
    theta, omega, _ = model.simulate(*start, dataset.conditions[runs], steps, dataset.period)
    return theta.double().numpy(), omega.double().numpy()


def _measured(dataset: Dataset, run: int) -> tuple[Array, Array]:
    samples = slice(int(dataset.offsets[run]), int(dataset.offsets[run + 1]))
    return dataset.theta[samples].double().numpy(), dataset.omega[samples].double().numpy()


def explore(
    model: Dynamics, dataset: Dataset, folds: list[Fold], repeats: int, exp: NDArray[np.int64]
) -> pd.DataFrame:
    """Predicted minimal contact force at every setting of the campaign, simulated from standstill.

    Returns:
        Columns fold, repeat, exp, f_min (N).
    """
    points = torch.arange(len(exp))
    rest = torch.zeros(model.batch, len(points))
    lowest = minimal_force(
        model, dataset.bench, (rest, rest), dataset.conditions[points], torch.tensor(LONGEST), dataset.period
    )
    index = pd.MultiIndex.from_product([[f.name for f in folds], range(repeats), exp], names=["fold", "repeat", "exp"])
    return pd.DataFrame({"f_min": lowest.double().numpy().ravel()}, index).reset_index()
