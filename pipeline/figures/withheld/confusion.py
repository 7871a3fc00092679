"""Draw which families of effects are confused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from pipeline.figures.withheld.tables import WINE, readable, table
from unmodelled.report.figures.style import absent, new_figure, styled

#: Verdicts that name no effect, after the families; the rare one has a column only where it occurs.
NOTHING, RARE = ("unknown", "no_gap"), "check_logs"


@styled
def confusion_matrix(data: Path) -> Figure:
    """Family that the diagnosis names first, against the planted family.

    A cell gives the number of cases, its colour their share of the row. Single effects, in all or in some of
    the runs, that a fit with the known truth can detect. Cells beside the diagonal are wrong, unless the logs
    of the machine cannot distinguish the two families. The last columns are cases in which no effect is
    named.
    """
    counts = table(data, "confusion")
    figure = new_figure(8.4)
    axes = figure.subplots()
    if counts.empty:
        absent(axes, "no planted effect can be seen")
        return figure
    said = {*counts["family"], *counts["first_family"]}
    families = sorted(said - {*NOTHING, RARE})
    columns = [*families, *NOTHING, *({RARE} & said)]
    wide = counts.pivot(index="family", columns="first_family", values="cases")
    wide = wide.reindex(index=[f for f in families if f in wide.index], columns=columns).fillna(0.0)
    shares = wide.div(wide.sum(axis=1), axis=0)
    colours = LinearSegmentedColormap.from_list("wine", ["white", WINE])
    axes.pcolormesh(shares, cmap=colours, vmin=0.0, vmax=1.0, edgecolor="0.9", linewidth=0.5)
    _numbers(axes, wide, shares)
    axes.axvline(len(families), color="black", linewidth=1.0)
    names = [readable(name) for name in columns]
    axes.set_xticks(np.arange(len(columns)) + 0.5, names, rotation=60, ha="right", rotation_mode="anchor")
    axes.set_yticks(np.arange(len(wide)) + 0.5, [readable(str(name)) for name in wide.index])
    axes.invert_yaxis()
    axes.tick_params(length=0.0)
    axes.set(xlabel="named first (family)", ylabel="planted (family)")
    return figure


def _numbers(axes: Axes, wide: pd.DataFrame, shares: pd.DataFrame) -> None:
    for (i, j), count in np.ndenumerate(wide.to_numpy()):
        if count > 0:
            colour = "white" if shares.iat[i, j] > 0.5 else "black"
            axes.text(j + 0.5, i + 0.5, f"{count:.0f}", ha="center", va="center", color=colour, fontsize=8)
