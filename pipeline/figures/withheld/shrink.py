"""Draw how far the gap shrinks, beside the best possible refit and a network."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.figures.withheld.tables import MACHINES, table
from unmodelled.report.figures.style import GREY, absent, new_figure, styled

WITH_EFFECTS = ("single", "local", "pair")


@styled
def shrink_against_oracle(data: Path) -> Figure:
    """Shrink of the gap by the diagnosed effects, and by a network, against that by the planted effects.

    A marker is a case with detectable effects: one, two, or one in some of the runs. At 100 % the gap of the
    re-identified physics is closed down to the noise of the sensors, on held-out experiments. On the line the
    diagnosis equals a fit that is given family and channel. Filled: the answer is right; open: it is wrong.
    Right: a network in every port instead of laws, which gives no explanation.
    """
    rows = table(data, "cases")
    rows = rows[rows["kind"].isin(WITH_EFFECTS) & rows["seen"]]
    figure = new_figure(4.9)
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    if rows.empty:
        for axes in panels:
            absent(axes, "no planted effect can be seen")
        return figure
    for axes, column, title in zip(
        panels, ("shrink", "network_shrink"), ("diagnosis", "network in every port"), strict=True
    ):
        axes.axline((0.0, 0.0), slope=1.0, color=GREY, linewidth=1.4, zorder=1)
        _cases(axes, rows, column)
        mean = 100.0 * (rows[column] / rows["oracle_shrink"].where(rows["oracle_shrink"] > 0.0)).clip(
            upper=1.0
        )
        axes.set_title(f"{title}: {mean.mean():.0f} % of the oracle's, on average")
        axes.set(xlabel="shrink with the planted effects (%)", aspect="equal")
        axes.set(xlim=(-4.0, 104.0), ylim=(-4.0, 104.0))
        axes.set_axisbelow(True)
        axes.grid(linewidth=0.5)
    panels[0].set_ylabel("shrink (%)")
    handles, labels = panels[1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(MACHINES))
    return figure


def _cases(axes: Axes, rows: pd.DataFrame, column: str) -> None:
    for name, look in MACHINES.items():
        mine = rows[rows["system"] == name]
        # a network names nothing that could be right
        filled = mine["right"] | (column != "shrink")
        for shown, face in ((filled, look.colour), (~filled, "none")):
            some = mine[shown]
            x, y = 100.0 * some["oracle_shrink"], 100.0 * some[column]
            label = look.label if face != "none" else None
            axes.scatter(
                x, y, 30, marker=look.marker, facecolor=face, edgecolor=look.colour, label=label, alpha=0.8
            )
