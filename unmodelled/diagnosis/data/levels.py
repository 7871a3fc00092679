"""Levels of factors: experiments that have a setting, or a group, in common."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Indices = NDArray[np.int64]

#: A column with more levels than this is no factor; a level needs so many experiments to be told from chance.
MOST, LEAST = 8, 2


def levels(experiments: pd.DataFrame) -> Iterator[tuple[str, float | str, Indices]]:
    """Factor, level and rows (those of the table) of what some, but not all, experiments have in common."""
    for factor in experiments.columns:
        values = experiments[factor]
        if factor in ("id", "file") or not 1 < values.nunique() <= MOST:
            continue
        for level in sorted(values.unique()):
            members = np.flatnonzero((values == level).to_numpy())
            if LEAST <= len(members) < len(experiments):
                yield str(factor), level if isinstance(level, str) else float(level), members
