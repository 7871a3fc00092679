"""Confidence intervals of the numbers of an answer, at any level."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, nan
from typing import Any

import numpy as np
import pandas as pd

from unmodelled.diagnosis.data.spread import Spread

Entry = Mapping[str, Any]


def interval_table(content: Entry, level: float) -> pd.DataFrame:
    """Return low, high and unit of every fitted number by name, see `Answer.conf_int`.

    Args:
        content: content of diagnosis.json.
        level: level of the intervals, 0 to 1.
    """
    numbers = {name: {**entry, "value": entry["identified"]} for name, entry in content["parameters"].items()}
    for effect in content["effects"]:
        numbers |= effect["parameters"]
    rows = {name: (*_interval(entry, level), entry["unit"]) for name, entry in numbers.items()}
    return pd.DataFrame.from_dict(rows, orient="index", columns=["low", "high", "unit"])


def _interval(entry: Entry, level: float) -> tuple[float, float]:
    """The interval of a number; nan where the answer does not say how sure it is."""
    if "values" in entry:
        ends = np.quantile([*entry["values"].values()], [0.5 - 0.5 * level, 0.5 + 0.5 * level])
        return float(ends[0]), float(ends[1])
    if entry["value"] is None:
        return nan, nan
    if "spread" in entry:
        told = entry["spread"]
        curvature, experiments = (_or(told[name], inf) for name in ("curvature", "experiments"))
        bounds = _or(told["bounds"][0], -inf), _or(told["bounds"][1], inf)
        return Spread(curvature, experiments, told["count"], bounds).interval(entry["value"], level)
    low, high = entry["interval"]
    return (low, high) if low == high and low is not None else (nan, nan)


def _or(value: float | None, undefined: float) -> float:
    return undefined if value is None else value
