"""What a network has learned beside its formula, and the course of a training."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from unmodelled.report.figures.style import BLUE, GREY, ORANGE, new_figure, styled, thin
from unmodelled.report.figures.tables import printed

#: Curves of single models that are drawn, at most.
CURVES = 30


@styled
def learned_law(samples: pd.DataFrame, axes: Mapping[str, str], unit: str) -> Figure:
    """Effort of a network and its formula over each coordinate of the port, and the difference of the two.

    Points are measured states of the training experiments.
    """
    figure = new_figure(3.6)
    panels = figure.subplots(1, len(axes) + 1, squeeze=False)[0]
    columns = [samples[c].to_numpy(np.float64) for c in (*axes, "effort", "formula")]
    *coordinates, effort, formula = thin(*columns)
    for panel, x, label in zip(panels, coordinates, axes.values(), strict=False):
        panel.plot(x, effort, ".", color=BLUE, markersize=3.5, markeredgewidth=0, label="network")
        panel.plot(x, formula, ".", color=ORANGE, markersize=2.0, markeredgewidth=0, label="formula")
        panel.set(xlabel=label, ylabel=f"effort ({printed(unit)})")
    panels[-1].plot(coordinates[0], effort - formula, ".", color=GREY, markersize=2.5, markeredgewidth=0)
    panels[-1].set(xlabel=next(iter(axes.values())), ylabel=f"network − formula ({printed(unit)})")
    for panel in panels:
        panel.grid(linewidth=0.5)
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2, markerscale=2.5
    )
    return figure


@styled
def losses(history: pd.DataFrame) -> Figure:
    """Loss of every model after each epoch, and their median."""
    figure = new_figure(2.8)
    axes = figure.subplots()
    groups = [part for _, part in history.groupby(["fold", "repeat"], sort=False)]
    for part in groups[:CURVES]:
        axes.plot(part["epoch"], part["loss"], color=GREY, linewidth=0.7)
    median = history.groupby("epoch")["loss"].median()
    axes.plot(median.index, median, color=BLUE, linewidth=1.8, label="median")
    if (history["loss"] > 0.0).all():
        axes.set_yscale("log")
    axes.set(xlabel="epoch", ylabel="loss")
    axes.grid(linewidth=0.5)
    axes.legend()
    return figure
