"""Draw the models that could explain the gap, by their predictions of left-out experiments."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib.figure import Figure

from unmodelled.report.figures.style import GREEN, absent, new_figure, styled
from unmodelled.report.figures.tables import table

#: Models that are shown.
MOST = 12
#: Characters of a line of a name.
WRAP = 60


@styled
def candidates(data: Path) -> Figure:
    """The named model and the best others, by how much worse they predict experiments left out of the fit.

    The score is the mean over experiments and outputs of ln(mean square error / noise variance + 1).
    Shown is the difference from the named model, with its standard error over experiments; to the right
    is worse. The named model is marked: the simplest model that no other model beats by more than
    chance and by a material amount; where nothing is named, it is the one without a law. Models that
    add effects to it come only after those that compete with it.
    """
    rows = table(data, "candidates").head(MOST)
    labels = [fill(label, WRAP) for label in rows["label"]]
    lines = max((label.count("\n") + 1 for label in labels), default=1)
    figure = new_figure(1.1 + (0.2 + 0.15 * lines) * max(len(rows), 1))
    axes = figure.subplots()
    if not len(rows):
        absent(axes, "no model was fitted")
        return figure
    place, worse = np.arange(len(rows)), rows["difference"].to_numpy(np.float64)
    colours = [GREEN if named else "0.6" for named in rows["named"]]
    low, high = (worse + sign * rows["standard_error"].to_numpy(np.float64) for sign in (-1.0, 1.0))
    axes.hlines(place, low, high, color=colours, linewidth=2.0)
    axes.scatter(worse, place, c=colours, s=42, zorder=3)
    axes.axvline(0.0, color="0.6", linewidth=0.8)
    axes.set_yticks(place, labels, fontsize=9 if lines < 3 else 8)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlabel(
        "prediction of left-out experiments, beside the named model (nats, to the right is worse)"
    )
    axes.grid(axis="x", linewidth=0.5)
    return figure
