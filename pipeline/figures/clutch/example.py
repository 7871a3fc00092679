"""Draw the univariate example: transformation of its density, and approximation by polynomial chaos."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pipeline.figures.clutch.tables import CHAOS, LOOKS, area_of, line_of, table
from pipeline.figures.palette import INDIGO, listed_x
from unmodelled.report.figures.style import BLACK, GREEN, GREY, NEUTRAL, absent, new_figure, shades

BINS = 10
MARKERS = "osD^vP"
REFERENCE = Line2D([], [], color=BLACK, linewidth=1.3, linestyle="--", label="reference")


def transformed_density(data: Path) -> Figure:
    """Transformation of a random variable ϑ into Y = y(1; ϑ) by a nonlinear function.

    Lower right: density of ϑ, a normal distribution of mean 0 and standard deviation 2 clipped to [−2, 5].
    Upper right: the function. Upper left: density of Y, turned so that both upper panels share the vertical
    axis. Black dots are a Monte Carlo sample, grey bars its histogram of 10 bins. Where the function is
    steep the density of Y is low.
    """
    curves, draws = table(data, "example_densities"), table(data, "example_draws")
    figure = new_figure(6.0, 8.5)
    grid = figure.subplots(2, 2, sharex="col", sharey="row", width_ratios=[1, 1.7], height_ratios=[1.5, 1])
    (left, right), (empty, lower) = grid
    bars: dict[str, Any] = {"bins": BINS, "density": True, "color": GREY, "alpha": 0.5}
    look: dict[str, Any] = {"color": INDIGO, "linewidth": 2.0}
    left.hist(draws["y"], orientation="horizontal", **bars)
    left.plot(curves["density_of_y"], curves["y"], **look)
    left.plot(np.zeros(len(draws)), draws["y"], "o", color=BLACK, markersize=3.5, clip_on=False)
    right.plot(curves["theta"], curves["response"], color=GREEN, linewidth=2.0)
    right.plot(draws["theta"], draws["y"], "o", color=BLACK, markersize=3.5)
    lower.hist(draws["theta"], **bars)
    lower.plot(curves["theta"], curves["density_of_theta"], **look)
    lower.plot(draws["theta"], np.zeros(len(draws)), "o", color=BLACK, markersize=3.5, clip_on=False)
    left.set(xlabel="density $f_Y$ (-)", ylabel="output y (-)")
    left.tick_params(labelbottom=True)
    left.invert_xaxis()
    lower.set(xlabel=r"parameter $\vartheta$ (-)", ylabel=r"density $f_\vartheta$ (-)")
    lower.yaxis.set_tick_params(labelleft=True)
    for axes in (left, right, lower):
        axes.grid(linewidth=0.5)
        axes.set_axisbelow(True)
    empty.set_axis_off()
    handles = [
        Line2D([], [], label="density", **look),
        Line2D([], [], color=GREEN, linewidth=2.0, label=r"function $y(1; \vartheta)$"),
        Line2D([], [], color=BLACK, marker="o", markersize=4, linestyle="", label=f"{len(draws)} samples"),
        Patch(color=GREY, alpha=0.5, label="their histogram"),
    ]
    empty.legend(handles=handles, loc="center")
    return figure


def chaos_moments(data: Path) -> Figure:
    """Coefficients of the Hermite chaos over the quadrature order q, and errors of the moments that follow.

    Top: coefficients of index i, dotted their limits; one of high index needs a high order. Centre: error of
    the raw moments that follow from the coefficients of a chaos of degree d (logarithmic). Bottom: the same
    for moments of 10 000 samples of the polynomial, which sampling limits for all d and q. A white
    marker says that the moment is too low.
    """
    coefficients, moments = table(data, "example_coefficients"), table(data, "example_moments")
    figure = new_figure(8.8)
    upper, lower = figure.subfigures(2, 1, squeeze=False, height_ratios=[1.0, 1.9])[:, 0]
    _coefficients(upper.subplots(), coefficients)
    moments = moments.assign(gap=moments["value"] - moments["truth"])
    orders, degrees = sorted(moments["moment"].unique()), sorted(moments["degree"].unique())
    grid = lower.subplots(2, len(orders), sharex=True, sharey=True, squeeze=False)
    for row, source in zip(grid, ("coefficients", "sampled"), strict=True):
        for axes, m in zip(row, orders, strict=True):
            mine = moments[(moments["source"] == source) & (moments["moment"] == m)]
            _gaps(axes, mine, degrees)
        row[0].set_ylabel(f"|error|, from {'coefficients' if source == 'coefficients' else 'samples'} (-)")
    for axes, m in zip(grid[0], orders, strict=True):
        axes.set_title(f"moment $\\mu_{m}$")
    for axes in grid[-1]:
        axes.set_xlabel("quadrature order q (-)")
    below = Line2D([], [], color=BLACK, marker="o", mfc="white", linestyle="", label="too low")
    lower.legend(handles=[*_degrees(degrees), below], loc="outside lower center", ncols=6)
    return figure


def _degrees(degrees: list[int]) -> list[Line2D]:
    looks = zip(degrees, shades(len(degrees)), MARKERS, strict=False)
    return [Line2D([], [], color=colour, marker=marker, label=f"d = {d}") for d, colour, marker in looks]


def _coefficients(axes: Axes, rows: pd.DataFrame) -> None:
    colours = [*NEUTRAL, INDIGO]
    for (i, mine), colour, marker in zip(rows.groupby("index"), colours, MARKERS, strict=False):
        axes.plot(mine["order"], mine["value"], color=colour, marker=marker, markersize=5, label=f"i = {i}")
        axes.axhline(mine["truth"].iloc[0], color=colour, linestyle=":", linewidth=1.2)
    listed_x(axes, np.unique(rows["order"].to_numpy(np.float64)))
    axes.set(xlabel="quadrature order q (-)", ylabel="coefficient $c_i$ (-)")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _gaps(axes: Axes, rows: pd.DataFrame, degrees: list[int]) -> None:
    """Sizes of the errors over q; those below zero with white markers."""
    for d, colour, marker in zip(degrees, shades(len(degrees)), MARKERS, strict=False):
        mine = rows[rows["degree"] == d].sort_values("order")
        axes.plot(mine["order"], mine["gap"].abs(), color=colour, marker=marker, markersize=5.5)
        low = mine[mine["gap"] < 0.0]
        axes.plot(low["order"], low["gap"].abs(), marker, color=colour, mfc="white", markersize=5.5)
    axes.set_yscale("log")
    listed_x(axes, np.unique(rows["order"].to_numpy(np.float64)))
    axes.grid(axis="y", linewidth=0.5)


def fitted_densities(data: Path) -> Figure:
    """Gaussian and maximum entropy densities with the moments of polynomial chaos, and their distance to Y's.

    Top: the best fit of either kind by the earth mover's distance (EMD), beside the density with the exact
    moments, the reference. Bottom: EMD over degree d and quadrature order q; dashed, the reference. A fit can
    come a little closer than the reference, as exact moments do not minimise the distance.
    """
    fits, curves = table(data, "example_fits"), table(data, "example_curves")
    figure = new_figure(6.6)
    grid = figure.subplots(2, 2, sharey="row", height_ratios=[1.2, 1.0])
    ways = fits[fits["degree"] > 0]
    degrees = sorted(ways["degree"].unique())
    for column, name in zip(grid.T, CHAOS, strict=True):
        own, exact = ways[ways["density"] == name], fits[(fits["degree"] == 0) & (fits["density"] == name)]
        if own.empty:
            absent(column[0], f"no {LOOKS[name].label} density was fitted")
            column[1].set_axis_off()
            continue
        _best(column[0], curves, name, own.loc[own["emd"].idxmin()])
        for d, colour, marker in zip(degrees, shades(len(degrees)), MARKERS, strict=False):
            mine = own[own["degree"] == d].sort_values("order")
            column[1].plot(mine["order"], mine["emd"], color=colour, marker=marker)
        for value in exact["emd"]:
            column[1].axhline(value, color=BLACK, linestyle="--", linewidth=1.3)
        listed_x(column[1], np.unique(ways["order"].to_numpy(np.float64)))
        column[1].set(xlabel="quadrature order q (-)", ylim=(0.0, 1.1 * float(fits["emd"].max())))
        column[1].grid(axis="y", linewidth=0.5)
    grid[0, 0].set_ylabel("density (-)")
    grid[1, 0].set_ylabel("EMD (-)")
    grid[1, 1].legend(handles=[*_degrees(degrees), REFERENCE], loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _best(axes: Axes, curves: pd.DataFrame, name: str, best: pd.Series) -> None:
    look = LOOKS[name]
    axes.fill_between(curves["y"], curves["exact"], color=GREY, alpha=0.45, linewidth=0)
    axes.plot(curves["y"], curves[name], color=look.colour, linewidth=2.2)
    axes.plot(curves["y"], curves[f"{name}_reference"], color=BLACK, linewidth=1.3, linestyle="--")
    highest = float(curves.drop(columns="y").to_numpy().max())
    axes.set(xlabel="output y (-)", ylim=(0.0, 1.35 * highest))
    axes.set_title(
        f"{look.label}: EMD {best['emd']:.3f} at d = {best['degree']:.0f}, q = {best['order']:.0f}"
    )
    exact = area_of("monte_carlo", "exact density of Y")
    axes.legend(handles=[exact, line_of(name, "best fit"), REFERENCE], loc="upper right")
