"""Levels of the operating point, and groups, in whose experiments the gap is larger than in others."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: A level has so many times the share that its samples have; by chance it would in so few cases.
MORE, CHANCE = 1.3, 0.02
DRAWS = 4000


def factors(
    experiments: pd.DataFrame, columns: tuple[str, ...], excess: Array, samples: Array, seed: int
) -> tuple[dict[str, Any], ...]:
    """Levels whose share of the squared gap is clearly larger than their share of the samples, largest first.

    How likely that is by chance is found by dealing the gaps to the experiments anew. A column is left out
    where all experiments have one level, or each its own.

    Args:
        experiments: their table, n rows. columns: that are looked at, where the table has them.
        excess: (n,) squared gap above the floor. samples: (n,) of each experiment. seed: of the deals.
    """
    amount = np.maximum(excess, 0.0) * samples
    whole = float(amount.sum())
    if whole <= 0.0:
        return ()
    dealt = np.random.default_rng([seed, 1]).permuted(np.tile(amount / samples, (DRAWS, 1)), axis=1) * samples
    found = []
    for name in columns:
        if name not in experiments or not 1 < experiments[name].nunique() < len(experiments):
            continue
        for level in experiments[name].drop_duplicates().tolist():
            member = (experiments[name] == level).to_numpy()
            share = float(amount[member].sum()) / whole
            by_chance = float(np.mean(dealt[:, member].sum(1) / dealt.sum(1) >= share - 1e-12))
            if share > MORE * float(samples[member].sum() / samples.sum()) and by_chance < CHANCE:
                found.append({"factor": name, "level": level, "share": share})
    return tuple(sorted(found, key=lambda row: -row["share"]))
