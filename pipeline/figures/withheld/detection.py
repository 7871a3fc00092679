"""Draw how large an effect must be for its detection."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from pipeline.figures.withheld.tables import FINDERS, table
from unmodelled.report.figures.style import absent, new_figure, styled


@styled
def amplitude_detection(data: Path) -> Figure:
    """Share of single effects that are found, over their level.

    A level of one is an effect of typical size for its machine. Bars: 95 % intervals (Wilson). The oracle is
    given family and channel and only fits the parameters; an effect that it cannot detect on held-out
    experiments cannot be detected by any method. Sparse regression of accelerations is the baseline. All
    single cases count, detectable or not.
    """
    rows = table(data, "detection")
    figure = new_figure(4.4)
    axes = figure.subplots()
    if rows.empty:
        absent(axes, "there is no case with a single effect")
        return figure
    for k, (name, look) in enumerate(FINDERS.items()):
        mine = rows[rows["what"] == name]
        # side by side, so that no interval hides another one
        level = np.sqrt(mine["from"] * mine["to"]) * 1.02 ** (k - 1.5)
        share, ends = 100.0 * mine["share"], 100.0 * mine[["low", "high"]].to_numpy().T
        bars = np.abs(ends - share.to_numpy())
        axes.errorbar(level, share, yerr=bars, color=look.colour, linewidth=0.8, linestyle="none")
        axes.plot(level, share, look.marker, color=look.colour, linestyle=look.line, label=look.label)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes.set_xticks([0.3, 0.5, 1.0, 2.0, 3.0])
    axes.minorticks_off()
    axes.set(xlabel="level of the effect (typical sizes)", ylabel="found (% of cases)", ylim=(0.0, 103.0))
    axes.grid(linewidth=0.5)
    figure.legend(loc="outside lower center", ncols=len(FINDERS))
    return figure
