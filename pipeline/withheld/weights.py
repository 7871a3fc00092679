"""Fit the weights of the confidence of a diagnosis to cases with known faults."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import minimize

Array = NDArray[np.float64]

#: Variance of the weights before any case was seen.
PRIOR = 0.1
#: Signs that can only speak for a verdict; all others can only speak against it. A few dozen cases of one
#: verdict would otherwise say the opposite by chance.
FOR = frozenset({"gain", "margin"})


def fitted_weights(table: pd.DataFrame, signs: Sequence[str]) -> dict[str, dict[str, float]]:
    """Fit a logistic regression per verdict, with a normal prior of mean zero on the weights.

    Args:
        table: table with one row per diagnosis: `verdict`, `right` (whether the diagnosis was right) and its
            signs.
        signs: names of the columns of the signs.

    Returns:
        Intercept and weights by verdict.
    """
    found = {}
    bounds = [(None, None), *((0.0, None) if name in FOR else (None, 0.0) for name in signs)]
    for verdict, mine in table.groupby("verdict"):
        right = mine["right"].to_numpy(bool)
        x = mine[list(signs)].to_numpy(np.float64)
        # one of either kind beside the others, so that nothing is ever certain
        x, right = np.vstack([x, x.mean(0), x.mean(0)]), np.append(right, [True, False])
        best = minimize(_loss, np.zeros(1 + len(signs)), (x, np.where(right, 1.0, -1.0)), bounds=bounds)
        found[str(verdict)] = dict(zip(["intercept", *signs], best.x.tolist(), strict=True))
    return found


def _loss(weights: Array, x: Array, side: Array) -> float:
    """Logistic loss and prior; `side` is 1 where a verdict is right, -1 where it is not, shape (cases,)."""
    score = weights[0] + x @ weights[1:]
    return float(np.sum(np.logaddexp(0.0, -side * score)) + weights[1:] @ weights[1:] / (2.0 * PRIOR))
