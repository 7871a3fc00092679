"""Draw approximate densities, and the accuracy of densities and log-likelihoods."""

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pipeline.figures.clutch.tables import (
    CHAOS,
    COLLOCATION,
    DEMO,
    GAUSSIAN,
    LOOKS,
    MAXIMUM_ENTROPY,
    MONTE_CARLO,
    MS,
    OPTIMA,
    PUSH_FORWARD,
    SAMPLED,
    about,
    alpha_text,
    area_of,
    demo_alpha,
    line_of,
    methods,
    table,
)
from pipeline.figures.palette import WINE, listed_x, nothing, plain_log
from unmodelled.report.figures.style import BLACK, GREY, absent, new_figure

#: Points whose names are shown.
NAMED = 3
CAMPAIGNS = {"clutch": "clutch", "clutch_sharp": "sharper clutch"}


def individual_likelihoods(data: Path) -> Figure:
    """Estimated log-likelihood of every operating point against the true one, at the optimum of each method.

    The true log-likelihood is that of the Monte Carlo density. Points above the line are overestimated; on
    the line the estimated density is as good as the true one. The operating points farthest from the line are
    named: their mean and variance do not determine the density.
    """
    rows = table(data, "monte_carlo")
    figure = new_figure(4.8)
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, method in zip(panels, CHAOS, strict=True):
        mine = rows[(rows["alpha_of"] == method) & (rows["method"] == method)]
        if mine.empty:
            absent(axes, "no distribution was identified by this method")
            continue
        estimate = mine["reference"] + mine["error"]
        ends = [float(mine["reference"].min()), float(max(mine["reference"].max(), estimate.max()))]
        axes.axline((ends[0], ends[0]), slope=1.0, color=GREY, linewidth=1.4, zorder=1)
        look = LOOKS[method]
        axes.plot(mine["reference"], estimate, look.marker, color=look.colour, markersize=5, alpha=0.75)
        for k in mine["error"].abs().nlargest(NAMED).index:
            place = (mine.loc[k, "reference"], estimate[k])
            axes.annotate(mine.loc[k, "id"], place, (6, -3), textcoords="offset points", va="top", fontsize=9)
        summary = f"{mine['error'].sum():+.1f}".replace("-", "−")
        axes.set_title(
            f"{look.label} at {OPTIMA[method]}: sum of differences {summary},\n"
            f"mean absolute difference {mine['error'].abs().mean():.3f}"
        )
        axes.set_xlabel(r"true $\log\mathcal{L}_l$, Monte Carlo (-)")
        axes.grid(linewidth=0.5)
    panels[0].set_ylabel(r"estimated $\log\hat{\mathcal{L}}_l$ (-)")
    return figure


def mean_distances(data: Path) -> Figure:
    """Earth mover's distance (EMD, s) of the estimated densities to the true ones, mean over the operating
    points.

    The true densities are those of Monte Carlo. Left and centre: at the optimum of each method. Hatched bars
    take the moments of the Monte Carlo sample, so that they contain no error of polynomial chaos; the bar of
    the exact push-forward is the error of that sample. Right: by how much the distance of maximum entropy is
    lower than that of the Gaussian density; a dot is a data set drawn from the bench's distribution (or the
    observed one) and identified anew, the bar their mean. Two clutches are shown: the clutch of the other
    figures, and one that reacts more sharply.
    """
    rows, accuracy = table(data, "monte_carlo"), table(data, "accuracy", None)
    figure = new_figure(4.0)
    *panels, right = figure.subplots(1, 3, width_ratios=[1.0, 1.0, 0.95])
    names = methods(rows[rows["alpha_of"].isin(CHAOS)])
    means = rows.groupby(["alpha_of", "method"])["emd"].mean()
    for axes, of in zip(panels, CHAOS, strict=True):
        if of not in means:
            absent(axes, "no distribution was identified by this method")
            continue
        emd_bars(axes, means[of], names)
        axes.set_title(f"at {OPTIMA[of]}")
    widest = max(axes.get_xlim()[1] for axes in panels)
    for axes in panels:
        axes.set_xlim(0.0, widest)
    panels[1].set_yticklabels([])
    _reductions(right, accuracy)
    return figure


def _reductions(axes: Axes, accuracy: pd.DataFrame) -> None:
    """How much lower the EMD of maximum entropy is, %, data set by data set."""
    wide = accuracy.groupby(["campaign", "alpha_of", "data_set", "method"])["emd"].mean().unstack("method")
    if not {GAUSSIAN, MAXIMUM_ENTROPY} <= set(wide.columns):
        absent(axes, "nothing to compare")
        return
    lower = 100.0 * (1.0 - wide[MAXIMUM_ENTROPY] / wide[GAUSSIAN])
    groups = [(c, of) for c in CAMPAIGNS for of in CHAOS if (c, of) in lower.index]
    for row, key in enumerate(groups):
        values = lower[key].to_numpy(np.float64)
        colour = LOOKS[key[1]].colour
        spread = np.linspace(-0.18, 0.18, len(values)) if len(values) > 1 else np.zeros(1)
        axes.plot(values, row + spread, "o", color=colour, alpha=0.55, markersize=4.5, markeredgewidth=0)
        axes.plot(values.mean(), row, "|", color=BLACK, markersize=22, markeredgewidth=2.4)
    labels = [f"{CAMPAIGNS[c]}\nat {OPTIMA[of]}" for c, of in groups]
    axes.set_yticks(range(len(groups)), labels, fontsize=8.5)
    axes.invert_yaxis()
    axes.set(xlim=(min(0.0, float(lower.min()) - 5.0), 100.0))
    axes.set_xlabel("EMD lower than the Gaussian's (%)")
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="x", linewidth=0.5)


def sample_density(data: Path) -> Figure:
    """Error of the log-likelihoods over the number of simulations per operating point.

    Mean absolute error (MAE) over all operating points against the Monte Carlo reference, at the optimum of
    each method. Monte Carlo: median and inner half of the repeats; quasi Monte Carlo uses evenly spread
    samples. Horizontal lines: methods with a fixed number of simulations, at the marker; where a sampling
    curve crosses such a line, both are equally accurate. Samples become a density by the same rule as the
    reference, which favours large samples.
    """
    sampling, rows = table(data, "sampling"), table(data, "monte_carlo")
    rows = rows.assign(size=rows["error"].abs())
    budgets = {GAUSSIAN: COLLOCATION, MAXIMUM_ENTROPY: COLLOCATION}
    surface = about(data).get("simulations")
    if surface:
        budgets[PUSH_FORWARD] = int(surface)
    figure = new_figure(4.6)
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, of in zip(panels, CHAOS, strict=True):
        mine = sampling[sampling["alpha_of"] == of]
        if mine.empty:
            absent(axes, "no distribution was identified by this method")
            continue
        _sampled(axes, mine)
        exact = rows[rows["alpha_of"] == of].groupby("method")["size"].mean()
        for name in (n for n in (GAUSSIAN, MAXIMUM_ENTROPY, PUSH_FORWARD) if n in exact):
            look = LOOKS[name]
            axes.axhline(exact[name], color=look.colour, linestyle="--", linewidth=1.5)
            if name in budgets:
                axes.plot(budgets[name], exact[name], look.marker, color=look.colour, markersize=9, zorder=4)
        axes.set_yscale("log")
        plain_log(axes)
        listed_x(axes, np.unique(sampling["samples"].to_numpy(np.float64)))
        axes.set(xlabel="simulations a point (-)", title=f"at {OPTIMA[of]}")
    panels[0].set_ylabel(r"MAE of $\log\mathcal{L}_l$ (-)")
    handles = [
        Line2D([], [], color=BLACK, linewidth=1.8, label="Monte Carlo, median and inner half"),
        Line2D([], [], color=WINE, marker="o", markersize=4, label="quasi Monte Carlo"),
        *(_fixed(name, budgets.get(name)) for name in (GAUSSIAN, MAXIMUM_ENTROPY, PUSH_FORWARD)),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def _sampled(axes: Axes, rows: pd.DataFrame) -> None:
    random = rows[rows["rule"] == "random"].groupby("samples")["mae"].quantile([0.25, 0.5, 0.75]).unstack()
    if len(random):
        axes.fill_between(random.index, random[0.25], random[0.75], color=BLACK, alpha=0.18, linewidth=0)
        axes.plot(random.index, random[0.5], color=BLACK, linewidth=1.8)
    even = rows[rows["rule"] == "even"].sort_values("samples")
    axes.plot(even["samples"], even["mae"], "o-", color=WINE, markersize=4)


def _fixed(name: str, count: int | None) -> Line2D:
    look = LOOKS[name]
    label = look.label if count is None else f"{look.label}, {count} simulations"
    return Line2D([], [], color=look.colour, linestyle="--", marker=look.marker, label=label)


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
        return nothing("no distribution of this name was propagated")
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
    """Draw distances as bars, hatched for methods with sampled moments. Takes emd in s."""
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
