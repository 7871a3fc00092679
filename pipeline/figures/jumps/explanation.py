"""Convert attributions to `shap.Explanation`, for the plots of shap."""

from __future__ import annotations

import importlib
import warnings
from functools import cache
from types import ModuleType
from typing import TYPE_CHECKING

import pandas as pd

if TYPE_CHECKING:
    from shap import Explanation


@cache
def shap_library() -> ModuleType:
    """Return the package shap, which takes seconds to import and warns while it does."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return importlib.import_module("shap")


def explanation(points: pd.DataFrame, scale: float = 1.0) -> Explanation:
    """Return attributions of one network as a `shap.Explanation` with a row for every run and step.

    Args:
        points: table `points` of the verb `attribute` for one model, a row for every run, step and input:
            columns exp, step, feature, phi (m), value (value of the input, in SI units) and base (mean output
            over the background, m).
        scale: factor of contributions and base, 1000 for mm.

    Returns:
        Explanation with values and data (rows, inputs), base_values (rows,) and feature_names; rows are
        ordered by run and step, inputs as in `points`.

    Example:
        >>> columns = {"exp": 1, "step": [0, 0, 1, 1], "feature": ["omega", "m"] * 2}
        >>> numbers = {"phi": [0.5, 0.1, 0.7, 0.1], "value": [9.0, 2.0, 8.0, 2.0], "base": 0.25}
        >>> found = explanation(pd.DataFrame(columns | numbers))
        >>> found.values.sum(axis=1) + found.base_values  # the network's output, m
        array([0.85, 1.05])
    """
    names = list(dict.fromkeys(points["feature"]))
    wide = points.pivot(index=["exp", "step"], columns="feature", values=["phi", "value"])
    base = points.groupby(["exp", "step"])["base"].first()
    found: Explanation = shap_library().Explanation(
        scale * wide["phi"][names].to_numpy(),
        base_values=scale * base.to_numpy(),
        data=wide["value"][names].to_numpy(),
        feature_names=names,
    )
    return found
