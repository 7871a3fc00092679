"""Draw simulated held-out runs: examples, distributions, and the number of hidden units."""

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter

from pipeline.cam_follower.cam import TURN
from pipeline.cam_follower.metrics import project_on_angle
from pipeline.figures.examples import read
from pipeline.figures.palette import band, by_share, handle, look, nothing, plain_log, present, shares, table
from pipeline.figures.settings import setting
from unmodelled.base.arrays import Array
from unmodelled.report.figures.style import BLACK, new_figure

MSE = "MSE of ω ((rad/s)²)"
#: Numbers of hidden units that the chapter settles on.
CHOSEN = {"f_bb": 128, "f_h1": 32, "f_h2": 32}
#: Runs of Fig. 6.18: their rank by error, from the best to the worst of the runs on file.
RANKS = (0.1, 0.5, 0.9)


def _split(rows: pd.DataFrame, split: str) -> pd.DataFrame:
    return rows[rows["split"] == split]


def hidden_units(data: Path) -> Figure:
    """Error of the simulated speed over the number of hidden units, trained on 30 % of the contact runs.

    The training runs are drawn at random. The error of the speed, projected on the angle, is the median over
    all other contact runs. A line is the median over the repeats, its band the inner half of them. A ring
    marks the number of units in all other figures: 128, 32 and 32, as in the dissertation. A model is large
    enough where its line stops falling.
    """
    tuning = table(data, "tuning")
    figure = new_figure(4.2, 7.5)
    axes = figure.subplots()
    for model in present(tuning):
        mine = tuning[tuning["model"] == model]
        band(axes, model, mine, "hidden", "omega_mse")
        chosen = mine.loc[mine["hidden"] == CHOSEN.get(model), "omega_mse"]
        if len(chosen):
            ring = Line2D([CHOSEN[model]], [chosen.median()], marker="o", markersize=14, fillstyle="none")
            ring.set(color=look(model).colour, markeredgewidth=1.6)
            axes.add_line(ring)
    axes.plot([], [], "o", color="0.4", fillstyle="none", markersize=11, label="chosen number")
    axes.set(xscale="log", yscale="log", xlabel="hidden units $n_h$ (-)", ylabel=MSE)
    widths = sorted(tuning["hidden"].unique())
    axes.set_xticks(widths, [str(width) for width in widths])
    axes.xaxis.set_minor_formatter(NullFormatter())
    plain_log(axes)
    figure.legend(loc="outside right upper")
    return figure


def simulation_drift(data: Path) -> Figure:
    """Simulated speed of three held-out runs over time and projected on the angle, against the measurement.

    Each run is simulated freely from its measured start by models trained on the contact runs outside the two
    subsets of its fold (five-fold interpolation, first repeat). The runs shown have a low, a median and a
    high error. Over time, a small error of the speed accumulates to a shift of the ripple. Projected on the
    angle there is no such shift; the error there (filled) is the fairer one and mostly below the error over
    time (hollow).
    """
    examples, errors = (_split(table(data, name), "interpolation") for name in ("examples", "errors"))
    errors = errors[(errors["repeat"] == 0) & errors["exp"].isin(examples["exp"])]
    if not len(errors):
        return nothing("no run of this campaign was simulated for the interpolation")
    campaign = read(data, "features", "t", "theta", "omega")
    ranking = errors.groupby("exp")["omega_mse_time"].median().sort_values(kind="stable").index
    chosen = dict.fromkeys(int(ranking[round(rank * (len(ranking) - 1))]) for rank in RANKS)
    figure = new_figure(0.9 + 2.1 * len(chosen))
    grid = figure.subplots(len(chosen), 3, squeeze=False, width_ratios=[1.0, 1.0, 0.5])
    models = present(examples)
    for row, exp in zip(grid, chosen, strict=True):
        number = int(np.flatnonzero(campaign.experiments["exp"] == exp)[0])
        run = examples[examples["exp"] == exp].sort_values("t")
        _over_time_and_angle(row[0], row[1], campaign[number], run)
        _two_errors(row[2], errors[errors["exp"] == exp], models)
        row[0].set_title(setting(campaign.experiments.iloc[number]), loc="left")
    _same_decades([row[2] for row in grid])
    grid[-1, 0].set_xlabel("time t (s)")
    grid[-1, 1].set_xlabel("angle θ (revolutions)")
    grid[-1, 2].set_xlabel(MSE)
    kinds = [
        Line2D([], [], color="0.4", marker="o", linestyle="", markerfacecolor=fill, label=f"MSE over {name}")
        for fill, name in (("white", "time"), ("0.4", "angle"))
    ]
    measured = Line2D([], [], color=BLACK, linewidth=2.2, label=look("measured").label)
    handles = [measured, *(handle(model) for model in models), *kinds]
    figure.legend(handles=handles, loc="outside upper center", ncols=-(-len(handles) // 2))
    return figure


def _over_time_and_angle(left: Axes, right: Axes, log: dict[str, Array], run: pd.DataFrame) -> None:
    t, turns = log["t"] - log["t"][0], log["theta"] / TURN
    for axes, x in ((left, t), (right, turns)):
        axes.plot(x, log["omega"], color=BLACK, linewidth=2.2)
        axes.set_ylim(min(0.0, 1.1 * log["omega"].min()), 1.25 * log["omega"].max())
        axes.set_ylabel("speed ω (rad/s)")
    for model in present(run):
        mine, colour = run[run["model"] == model], look(model).colour
        seen = mine[mine["t"] <= t[-1]]
        left.plot(seen["t"], seen["omega"], color=colour, linewidth=1.0)
        projected = project_on_angle(log["theta"], mine["theta"].to_numpy(), mine["omega"].to_numpy())
        right.plot(turns, projected, color=colour, linewidth=1.0)


def _two_errors(axes: Axes, errors: pd.DataFrame, models: list[str]) -> None:
    """A line per model from the error over time (hollow) to the error over the angle (filled)."""
    for place, model in enumerate(models):
        mine, style = errors[errors["model"] == model], look(model)
        both = [mine["omega_mse_time"].mean(), mine["omega_mse"].mean()]
        axes.plot(both, [place, place], color=style.colour, linewidth=0.8)
        for value, fill in zip(both, ("white", style.colour), strict=True):
            axes.plot(value, place, style.marker, color=style.colour, markerfacecolor=fill, markersize=6.5)
    axes.set(xscale="log", yticks=[], ylim=(len(models) - 0.4, -0.6))
    axes.spines["left"].set_visible(False)
    axes.grid(axis="x", linewidth=0.5)


def _same_decades(panels: list[Axes]) -> None:
    """Whole decades on every logarithmic axis, so that rows compare and each has labels."""
    limits = np.log10([axes.get_xlim() for axes in panels])
    for axes in panels:
        axes.set_xlim(10.0 ** np.floor(limits.min()), 10.0 ** np.ceil(limits.max()))
        axes.xaxis.set_minor_formatter(NullFormatter())


def interpolation_errors(data: Path) -> Figure:
    """Distribution of the simulation error over all contact runs, each held out once (5-fold interpolation).

    The runs are sorted from stable to unstable in ten subsets; a fold holds two neighbours out and trains on
    the other eight. The error is that of the speed projected on the angle, median over the repeats. A curve
    further left is a better model; the marker and the number in the legend are its median over the runs.
    """
    errors = _split(table(data, "errors"), "interpolation")
    if not len(errors):
        return nothing("no run of this campaign was simulated for the interpolation")
    figure = new_figure(4.2, 8.5)
    axes = figure.subplots()
    for model in present(errors):
        style = look(model)
        runs = errors[errors["model"] == model].groupby("exp")["omega_mse"].median().sort_values()
        share = 100.0 * np.arange(1, len(runs) + 1) / len(runs)
        axes.plot(runs, share, color=style.colour)
        dot = axes.plot(runs.median(), 50.0, style.marker, color=style.colour, markersize=9, zorder=3)[0]
        dot.set(markeredgecolor="white", label=f"{style.label}: {runs.median():.2g}")
    axes.axhline(50.0, color="0.7", linewidth=0.8, linestyle=":", zorder=0)
    axes.set(xscale="log", ylim=(0.0, 100.5), xlabel=MSE, ylabel="runs with a smaller error (%)")
    axes.grid(axis="x", linewidth=0.5)
    figure.legend(loc="outside right upper", title="median MSE ((rad/s)²)")
    return figure


def extrapolation_errors(data: Path) -> Figure:
    """Simulation error on the contact runs next to the boundary, over the share of stable runs trained on.

    The contact runs are sorted by their minimal contact force; the models see the most stable 10 to 80 % and
    are judged on the 20 % next to the boundary (I9 and I10), always the same. The error is that of the speed
    projected on the angle, median over the runs; a line is the median over the repeats, its band holds the
    inner half of them. The further to the left, the further the models have to extrapolate.
    """
    errors = shares(_split(table(data, "errors"), "extrapolation"))
    if not len(errors):
        return nothing("no run of this campaign was simulated for the extrapolation")
    medians = errors.groupby(["model", "share", "repeat"])["omega_mse"].median().reset_index()
    return by_share(medians, "omega_mse", MSE)
