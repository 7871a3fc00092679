"""Divide experiments into training and test experiments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Indices
from unmodelled.base.errors import BadInput


@dataclass(frozen=True)
class Fold:
    """One division of the experiments; no experiment is in both parts, and none of the parts is empty."""

    name: str
    train: Indices  # (k,), rows of the experiments that a model may see
    test: Indices  # (k,), rows that the model is judged on

    def __post_init__(self) -> None:
        if np.intersect1d(self.train, self.test).size:
            raise ValueError(f"fold {self.name}: training and test experiments must be disjoint")
        if not len(self.train) or not len(self.test):
            raise BadInput(f"fold {self.name}: no experiments to train or test on")


@dataclass(frozen=True)
class Split:
    """Way of dividing the experiments: the content of a file of conf/split/.

    Attributes:
        folds: function that divides the experiments table.
        explore: True to run the models also on the whole grid of settings, to find the boundary Q.
    """

    folds: Callable[[pd.DataFrame], list[Fold]]
    explore: bool = False


def leave_one_out(experiments: pd.DataFrame) -> list[Fold]:
    """Leave one experiment out in each fold, or one group where the log folder names groups (4.4).

    Args:
        experiments: table with a column `id` or `group`, a row per experiment.

    Examples:
        >>> import pandas as pd
        >>> [fold.test.tolist() for fold in leave_one_out(pd.DataFrame({"id": ["a", "b", "c"]}))]
        [[0], [1], [2]]
    """
    members = (experiments["group"] if "group" in experiments else experiments["id"]).astype(str).to_numpy()
    rows = np.arange(len(members))
    return [Fold(name, rows[members != name], rows[members == name]) for name in dict.fromkeys(members)]
