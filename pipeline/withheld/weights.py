"""Fit the weights of the confidence of a diagnosis to cases with known faults."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from sklearn.linear_model import LogisticRegression

#: Variance of the weights before any case was seen.
PRIOR = 0.1


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
    for verdict, mine in table.groupby("verdict"):
        right = mine["right"].to_numpy(bool)
        x = mine[list(signs)].to_numpy(np.float64)
        # one of either kind beside the others, so that nothing is ever certain
        x, right = np.vstack([x, x.mean(0), x.mean(0)]), np.append(right, [True, False])
        model = LogisticRegression(C=PRIOR).fit(x, right)
        weights = dict(zip(signs, model.coef_[0].tolist(), strict=True))
        found[str(verdict)] = {"intercept": float(model.intercept_[0]), **weights}
    return found
