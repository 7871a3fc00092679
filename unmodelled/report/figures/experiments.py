"""Draw the gap of every experiment."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from unmodelled.report.figures.style import GREY, new_figure, styled
from unmodelled.report.figures.tables import GAP, LOOKS, about, handle, log_gaps, table

#: Experiments that are shown, those with the largest gaps.
MOST = 40


@styled
def gaps_of_experiments(data: Path) -> Figure:
    """Gap of every experiment: system file as given, refitted parameters, and diagnosed effects.

    Experiments are sorted by their gap, the largest first. A last model of the
    legend at the noise of the sensors leaves nothing else. If that model stays far above it in one experiment
    alone, look for an effect or a fault that only this experiment has.
    """
    return _drawn(data, ["known", "reidentified", *(["augmented"] if about(data)["effects"] else [])])


@styled
def gaps_as_given(data: Path) -> Figure:
    """Gap of every experiment, with the system file as given.

    Experiments are sorted by their gap, the largest first. The upright mark is the noise floor, the gap
    that sensor noise alone causes.
    """
    return _drawn(data, ["known"])


def _drawn(data: Path, names: list[str]) -> Figure:
    every = table(data, "experiments").sort_values("reidentified", ascending=False, kind="stable")
    rows = every.head(MOST)
    figure = new_figure(1.5 + 0.24 * len(rows), 8.5)
    axes = figure.subplots()
    place = np.arange(len(rows))
    ends = rows[[*names, "floor"]]
    axes.hlines(place, ends.min(axis=1), ends.max(axis=1), color="0.85", linewidth=2.5, zorder=1)
    axes.plot(rows["floor"], place, "|", color=GREY, markersize=11, markeredgewidth=2.2)
    for name in names:
        look = LOOKS[name]
        axes.plot(rows[name], place, look.marker, color=look.colour, markersize=6.5, markeredgecolor="white")
    log_gaps(axes, 0.7 * float(ends.min(axis=None)), 1.4 * float(ends.max(axis=None)))
    axes.set_yticks(place, rows["id"])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_xlabel(GAP)
    if len(every) > len(rows):
        axes.set_title(f"{len(rows)} of {len(every)} experiments")
    noise = Line2D([], [], color=GREY, marker="|", markersize=11, mew=2.2, ls="", label=LOOKS["floor"].label)
    handles = [*(handle(name) for name in names), noise]
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles))
    return figure
