"""Draw predicted and measured largest detachment, run by run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

from pipeline.figures.jumps.folds import FACTOR_NAMES
from pipeline.figures.jumps.tables import FACTORS, LOOKS, SHORT, models, nothing, of_fold, table
from unmodelled.report.figures.style import BLACK, GREY, LABELS, MM, Look, new_figure, styled

#: Lowest detachment shown, mm; smaller ones are drawn here, as a logarithmic axis has no zero.
LOWEST = 0.01
#: Runs whose label the prediction mistakes: measured label -> name and marker.
MISTAKEN = {"contact": ("false alarm", "^"), "jump": ("missed jump", "v")}


@styled
def mean_maxima(data: Path) -> Figure:
    """Predicted against measured mean largest detachment (mm) of runs with an unseen stroke H or rise β.

    Trained on every other level of the factor, tested on the other levels; median prediction of the repeats.
    Dots on the line are exact. Triangles mark runs with a wrong label: false alarms (contact runs) and missed
    jumps; their numbers stand above. A prediction is called a jump where it exceeds a share of the stroke
    that was chosen on the training runs. Values below 0.01 mm are drawn at 0.01 mm.
    """
    rows = table(data, "runs")
    folds = {name: of_fold(rows, FACTORS, name) for name in ("H", "beta")}
    folds = {name: own for name, own in folds.items() if len(own)}
    if not folds:
        return nothing("no model was tested on levels of H or β")
    names = models(pd.concat([*folds.values()]), LOOKS)
    largest = MM * max(float(own[["measured", "predicted"]].max().max()) for own in folds.values())
    limits = (0.7 * LOWEST, 1.5 * max(largest, LOWEST))
    figure = new_figure(1.1 + 1.75 * len(folds))
    grid = figure.subplots(len(folds), len(names), sharex=True, sharey=True, squeeze=False)
    for line, (fold, own) in zip(grid, folds.items(), strict=True):
        for axes, name in zip(line, names, strict=True):
            mine = own[own["model"] == name]
            axes.axline((LOWEST, LOWEST), (1.0, 1.0), color=GREY, linewidth=1.2, zorder=1)
            counts = _compare(axes, mine, LOOKS[name])
            axes.set_title(f"{SHORT[name]}\n{counts[0]} false, {counts[1]} missed", fontsize=9)
            _equal_log(axes, limits)
        line[0].annotate(
            f"{FACTOR_NAMES[fold]} unseen,\n{own['exp'].nunique()} runs",
            (-0.44, 0.5),
            xycoords="axes fraction",
            rotation=90,
            ha="right",
            va="center",
            multialignment="center",
        )
    figure.supxlabel("measured mean largest ε (mm)", fontsize=10)
    figure.supylabel("predicted mean largest ε (mm)", fontsize=10)
    marks = [
        Line2D([], [], color=LABELS[label], marker=marker, mec=BLACK, markersize=7, linestyle="", label=name)
        for label, (name, marker) in MISTAKEN.items()
    ]
    figure.legend(handles=marks, loc="outside upper center", ncols=2)
    return figure


def _equal_log(axes: Axes, limits: tuple[float, float]) -> None:
    """The same logarithmic scale on both axes, with plain numbers."""
    axes.set(xscale="log", yscale="log", xlim=limits, ylim=limits, aspect="equal")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(numticks=9))
        axis.set_major_formatter(FormatStrFormatter("%g"))
        axis.set_minor_locator(NullLocator())


def _compare(axes: Axes, runs: pd.DataFrame, look: Look) -> list[int]:
    """Draw the runs of one model; how many contact and jump runs it mistakes."""
    x, y = (np.maximum(MM * runs[name].to_numpy(np.float64), LOWEST) for name in ("measured", "predicted"))
    wrong = ((runs["label"] == "jump") != runs["jumps"]).to_numpy()
    axes.scatter(x[~wrong], y[~wrong], s=12, color=look.colour, alpha=0.6, linewidth=0, rasterized=True)
    counts = []
    for label, (_, marker) in MISTAKEN.items():
        shown = wrong & (runs["label"] == label).to_numpy()
        axes.scatter(x[shown], y[shown], s=34, c=LABELS[label], marker=marker, ec=BLACK, lw=0.7, zorder=3)
        counts.append(int(shown.sum()))
    return counts
