"""Choose the experiments that a figure shows, by rules on the table of experiments.

An experiment is identified by its row in the table.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.cam_follower.cam import TURN
from unmodelled.base.arrays import Array
from unmodelled.base.campaign import Campaign

FACTORS = ("V", "m", "H", "beta")


def read(data: Path, store: str, *columns: str) -> Campaign:
    """Read signals of the cam-follower, all by default, from a store: trajectories or features."""
    return Campaign.read(data / store / "cam_follower", list(columns) or None)


def experiments_of(data: Path, store: str) -> pd.DataFrame:
    """Read the table of experiments of a store."""
    return read(data, store, "exp").experiments


def levels(experiments: pd.DataFrame, factor: str) -> Array:
    """Return the levels of a factor in increasing order; gives (levels,)."""
    return np.unique(experiments[factor].to_numpy(np.float64))


def centre(experiments: pd.DataFrame) -> dict[str, float]:
    """Return a setting just above the middle of every range, with the lightest follower.

    At this setting a light follower already jumps, and a change of any factor starts or ends the jumps.
    """
    middle = {}
    for factor in FACTORS:
        values = levels(experiments, factor)
        middle[factor] = float(values[0] if factor == "m" else values[int(0.55 * len(values))])
    return middle


def varied(experiments: pd.DataFrame, factor: str, count: int = 3) -> list[int]:
    """Return rows without stall in which only one factor differs from the `centre`."""
    chosen = experiments["label"] != "stall"
    for other, value in centre(experiments).items():
        if other != factor:
            chosen &= experiments[other] == value
    rows = experiments[chosen].sort_values(factor).index.to_numpy()
    if not len(rows):
        return []
    return [int(rows[k]) for k in np.unique(np.linspace(0, len(rows) - 1, count).round().astype(int))]


def median_row(experiments: pd.DataFrame, column: str) -> int | None:
    """Return the row with the median of a column."""
    ordered = experiments.sort_values([column, "exp"]).index
    return int(ordered[len(ordered) // 2]) if len(ordered) else None


def nominal_and_bouncing(experiments: pd.DataFrame) -> tuple[int | None, int | None]:
    """Return a contact run and a jump run that differ only in the voltage, if the campaign has such a pair.

    The jump run has the median detachment; the contact run has the median voltage for the same cam and mass.
    """
    contacts = experiments[experiments["label"] == "contact"]
    jumps = experiments[experiments["label"] == "jump"]
    keys = ["H", "beta", "m"]
    both = jumps.set_index(keys).index.isin(contacts.set_index(keys).index)
    jump = median_row(jumps[both] if both.any() else jumps, "eps_share")
    if jump is not None and both.any():
        contacts = contacts[(contacts[keys] == experiments.loc[jump, keys]).all(axis=1)]
    return median_row(contacts, "V"), jump


def folded(theta: Array) -> Array:
    """Return the angle within one revolution.

    Unlike a remainder, the angle does not wrap where the shaft swings back over the end of the revolution.

    Takes theta (n,) in rad; gives (n,) in rad.
    """
    return theta - TURN * float(np.floor(np.median(theta) / TURN))
