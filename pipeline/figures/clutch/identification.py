"""Draw the identified distribution parameters with their uncertainty."""

from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from scipy.stats import chi2

from pipeline.figures.clutch.tables import (
    LOOKS,
    PUSH_FORWARD,
    about,
    methods,
    optima,
    parameter,
    symbol,
    table,
)
from pipeline.figures.palette import INDIGO, WINE, nothing
from unmodelled.base.arrays import Array
from unmodelled.report.figures.style import BLACK, GREEN, ORANGE, absent, new_figure

NUMBERS = ("mu_1", "mu_2", "sigma_1", "sigma_2")
CONFIDENCE = 0.95
#: Deviance up to which profiles are shown, in thresholds.
SHOWN = 2.0
#: What is drawn on the profiles of pairs, and the colour where there is none.
TRUTH: dict[str, Any] = {"marker": "*", "color": GREEN, "mec": "white", "ms": 15, "ls": "", "zorder": 5}
_WHOLE: dict[str, Any] = {"ls": "", "clip_on": False}  # also at the edge of a panel
DRAWN = {**_WHOLE, "marker": "o", "color": ORANGE, "mec": BLACK, "mew": 0.6, "ms": 5, "zorder": 3}
OPTIMUM = {**_WHOLE, "marker": "D", "color": "white", "mec": BLACK, "ms": 7, "zorder": 4}
UNKNOWN = "0.9"


def _truth(data: Path) -> dict[str, float]:
    """The distribution that the bench kept to itself; empty where it is not known."""
    known = about(data)
    return dict(zip(NUMBERS, known.get("planted", ()), strict=False)) if known.get("truth") else {}


def profile_likelihoods(data: Path) -> Figure:
    """Profile likelihood of every parameter of the distribution, by the exact push-forward.

    Deviance: twice the loss of log-likelihood against the optimum when one parameter is held and the others
    are identified anew. The 95 % interval (shaded) lies below the dashed line. Where a curve ends below the
    line, at a bound of the search (dotted), the data do not limit the parameter on that side.
    """
    curves = table(data, "profiles")
    estimates = table(data, "estimates")
    estimates = estimates[estimates["method"] == PUSH_FORWARD].set_index("name")
    truth = _truth(data)
    figure = new_figure(3.4)
    threshold = float(chi2.ppf(CONFIDENCE, 1))
    panels = figure.subplots(1, len(NUMBERS), sharey=True)
    for axes, name in zip(panels, NUMBERS, strict=True):
        mine = curves[curves["name"] == name].sort_values("value")
        if mine.empty:
            absent(axes, f"no profile of {symbol(name)}")
            continue
        _profile(axes, mine, estimates.loc[name])
        axes.axhline(threshold, color=BLACK, linestyle="--", linewidth=1.2)
        if name in truth:
            axes.axvline(truth[name], color=GREEN, linewidth=2.2, zorder=1)
        axes.set(xlabel=parameter(name), ylim=(-0.15, SHOWN * threshold))
        axes.grid(axis="y", linewidth=0.5)
        axes.set_axisbelow(True)
    panels[0].set_ylabel("deviance (-)")
    handles = [
        Line2D([], [], color=INDIGO, linewidth=2.0, label="profile likelihood"),
        Line2D([], [], color=BLACK, linestyle="--", label=f"95 % threshold, {threshold:.2f}"),
        Patch(color=INDIGO, alpha=0.15, label="95 % interval"),
        Line2D([], [], color=WINE, linestyle=":", linewidth=2.4, label="bound of the search"),
        *([Line2D([], [], color=GREEN, linewidth=2.2, label="withheld truth")] if truth else []),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=5)
    return figure


def _profile(axes: Axes, curve: pd.DataFrame, estimate: pd.Series) -> None:
    """The curve with its interval; an end without limit is a bound."""
    ends = []
    for limit, outermost in (
        (estimate["low"], curve["value"].min()),
        (estimate["high"], curve["value"].max()),
    ):
        if pd.isna(limit):
            axes.axvline(outermost, color=WINE, linestyle=":", linewidth=2.4)
        ends.append(outermost if pd.isna(limit) else limit)
    axes.axvspan(*ends, color=INDIGO, alpha=0.15, linewidth=0, zorder=0)
    axes.plot(curve["value"], curve["deviance"], "o-", color=INDIGO, markersize=3.5, linewidth=2.0)


def profile_pairs(data: Path) -> Figure:
    """Profile likelihood of every two numbers of the distribution, and estimates from data sets drawn again.

    Dark is likely; the line encloses the joint 95 % region. Dots are the estimates by the exact push-forward
    from data sets drawn from the identified distribution. The narrow slanted region of μ₁ and μ₂ means
    that a higher threshold of the pressure and an earlier contact explain the data equally well.
    """
    grids, drawn = table(data, "pairs"), table(data, "replicates")
    best, truth = optima(data), _truth(data)
    known = {(row.first, row.second) for row in grids.itertuples(index=False)}
    couples = [couple for couple in combinations(NUMBERS, 2) if couple in known]
    if not couples:
        return nothing("no pair was profiled")
    figure = new_figure(8.6)
    grid = figure.add_gridspec(3, 3)
    cells = (grid[:2, :2], grid[0, 2], grid[1, 2], *(grid[2, k] for k in range(3)))
    panels = [figure.add_subplot(cell) for _, cell in zip(couples, cells, strict=False)]
    for axes, (first, second) in zip(panels, couples, strict=True):
        mesh = _pair(axes, grids[(grids["first"] == first) & (grids["second"] == second)])
        axes.plot(drawn[first], drawn[second], **DRAWN)
        if PUSH_FORWARD in best.index:
            axes.plot(best.loc[PUSH_FORWARD, first], best.loc[PUSH_FORWARD, second], **OPTIMUM)
        if truth:
            axes.plot(truth[first], truth[second], **TRUTH)
        axes.set(xlabel=parameter(first), ylabel=parameter(second), facecolor=UNKNOWN)
        axes.xaxis.set_major_locator(MaxNLocator(5))
    figure.colorbar(mesh, ax=panels, label="deviance (-)", aspect=40, pad=0.01)
    handles = [
        Line2D([], [], color=WINE, linewidth=1.8, label="95 % region"),
        Line2D([], [], **DRAWN, label="data set drawn again"),
        Line2D([], [], **OPTIMUM, label="optimum"),
        *([Line2D([], [], **TRUTH, label="withheld truth")] if truth else []),
        Patch(color=UNKNOWN, label="not profiled"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=5)
    return figure


def _pair(axes: Axes, rows: pd.DataFrame) -> ContourSet:
    field = rows.pivot_table(index="y", columns="x", values="deviance")
    x, y = field.columns.to_numpy(np.float64), field.index.to_numpy(np.float64)
    threshold = float(chi2.ppf(CONFIDENCE, 2))
    levels = [0.0, 0.5, 1.0, 2.0, 4.0, threshold, 10.0, 15.0, 20.0, 30.0]
    norm = PowerNorm(0.5, levels[0], levels[-1])
    mesh = axes.contourf(x, y, field.to_numpy(), levels=levels, norm=norm, cmap="Blues_r", extend="max")
    axes.contour(x, y, field.to_numpy(), levels=[threshold], colors=[WINE], linewidths=1.8)
    return mesh


def estimates_of_data_sets(data: Path) -> Figure:
    """Parameters of the distribution by three methods, from the observed and from newly drawn data sets.

    A dot is a data set of the same operating points drawn from the bench's withheld distribution, the diamond
    the observed data set. Black bar: inner half of the data sets; green line: the withheld distribution. The
    methods differ less than the data sets do.
    """
    found, truth = table(data, "identified"), _truth(data)
    names = methods(found)
    figure = new_figure(3.9)
    panels = figure.subplots(1, len(NUMBERS))
    for axes, name in zip(panels, NUMBERS, strict=True):
        for k, method in enumerate(names):
            mine = found[found["method"] == method]
            again = mine.loc[mine["data_set"] > 0, name].to_numpy(np.float64)
            _strip(axes, k, again, mine.loc[mine["data_set"] == 0, name].to_numpy(np.float64), method)
        if name in truth:
            axes.axhline(truth[name], color=GREEN, linewidth=2.2, zorder=1)
        axes.set_xticks([])
        axes.set(xlim=(-0.6, len(names) - 0.4), ylabel=parameter(name))
        axes.grid(axis="y", linewidth=0.5)
        axes.set_axisbelow(True)
    handles = [
        *(Line2D([], [], color=LOOKS[m].colour, marker="o", ls="", label=LOOKS[m].label) for m in names),
        Line2D([], [], **OPTIMUM, label="observed data"),
        Line2D([], [], color=BLACK, linewidth=3.0, label="inner half"),
        *([Line2D([], [], color=GREEN, linewidth=2.2, label="withheld truth")] if truth else []),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=6)
    return figure


def _strip(axes: Axes, x: int, again: Array, observed: Array, method: str) -> None:
    look = LOOKS[method]
    spread = np.linspace(-0.22, 0.22, len(again)) if len(again) > 1 else np.zeros(len(again))
    axes.plot(x + spread, again, "o", color=look.colour, markersize=5, alpha=0.7, markeredgewidth=0)
    if len(again):
        low, high = np.quantile(again, [0.25, 0.75])
        axes.plot([x + 0.34] * 2, [low, high], color=BLACK, linewidth=3.0, solid_capstyle="butt")
    axes.plot([x] * len(observed), observed, **OPTIMUM)
