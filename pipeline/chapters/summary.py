"""Summarise errors of single simulations as numbers with value, interval, unit and count."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from pipeline.chapters import published
from pipeline.chapters.leaves import median_interval
from unmodelled.base.arrays import Array

Leaf = dict[str, Any]


def leaf(values: Array, unit: str) -> Leaf:
    """Return the median over the repeats with its 95 % interval. Takes values (repeats,)."""
    values = np.asarray(values, np.float64)
    content: Leaf = {"value": float(np.median(values)), "unit": unit, "n": len(values)}
    if len(values) > 1:
        content["interval"] = list(median_interval(values))
    return content


def share(hits: int, total: int) -> Leaf:
    """Return a share with its 95 % Wilson interval."""
    from scipy.stats import binomtest

    interval = binomtest(hits, total).proportion_ci(method="wilson")
    return {"value": hits / total, "unit": "-", "n": total, "interval": [interval.low, interval.high]}


def labels(experiments: pd.DataFrame) -> dict[str, Any]:
    """Count the labels, and assess F-dagger as a classifier; a negative minimum is called a jump.

    Neither the pitch curve nor the threshold, which is zero, was fitted to labels.
    """
    counts = {
        name: {"value": int((experiments["label"] == name).sum()), "unit": "runs", "n": len(experiments)}
        for name in ("stall", "jump", "contact")
    }
    running = experiments[experiments["label"] != "stall"]
    jump, says = (running["label"] == "jump").to_numpy(), (running["f_min"] < 0).to_numpy()
    return counts | {
        "f_dagger": {
            "accuracy": share(int((jump == says).sum()), len(running)),
            "false_positive": share(int((says & ~jump).sum()), int((~jump).sum())),
            "false_negative": share(int((~says & jump).sum()), int(jump.sum())),
            "protocol": "eq. 6.11 on the logged 2 kHz signals with the roller's pitch curve and the "
            "dissertation's guide friction; jump where the minimum is negative; nothing fitted to labels; "
            "stalls left out",
        }
    }


def table_5_1(extremes: Callable[[float, float], tuple[float, float]]) -> pd.DataFrame:
    """Compare table 5.1 by our geometry with the published one: 40 cells. Takes extremes in rad."""
    rows = []
    for i, H in enumerate(published.STROKES):
        for j, skew in enumerate(published.SKEWS):
            curvature, pressure = extremes(H, skew * np.pi)
            rows.append(("minimum |rho_c| / r_f", H, skew, round(curvature, 2), published.CURVATURE[i][j]))
            degrees = round(float(np.degrees(pressure)))
            rows.append(("maximum alpha [deg]", H, skew, degrees, published.PRESSURE[i][j]))
    return pd.DataFrame(rows, columns=["quantity", "H [m]", "beta / pi", "ours", "dissertation"])


def per_repeat(errors: pd.DataFrame, column: str = "omega_mse") -> Array:
    """Return the median over the test runs for every repeat; gives (repeats,)."""
    return np.asarray(errors.groupby("repeat")[column].median(), np.float64)


def simulation(errors: pd.DataFrame) -> dict[str, Any]:
    """Return free-run errors per model: interpolation over all folds together, extrapolation per level."""
    result: dict[str, Any] = {"interpolation": {}, "extrapolation": {}}
    for (split, model), group in errors.groupby(["split", "model"]):
        if split == "interpolation":
            result[split][model] = _errors(group)
            continue
        for fold, level in group.groupby("fold"):
            result[split].setdefault(str(int(fold.rstrip("%")) // 10), {})[model] = _errors(level)
    return result


def _errors(group: pd.DataFrame) -> dict[str, Leaf]:
    means = group.groupby("repeat")["omega_mse"].mean().to_numpy()
    unit = "(rad/s)^2"
    return {
        "omega_mse": leaf(per_repeat(group), unit),
        "omega_mse_mean": leaf(means, unit),
        "omega_mse_time": leaf(per_repeat(group, "omega_mse_time"), unit),
    }


def contact_force(force: pd.DataFrame, experiments: pd.DataFrame) -> dict[str, Any]:
    """Return the mean absolute error of F_min (eq. 6.12) on I_2 to I_10, for models trained on I_1 only."""
    first = force[force["fold"] == "10%"].merge(
        experiments.loc[experiments["subset"] >= 2, ["exp", "f_min"]], on="exp", suffixes=("", "_measured")
    )
    error = (first["f_min"].clip(lower=0) - first["f_min_measured"].clip(lower=0)).abs()
    mae = error.groupby([first["model"], first["repeat"]]).mean()
    return {str(model): {"mae": leaf(group.to_numpy(), "N")} for model, group in mae.groupby(level=0)}


def boundary_errors(boundary: pd.DataFrame) -> pd.DataFrame:
    """Return the mean absolute error of Q per model, fold and repeat, V."""
    setting = ["H", "beta", "m"]
    truth = boundary.loc[boundary["model"] == "measured", [*setting, "Q"]]
    joined = boundary[boundary["model"] != "measured"].merge(truth, on=setting, suffixes=("", "_measured"))
    joined["mae"] = (joined["Q"] - joined["Q_measured"]).abs()
    return joined.groupby(["model", "fold", "repeat"])["mae"].mean().reset_index()


def boundary_leaves(errors: pd.DataFrame) -> dict[str, Any]:
    """Return the numbers `boundary.<subset count>.<model>.mae`."""
    result: dict[str, Any] = {}
    for (fold, model), group in errors.groupby(["fold", "model"]):
        level = str(int(str(fold).rstrip("%")) // 10)
        result.setdefault(level, {})[str(model)] = {"mae": leaf(group["mae"].to_numpy(), "V")}
    return result
