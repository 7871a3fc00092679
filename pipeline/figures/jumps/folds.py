"""Arrange panels by training data: random shares of the runs, and omitted levels of a factor."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from pipeline.figures.jumps.tables import FACTORS, UNIFORM
from unmodelled.report.figures.style import Look

FACTOR_NAMES = {"H": "stroke H", "beta": "rise β", "m": "mass m"}
#: Of markers that look small, pt.
MARKER_SIZES = {"X": 8.5, "P": 8.5, "*": 12.0}
#: From the rows of one model on one fold to a value and its interval; nothing where there is none.
Score = Callable[[pd.DataFrame], Mapping[str, Any]]


@dataclass(frozen=True)
class Side:
    """A panel with the folds of one split.

    Attributes:
        split: name of the split.
        folds: names of the folds from left to right.
        xlabel: label below the panel.
        title: title above the panel.
    """

    split: str
    folds: list[str]
    xlabel: str
    title: str

    def name(self, axes: Axes) -> None:
        """Label the folds with ticks, and separate them by bands."""
        for k in range(1, len(self.folds), 2):
            axes.axvspan(k - 0.5, k + 0.5, color="0.95", linewidth=0, zorder=-2)
        names = [FACTOR_NAMES.get(fold, fold.removesuffix("%")) for fold in self.folds]
        axes.set_xticks(range(len(names)), names)
        axes.tick_params(axis="x", length=0)
        axes.set(xlim=(-0.5, len(names) - 0.5))


def sides(rows: pd.DataFrame) -> list[Side]:
    """Return the panels that a table has folds for: uniform shares in increasing order, and factors."""
    folds = {split: set(group["fold"]) for split, group in rows.groupby("split")}
    shares = sorted(folds.get(UNIFORM, ()), key=lambda fold: float(fold.removesuffix("%")))
    factors = [name for name in FACTOR_NAMES if name in folds.get(FACTORS, ())]
    both = [
        Side(UNIFORM, shares, "runs trained on (%)", "trained on random runs"),
        Side(FACTORS, factors, "factor (-)", "trained on every other level of a factor"),
    ]
    return [side for side in both if side.folds]


def draw_scores(axes: Axes, rows: pd.DataFrame, side: Side, looks: Mapping[str, Look], score: Score) -> None:
    """Draw the scores of models on every fold of a panel: a marker for the value, a bar for the interval."""
    offsets = (np.arange(len(looks)) - (len(looks) - 1) / 2.0) * 0.8 / len(looks)
    own = rows[rows["split"] == side.split]
    for (model, look), offset in zip(looks.items(), offsets, strict=True):
        for k, fold in enumerate(side.folds):
            found = score(own[(own["model"] == model) & (own["fold"] == fold)])
            if found:
                draw_score(axes, k + float(offset), found, look)
    side.name(axes)


def draw_score(axes: Axes, x: float, found: Mapping[str, Any], look: Look) -> None:
    """Draw one value with its interval."""
    value = found["value"]
    ends = found.get("interval", (value, value))
    axes.plot([x, x], ends, color=look.colour, linewidth=3.4, alpha=0.55, solid_capstyle="butt")
    size = MARKER_SIZES.get(look.marker, 7.0)
    axes.plot(x, value, look.marker, color=look.colour, markersize=size, mec="white", mew=0.7, zorder=3)
