"""Determine the boundary Q between contact and jumps, as a voltage for every cam and mass (section 6.3)."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Array = NDArray[np.float64]
SETTING = ["H", "beta", "m"]


def first_crossing(V: Array, value: Array, level: float) -> float:
    """Return the first voltage at which a curve rises through a level, interpolated linearly.

    Args:
        V: increasing voltages, V, shape (n,).
        value: values of the curve at these voltages, shape (n,).
        level: level to cross, in the unit of `value`.

    Returns:
        Voltage, V; nan if the curve never rises through the level.
    """
    up = np.flatnonzero((value[:-1] <= level) & (value[1:] > level))
    if not len(up):
        return float("nan")
    k = up[0]
    return float(V[k] + (level - value[k]) / (value[k + 1] - value[k]) * (V[k + 1] - V[k]))


def measured(experiments: pd.DataFrame, jump_share: float) -> pd.DataFrame:
    """Return the measured boundary, where the mean detachment rises through a share of the stroke.

    Args:
        experiments: table with the columns H, beta, m, V, label and eps_share.
        jump_share: share of the stroke above which a run is a jump.

    Returns:
        Columns H, beta, m and Q (V), without settings that do not change from contact to jump within the
        grid.
    """
    running = experiments[experiments["label"] != "stall"].sort_values("V")
    rows = [
        (*setting, first_crossing(group["V"].to_numpy(), group["eps_share"].to_numpy(), jump_share))
        for setting, group in running.groupby(SETTING)
    ]
    return pd.DataFrame(rows, columns=[*SETTING, "Q"]).dropna().reset_index(drop=True)


def predicted(grid: pd.DataFrame, f_min: Array) -> pd.DataFrame:
    """Return the predicted boundary, where the minimal contact force falls through zero.

    Args:
        grid: design points, with the columns H, beta, m and V.
        f_min: predicted minimal contact force, N, shape (points,).

    Returns:
        Columns H, beta, m and Q (V). The lowest voltage of the grid stands for settings with jumps
        everywhere, and the highest voltage for settings without jumps, because predictions must lie within
        the grid.
    """
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
    """Extrapolate the minimal contact force directly over the settings (section 6.3.3): the baseline.

    The model is a ridge regression on polynomials of V, m, H and beta. Its degree (up to three) and its
    penalty are chosen by cross-validation within `train`.

    Args:
        train: training runs, with the columns V, m, H, beta and f_min (N).
        grid: design points, with the columns V, m, H and beta.

    Returns:
        Minimal contact force, N, shape (points,); negative beyond the boundary.
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
