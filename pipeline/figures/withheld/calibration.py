"""Whether a confidence means what it says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from pipeline.figures.withheld.tables import INDIGO, table
from unmodelled.report.figures.style import GREY, absent, new_figure, styled


@styled
def calibration_curve(data: Path) -> Figure:
    """Share of right answers over the confidence that was stated.

    Cases of all kinds in bins of a tenth; the area of a marker tells how many, the bar is the 95 % interval
    (Wilson). On the line, answers that are given nine tenths are right nine times out of ten. Below it the
    diagnosis is too sure.
    """
    rows = table(data, "calibration")
    figure = new_figure(4.6, 5.6)
    axes = figure.subplots()
    if rows.empty:
        absent(axes, "there is no case")
        return figure
    axes.axline((0.0, 0.0), slope=1.0, color=GREY, linewidth=1.4, zorder=1)
    bars = np.abs(rows[["low", "high"]].to_numpy().T - rows["right"].to_numpy())
    axes.errorbar(rows["confidence"], rows["right"], yerr=bars, color=INDIGO, linewidth=1.0, linestyle="none")
    size = 20.0 + 280.0 * rows["cases"] / rows["cases"].sum()
    axes.scatter(rows["confidence"], rows["right"], size, color=INDIGO, zorder=3, edgecolor="white")
    for place in rows.itertuples():
        axes.annotate(f"{place.cases}", (place.confidence, place.right), (9, -9), textcoords="offset points")
    axes.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), aspect="equal")
    axes.set(xlabel="stated confidence (-)", ylabel="right answers (share of cases)")
    axes.grid(linewidth=0.5)
    return figure
