"""Draw the correlations of the fitted numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from unmodelled.report.figures.style import new_figure, signed, styled
from unmodelled.report.figures.tables import table

TABLE = "correlations"
#: Numbers that are shown, those with the largest correlations, and how many have values in their cells.
MOST, WRITTEN = 24, 12


@styled
def correlations(data: Path) -> Figure:
    """Correlations of the fitted numbers, of effects and of uncertain parameters.

    From the covariance of the jackknife over the experiments. Near 1 or −1, the logs determine a combination
    of two numbers and not each of them: use them together, or log motions in which they act differently.
    """
    rows = table(data, TABLE)
    matrix = rows.pivot(index="row", columns="column", values="correlation")
    largest = matrix.abs().where(~np.eye(len(matrix), dtype=bool)).max()
    kept = set(largest.sort_values(ascending=False).head(MOST).index)
    names = [name for name in rows["row"].drop_duplicates() if name in kept]
    values = matrix.loc[names, names].to_numpy(np.float64)
    size = 0.42 * len(names)
    figure = new_figure(size + 1.6, min(size + 3.2, 10.0))
    axes = figure.subplots()
    image = axes.imshow(values, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    axes.set_xticks(range(len(names)), names, rotation=90)
    axes.set_yticks(range(len(names)), names)
    if len(names) <= WRITTEN:
        for (i, k), value in np.ndenumerate(values):
            colour = "white" if abs(value) > 0.6 else "black"
            axes.text(k, i, signed(value), ha="center", va="center", fontsize=8, color=colour)
    figure.colorbar(image, ax=axes, label="correlation", pad=0.02)
    return figure
