"""Train a hybrid model of a system from Python."""

from __future__ import annotations

from collections.abc import Callable

import pandas as pd

from unmodelled.learning.augmented import AugmentedRecipe
from unmodelled.learning.fit import Fit
from unmodelled.learning.splits import Fold, leave_one_out
from unmodelled.learning.structures import Structure
from unmodelled.learning.windows import Windows
from unmodelled.logs.inputs import LogsGiven, read_inputs
from unmodelled.systems.given import SystemGiven

#: Training of a structure that is given without one: short windows of free run, as in `model=hybrid`.
WINDOWS = Windows(horizon=20, epochs=100, rate=0.01, physics_rate=0.01)


def train(
    system: SystemGiven,
    logs: LogsGiven,
    model: Structure | AugmentedRecipe,
    split: Callable[[pd.DataFrame], list[Fold]] = leave_one_out,
    repeats: int = 1,
    seed: int = 0,
    start: Fit | None = None,
    device: str = "cpu",
) -> Fit:
    """Train hybrid models of a system, one per fold and repeat of a split.

    Args:
        system: known physics, or the path of its file.
        logs: measured experiments of the system, the path of their folder, or data frames.
        model: structure of the model, such as `one_per_port(hidden=32)`, which is trained on free runs of 20
            samples for 100 epochs with RK4; or a recipe, which says how it is trained.
        split: function that divides the table of experiments into folds; default: every fold leaves one
            experiment (or one group of experiments) out.
        repeats: number of models per fold, which differ in their random start; default 1.
        seed: seed of the random generators; default 0.
        start: fit of the same structure and split to continue from; default: from scratch.
        device: `cpu` for the compiled kernels (default), or a device of torch such as `cuda`.

    Returns:
        The fitted models, and the course of their training.

    Raises:
        BadInput: when the model does not suit the system, the data are too few, or the fit to start from has
            another structure.

    Examples:
        Four experiments give four models, each without one of the experiments:

        >>> import unmodelled as um
        >>> system, logs = um.example("pendulum")
        >>> fit = um.train(system, logs, um.one_per_port(hidden=4))
        >>> fit.trained_on[fit.folds[0]]
        ('run2', 'run3', 'run4')
        >>> fit.table()[["parameter", "unit", "known"]]
          parameter       unit  known
        0         b  N m s/rad   0.01
    """
    if not isinstance(model, AugmentedRecipe):
        model = AugmentedRecipe(model, WINDOWS, method="rk4", hold=1.0)
    known, measured = read_inputs(system, logs)
    folds = split(measured.experiments_with_speed())
    return model.fit(known, measured, folds, repeats, seed, start.model if start else None, device)
