"""Draw the models that could explain the gap, by their evidence."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib.figure import Figure

from unmodelled.report.figures.style import GREEN, absent, new_figure, styled
from unmodelled.report.figures.tables import number, table

#: Models that are shown, and the difference up to which the axis is linear.
MOST, LINEAR = 12, 10.0
#: Characters of a line of a name.
WRAP = 60


@styled
def candidates(data: Path) -> Figure:
    """All fitted models, by the evidence of the data against each model compared with the best model.

    The evidence is a difference of log-likelihoods, complexity penalty included. A difference of 3 means odds
    of twenty to one for the best model, a difference of 10 odds of twenty thousand to one. Green is the named
    model: the model with the fewest effects that explains the gap. The axis is linear up to 10, logarithmic
    beyond. The numbers at the right are gaps on the experiments that the models were fitted to.
    """
    rows = table(data, "candidates").head(MOST)
    labels = [fill(label, WRAP) for label in rows["label"]]
    lines = max((label.count("\n") + 1 for label in labels), default=1)
    figure = new_figure(1.1 + (0.2 + 0.15 * lines) * max(len(rows), 1))
    axes = figure.subplots()
    if not len(rows):
        absent(axes, "no model was fitted")
        return figure
    place, evidence = np.arange(len(rows)), rows["against"].to_numpy(np.float64)
    colours = [GREEN if named else "0.6" for named in rows["named"]]
    axes.hlines(place, 0.0, evidence, color=colours, linewidth=2.0)
    axes.scatter(evidence, place, c=colours, s=42, zorder=3)
    axes.set_xscale("symlog", linthresh=LINEAR)
    axes.set_xlim(-0.6, max(3.0 * float(evidence.max()), 2.0 * LINEAR))
    axes.set_yticks(place, labels, fontsize=9 if lines < 3 else 8)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    for y, gap in zip(place, rows["gap"], strict=True):
        axes.annotate(f"gap {number(gap)}", (1.01, y), xycoords=("axes fraction", "data"), va="center")
    axes.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
    axes.set_xlabel("evidence against it, beside the best (natural logarithm)")
    axes.grid(axis="x", linewidth=0.5)
    return figure
