"""Draw the calibration of the confidence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from pipeline.figures.withheld.tables import INDIGO, table
from unmodelled.report.figures.style import GREY, absent, new_figure, styled


@styled
def calibration_curve(data: Path) -> Figure:
    """Share of right answers over the stated confidence of the diagnosis.

    Cases of all kinds in bins of width 0.1; the area of a marker is the number of cases, the bar the 95 %
    interval (Wilson). On the line, answers with a confidence of 90 % are right in 90 % of the cases. Below
    the line the diagnosis is overconfident.
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
