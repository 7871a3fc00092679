"""Levels of factors: groups of experiments that share a value of a column of experiments.csv."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Indices

#: Fewest experiments of a level at which laws are tried.
FEWEST_PER_LEVEL = 2
#: Largest number of levels of a factor, each of which has candidates of its own (a budget).
MOST_LEVELS = 8


def levels(experiments: pd.DataFrame) -> Iterator[tuple[str, float | str, Indices]]:
    """Yield factor, level and rows (members,) of the levels that some, but not all, experiments have."""
    for factor in experiments.columns:
        values = experiments[factor]
        if factor in ("id", "file") or not 1 < values.nunique() <= MOST_LEVELS:
            continue
        for level in sorted(values.unique()):
            members = np.flatnonzero((values == level).to_numpy())
            if FEWEST_PER_LEVEL <= len(members) < len(experiments):
                yield str(factor), level if isinstance(level, str) else float(level), members
