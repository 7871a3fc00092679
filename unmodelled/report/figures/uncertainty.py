"""Identified distribution: profile likelihoods of its parameters, and the observations that it explains."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from unmodelled.report.figures.style import BLUE, GREY, ORANGE, VERMILION, new_figure, styled
from unmodelled.report.figures.tables import printed

#: Deviance at the 95 % limits of one parameter (chi-squared, one degree of freedom), and panels of a row.
LIMIT, ROW = 3.841, 4
#: Largest deviance that is drawn, in limits.
HIGHEST = 3.0


@styled
def profile_likelihoods(profiles: pd.DataFrame, best: dict[str, float]) -> Figure:
    """Deviance of every distribution parameter, with all others at their best, and its 95 % limit."""
    names = list(dict.fromkeys(profiles["name"]))
    rows = -(-len(names) // ROW)
    figure = new_figure(0.5 + 2.6 * rows)
    grid = figure.subplots(rows, min(ROW, len(names)), squeeze=False, sharey=True).ravel()
    for axes, name in zip(grid, names, strict=False):
        own = profiles[profiles["name"] == name].sort_values("value")
        axes.plot(own["value"], own["deviance"], color=BLUE, marker=".", markersize=4)
        axes.axhline(LIMIT, color=VERMILION, linewidth=1.0, linestyle="--")
        axes.axvline(best[name], color=ORANGE, linewidth=1.2)
        axes.set(xlabel=name, ylim=(0.0, HIGHEST * LIMIT))
        axes.grid(linewidth=0.5)
    for axes in grid[len(names) :]:
        axes.set_visible(False)
    grid[0].set_ylabel("deviance")
    return figure


@styled
def observations(points: pd.DataFrame, unit: str) -> Figure:
    """Observed outputs beside the prediction of least squares, and how likely the distribution makes them."""
    figure = new_figure(3.2)
    left, right = figure.subplots(1, 2)
    order = np.argsort(points["deterministic"].to_numpy(np.float64), kind="stable")
    own = points.iloc[order]
    ends = [own["deterministic"].min(), own["deterministic"].max()]
    left.plot(ends, ends, color=GREY, linewidth=1.0)
    left.plot(own["deterministic"], own["y"], ".", color=BLUE, markersize=6)
    unit = f" ({printed(unit)})" if unit else ""
    left.set(xlabel=f"one value for all{unit}", ylabel=f"observed{unit}")
    right.plot(np.arange(1, len(own) + 1), own["log_likelihood_push_forward"], ".", color=BLUE, markersize=6)
    right.set(xlabel="observation", ylabel="log-likelihood")
    for axes in (left, right):
        axes.grid(linewidth=0.5)
    return figure
