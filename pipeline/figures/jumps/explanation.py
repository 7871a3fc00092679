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
    """Return attributions of one network as a `shap.Explanation` with a row for every run and step."""
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
