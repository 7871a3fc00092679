"""Simulate held-out experiments with stacks of models."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch

from pipeline.cam_follower.contact import minimal_force
from pipeline.cam_follower.dataset import Dataset
from pipeline.cam_follower.dynamics import Dynamics
from pipeline.cam_follower.metrics import angle_mse, time_mse
from unmodelled.base.arrays import Array, Indices
from unmodelled.base.progress import track
from unmodelled.learning.splits import Fold

#: A simulation may take this much longer than the measurement to travel the same angle.
STRETCH = 1.6
#: A design point is simulated from standstill for four turns, or this long, s.
LONGEST = 5.0
#: Experiments of each fold that are simulated side by side.
PART = 38
#: Experiments per fold whose simulated trajectories are kept for figures.
EXAMPLES = 6


@dataclass(frozen=True)
class Simulations:
    """Results of free runs over held-out experiments."""

    #: Columns fold, repeat, exp, omega_mse (over the angle) and omega_mse_time, both (rad/s)^2
    errors: pd.DataFrame
    examples: pd.DataFrame  # columns fold, exp, t (s), theta (rad) and omega (rad/s), of the first repeat


def simulate_tests(
    model: Dynamics, dataset: Dataset, folds: list[Fold], repeats: int, exp: Indices
) -> Simulations:
    """Simulate the test experiments (runs,) of every fold from their first measured state."""
    errors, examples = [], []
    longest = max(len(fold.test) for fold in folds)
    ordered = [fold.test[np.argsort(dataset.lengths.numpy()[fold.test], kind="stable")] for fold in folds]
    # every model runs its own fold's tests, short ones together; a fold with fewer repeats its last one
    runs = torch.tensor(np.stack([np.pad(o, (longest - len(o), 0), mode="edge") for o in ordered]))
    kept = [set(fold.test[:: max(1, len(fold.test) // EXAMPLES)].tolist()) for fold in folds]
    for part in track(torch.split(runs, PART, dim=1), -(-longest // PART), "simulating"):
        theta, omega = _simulate(model, dataset, part.repeat_interleave(repeats, 0))
        for f, fold in enumerate(folds):
            for j, run in enumerate(part[f].tolist()):
                steps = int(int(dataset.lengths[run]) * STRETCH)
                angle, speed = _measured(dataset, run)
                mine = slice(f * repeats, (f + 1) * repeats)
                for r, (a, w) in enumerate(zip(theta[mine, j, :steps], omega[mine, j, :steps], strict=True)):
                    mse = angle_mse(angle, speed, a, w)
                    errors.append((fold.name, r, int(exp[run]), mse, time_mse(speed, w)))
                if run in kept[f]:
                    t = np.arange(steps) * dataset.period
                    columns = {
                        "t": t,
                        "theta": theta[mine.start, j, :steps],
                        "omega": omega[mine.start, j, :steps],
                    }
                    examples.append(pd.DataFrame({"fold": fold.name, "exp": int(exp[run]), **columns}))
    names = ["fold", "repeat", "exp", "omega_mse", "omega_mse_time"]
    table = pd.DataFrame(errors, columns=names).drop_duplicates(["fold", "repeat", "exp"], ignore_index=True)
    return Simulations(table, pd.concat(examples, ignore_index=True).drop_duplicates(["fold", "exp", "t"]))


def _simulate(model: Dynamics, dataset: Dataset, runs: torch.Tensor) -> tuple[Array, Array]:
    """Angles and speeds of the experiments `runs` (batch, part), each (batch, part, steps)."""
    steps = int(int(dataset.lengths[runs].max()) * STRETCH)
    theta, omega, _ = model.simulate(
        *dataset.initial_state(runs), dataset.conditions[runs], steps, dataset.period
    )
    return theta.double().numpy(), omega.double().numpy()


def _measured(dataset: Dataset, run: int) -> tuple[Array, Array]:
    samples = slice(int(dataset.offsets[run]), int(dataset.offsets[run + 1]))
    return dataset.theta[samples].double().numpy(), dataset.omega[samples].double().numpy()


def explore(model: Dynamics, dataset: Dataset, folds: list[Fold], repeats: int, exp: Indices) -> pd.DataFrame:
    """Predict the minimal contact force at every setting (experiments,) of the campaign, from standstill."""
    points = torch.arange(len(exp))
    rest = torch.zeros(model.batch, len(points))
    lowest = minimal_force(
        model, dataset.bench, (rest, rest), dataset.conditions[points], torch.tensor(LONGEST), dataset.period
    )
    index = pd.MultiIndex.from_product(
        [[f.name for f in folds], range(repeats), exp], names=["fold", "repeat", "exp"]
    )
    return pd.DataFrame({"f_min": lowest.double().numpy().ravel()}, index).reset_index()
