"""Determine the boundary Q between contact and jumps, as a voltage for every cam and mass (section 6.3)."""

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array

SETTING = ["H", "beta", "m"]


def first_crossing(V: Array, value: Array, level: float) -> float:
    """Return the first voltage V (n,) at which a curve rises through a level, interpolated linearly."""
    up = np.flatnonzero((value[:-1] <= level) & (value[1:] > level))
    if not len(up):
        return float("nan")
    k = up[0]
    return float(V[k] + (level - value[k]) / (value[k + 1] - value[k]) * (V[k + 1] - V[k]))


def measured(experiments: pd.DataFrame, jump_share: float) -> pd.DataFrame:
    """Return the measured boundary, where the mean detachment rises through a share of the stroke."""
    running = experiments[experiments["label"] != "stall"].sort_values("V")
    rows = [
        (*setting, first_crossing(group["V"].to_numpy(), group["eps_share"].to_numpy(), jump_share))
        for setting, group in running.groupby(SETTING)
    ]
    return pd.DataFrame(rows, columns=[*SETTING, "Q"]).dropna().reset_index(drop=True)


def predicted(grid: pd.DataFrame, f_min: Array) -> pd.DataFrame:
    """Return the predicted boundary, where the minimal contact force (points,), N, falls through zero."""
    table = grid[[*SETTING, "V"]].assign(f_min=f_min).sort_values("V")
    rows = []
    for setting, group in table.groupby(SETTING):
        V, force = group["V"].to_numpy(), group["f_min"].to_numpy()
        Q = first_crossing(V, -force, 0.0)
        if np.isnan(Q):
            Q = float(V[0] if force[0] < 0 else V[-1])
        rows.append((*setting, Q))
    return pd.DataFrame(rows, columns=[*SETTING, "Q"])


def extrapolate_force(train: pd.DataFrame, grid: pd.DataFrame) -> Array:
    """Extrapolate the minimal contact force (points,), N, over the settings (section 6.3.3): the baseline.

    The model is a ridge regression on polynomials of V, m, H and beta. Its degree (up to three) and its
    penalty are chosen by cross-validation within `train`.
    """
    from sklearn.linear_model import Ridge
    from sklearn.model_selection import GridSearchCV
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import PolynomialFeatures, StandardScaler

    columns = ["V", "m", "H", "beta"]
    regression = make_pipeline(StandardScaler(), PolynomialFeatures(), StandardScaler(), Ridge())
    choices = {"polynomialfeatures__degree": [1, 2, 3], "ridge__alpha": np.logspace(-6, 2, 9)}
    folds = min(5, len(train))
    model = GridSearchCV(regression, choices, scoring="neg_mean_absolute_error", cv=folds)
    model.fit(train[columns].to_numpy(), train["f_min"].to_numpy())
    return np.asarray(model.predict(grid[columns].to_numpy()), np.float64)
