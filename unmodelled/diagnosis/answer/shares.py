"""Shares of the squared gap that models one after the other explain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.result import Interval, JudgedModel

#: Draws of the bootstrap.
DRAWS = 2000


def shares(squares: Array, floor: float, before: int, after: int) -> Array:
    """Return the share of the squared gap above the floor that `after` removes; squares (steps, ...)."""
    whole = squares[0] - floor**2
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.where(whole > 0.0, (squares[before] - squares[after]) / whole, 0.0)
    return np.clip(found, 0.0, 1.0)


def share_interval(steps: Sequence[JudgedModel], before: int, after: int, seed: int) -> Interval:
    """Return the 95 % interval of the share that models from `before` to `after` explain.

    It is a bootstrap over experiments.
    """
    ids = list(steps[0].gap.per_experiment)
    squares = np.array([[step.gap.per_experiment[i] ** 2 for i in ids] for step in steps])
    drawn = np.random.default_rng([seed, 2]).integers(0, len(ids), (DRAWS, len(ids)))
    found = shares(squares[:, drawn].mean(2), steps[-1].gap.floor, before, after)
    low, high = np.quantile(found, [0.025, 0.975]).tolist()
    return low, high
