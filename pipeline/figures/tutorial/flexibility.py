"""Draw the effect of the number of neurons, and of a penalty on the weights."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FormatStrFormatter, NullFormatter, NullLocator

from pipeline.figures.palette import plain_log
from pipeline.figures.tutorial.tables import EFFICIENCY, INDIGO, SAMPLES, about, efficiencies, table
from unmodelled.report.figures.style import BLACK, ORANGE, PURPLE, new_figure, styled


@styled
def flexibility(data: Path) -> Figure:
    """Efficiency by networks with too few, too many and a suitable number of neurons, and their errors.

    Top left: one neuron underfits. Top right: the largest number of neurons fits the noise of every training
    sample and misses new samples (a part of them is drawn). Bottom left: the number of neurons with the
    smallest error on new samples. These networks have no penalty on their weights; of the trainings from
    different initial weights, the one with the median error is shown. Bottom right: RMSE over the number of
    neurons, median of the trainings. With the penalty of eq. 2.6 a large number of neurons does no harm, and
    a small one is too stiff, as few weights share the penalty.
    """
    curves, errors, facts = table(data, "networks"), table(data, "network_errors"), about(data)
    free = errors[errors["penalty"] == 0.0]
    medians = free.groupby("hidden")["new"].median()
    sizes = {"a: underfit": medians.index[0], "b: overfit": medians.index[-1]}
    sizes["c: balance"] = medians.idxmin()
    figure = new_figure(7.0)
    grid = figure.subplots(2, 2)
    for axes, (name, hidden) in zip(grid.ravel(), sizes.items(), strict=False):
        runs = free[free["hidden"] == hidden].sort_values("new")
        middle = runs.iloc[(len(runs) - 1) // 2]
        chosen = (
            (curves["penalty"] == 0.0) & (curves["hidden"] == hidden) & (curves["seed"] == middle["seed"])
        )
        _fit(axes, data, curves[chosen], facts)
        training, new = (f"{1e3 * middle[column]:.3g}" for column in ("training", "new"))
        count = f"{hidden} neuron{'s' if hidden > 1 else ''}"
        axes.set_title(f"{name}, {count}\nRMSE {training} ‰ in training, {new} ‰ on new samples")
    _sizes(grid[1, 1], errors, facts)
    return figure


def _fit(axes: Axes, data: Path, curve: pd.DataFrame, facts: dict[str, float]) -> None:
    new = table(data, "new")
    part = new.iloc[::4]
    axes.plot(part["current"], part["efficiency"], "+", color=PURPLE, markersize=4.5, label="new samples")
    efficiencies(axes, data, whole=False)
    axes.plot(curve["current"], curve["efficiency"], color=ORANGE, linewidth=2.0, label="network")
    axes.set_xlim(facts["lowest"] - 0.3, facts["highest"] + 0.3)
    low, high = new["efficiency"].min(), new["efficiency"].max()
    axes.set(ylim=(low - 0.02, high + 0.02), ylabel=EFFICIENCY)
    handles = [SAMPLES, *axes.get_legend_handles_labels()[0]]
    axes.legend(handles=handles, loc="lower left")


def _sizes(axes: Axes, errors: pd.DataFrame, facts: dict[str, float]) -> None:
    penalties = {0.0: ("no penalty", ORANGE, "s"), facts["penalty"]: ("penalty", INDIGO, "^")}
    for penalty, (label, colour, marker) in penalties.items():
        medians = errors[errors["penalty"] == penalty].groupby("hidden")[["training", "new"]].median()
        # a network that visits every sample has an error of about nothing, far below the axis
        for column, line in (("new", "-"), ("training", ":")):
            what = "new samples" if column == "new" else "training samples"
            look: dict[str, Any] = {"marker": marker, "color": colour, "linestyle": line}
            axes.plot(medians.index, medians[column], **look, label=f"{label}, {what}")
    axes.axhline(facts["noise"], color=BLACK, linewidth=0.9, linestyle="--", label="noise of a sample")
    axes.set_xscale("log")
    axes.set_yscale("log")
    largest = float(errors.groupby(["penalty", "hidden"])["new"].median().max())
    axes.set_ylim(0.2 * facts["noise"], 1.3 * largest)
    plain_log(axes)
    axes.xaxis.set_major_locator(FixedLocator(sorted(errors["hidden"].unique())))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set(xlabel="hidden neurons $n_h$ (-)", ylabel="RMSE of the efficiency (-)")
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.18), ncols=2)
