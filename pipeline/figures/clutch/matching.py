"""Draw densities of single operating points by moment matching, and their distances to the true densities."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.figures.clutch.tables import (
    DEMO,
    GAUSSIAN,
    LOOKS,
    MONTE_CARLO,
    MS,
    SAMPLED,
    about,
    alpha_text,
    area_of,
    demo_alpha,
    line_of,
    methods,
    table,
)
from unmodelled.report.figures.style import GREY, absent, new_figure, styled


@styled
def density_estimates(data: Path) -> Figure:
    """Densities of the shifting time by moment matching, and their distance to the true density.

    Top: the operating point of the text; bottom: the point whose density is least like a Gaussian density.
    The moments are those of 25 collocation points (solid), or of the Monte Carlo sample that is also the
    reference (dashed, hatched): the difference between the two is the error of polynomial chaos; the
    remainder is the error of a density with these moments. Right: earth mover's distance (EMD, s) to the
    reference.
    """
    curves, rows = table(data, "densities"), table(data, "monte_carlo")
    curves, rows = curves[curves["alpha_of"] == DEMO], rows[rows["alpha_of"] == DEMO]
    if curves.empty:
        figure = new_figure(2.0)
        absent(figure.subplots(), "no distribution of this name was propagated")
        return figure
    names = [name for name in methods(rows) if name in curves]
    least = rows[rows["method"] == GAUSSIAN].set_index("id")["emd"].idxmax()
    points = dict.fromkeys([str(about(data).get("shown", "")), str(least)])
    shown = [name for name in points if (curves["id"] == name).any()]
    figure = new_figure(0.7 + 3.1 * len(shown))
    grid = figure.subplots(len(shown), 2, width_ratios=[1.5, 1.0], squeeze=False)
    for (left, right), point in zip(grid, shown, strict=True):
        _fits(left, curves[curves["id"] == point], names)
        left.set_title(f"operating point {point}, α = {alpha_text(demo_alpha(data))}")
        emd_bars(right, rows[rows["id"] == point].groupby("method")["emd"].mean(), names)
    figure.legend(handles=[area_of(MONTE_CARLO), *map(line_of, names)], loc="outside lower center", ncols=3)
    return figure


def _fits(axes: Axes, curves: pd.DataFrame, names: list[str]) -> None:
    axes.fill_between(curves["y"], curves[MONTE_CARLO], color=GREY, alpha=0.45, linewidth=0)
    for name in names:
        look = LOOKS[name]
        axes.plot(curves["y"], curves[name], color=look.colour, linestyle=look.line, linewidth=1.9)
    axes.set(xlabel="shifting time y (s)", ylabel="density (1/s)", ylim=(0.0, None))
    axes.grid(linewidth=0.5)


def emd_bars(axes: Axes, emd: pd.Series, names: list[str]) -> None:
    """Draw distances as bars, hatched for methods with sampled moments.

    Takes emd in s.
    """
    values = MS * emd.reindex(names).to_numpy(np.float64)
    for row, (name, value) in enumerate(zip(names, values, strict=True)):
        colour, sampled = LOOKS[name].colour, name.endswith(SAMPLED)
        face, hatch = ("white", "////") if sampled else (colour, "")
        axes.barh(row, value, height=0.66, facecolor=face, hatch=hatch, edgecolor=colour, linewidth=1.4)
        axes.annotate(f"{value:.2g}", (value, row), (4, 0), textcoords="offset points", va="center")
    labels = [LOOKS[name].label.replace(", ", ",\n") for name in names]
    axes.set_yticks(range(len(names)), labels, fontsize=8.5)
    axes.set(xlabel="EMD (ms)", xlim=(0.0, 1.18 * float(np.nanmax(values, initial=1e-12))))
    axes.invert_yaxis()
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="x", linewidth=0.5)
    axes.set_axisbelow(True)
