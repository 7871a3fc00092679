"""Draw the accuracy for different inputs of the network, and for training data near the test signals."""

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pipeline.figures.palette import INDIGO, WINE, nothing
from pipeline.figures.settings import MM
from pipeline.figures.slider_crank.tables import (
    BASELINES,
    INPUTS,
    MEASURED,
    RMSE,
    Accuracy,
    accuracy,
    example,
    framed,
    number,
    plain,
    plain_log_x,
    signal_name,
    table,
)
from unmodelled.report.figures.style import BLACK, GREEN, GREY, ORANGE, absent, new_figure, thin

#: Trajectories in the figure on the region of operations.
FASTEST = 3


def network_inputs(data: Path) -> Figure:
    """Accuracy of free runs on test signals for different inputs q of the network; below, models without one.

    Leave-one-out: a model sees all trajectories but the one that it then simulates freely from the measured
    start. Left, a dot is a test signal and repeat; the bar covers the 90 % most accurate, the diamond and the
    number are the mean of those that did not diverge. Right, one of these free runs. Where q determines
    position and speed of the slider, the load can be learned; with less, only in part.
    """
    errors, examples = plain(table(data, "errors")), plain(table(data, "examples"))
    inputs = [name for name in INPUTS if (errors["model"] == name).any()]
    others = [name for name in BASELINES if (errors["model"] == name).any()]
    found = {name: accuracy(errors[errors["model"] == name]) for name in [*inputs, *others]}
    chosen = example(examples.loc[examples["model"].isin(found), "id"])
    runs = examples[examples["id"] == chosen]
    if not found:
        return nothing("none of these models was trained", 1.1)
    figure = new_figure(1.1 + 0.62 * len(found))
    grid = figure.subplots(len(found), 2, sharex="col", squeeze=False, width_ratios=[1.0, 1.05])
    limits = _limits(list(found.values()))
    for row, (name, result) in zip(grid, found.items(), strict=True):
        colour = INDIGO if name in inputs else WINE
        label = f"q = {INPUTS[name]}" if name in inputs else BASELINES[name]
        _interval(row[0], result, colour, limits, last=row is grid[-1])
        row[0].set_ylabel(label, rotation=0, ha="right", va="center")
        _free_run(row[1], runs[runs["model"] == name], colour)
    grid[0, 1].set_title(f"free run of test signal {signal_name(chosen)}: speed ω (rad/s)")
    grid[0, 0].set_title("error on test signals, mean on the right")
    grid[-1, 0].set_xlabel(RMSE)
    grid[-1, 1].set_xlabel("time t (s)")
    figure.set_layout_engine("constrained", hspace=0.0, h_pad=0.02)
    figure.legend(handles=_handles(bool(others)), loc="outside lower center", ncols=5)
    return figure


def _limits(results: list[Accuracy]) -> tuple[float, float]:
    values = np.concatenate([result.rmse for result in results])
    return (0.7 * values.min(), 1.4 * values.max()) if len(values) else (0.1, 10.0)


def _interval(axes: Axes, result: Accuracy, colour: str, limits: tuple[float, float], last: bool) -> None:
    """Test signals on a line; a bar that leaves the axes belongs to a model that often diverges."""
    axes.plot([result.best, min(result.limit, limits[1])], [0.0, 0.0], color=colour, linewidth=7, alpha=0.3)
    axes.plot(result.rmse, np.zeros_like(result.rmse), ".", color=colour, markersize=4.5, alpha=0.55, mew=0)
    axes.plot(result.mean, 0.0, "D", color=colour, markeredgecolor="white", markersize=8.5)
    text = number(result.mean)
    text += f"\n{result.diverged} diverged" if result.diverged else ""
    axes.annotate(text, (1.01, 0.5), xycoords="axes fraction", va="center", color=colour)
    plain_log_x(axes)
    axes.set(xlim=limits, ylim=(-1.0, 1.0), yticks=[])
    axes.spines["left"].set_visible(False)
    axes.spines["bottom"].set_visible(last)
    axes.tick_params(axis="x", which="both", length=3.0 if last else 0.0)


def _free_run(axes: Axes, run: pd.DataFrame, colour: str) -> None:
    if not len(run):
        absent(axes, "not on file")
        return
    t, measured, predicted = thin(
        *(run[name].to_numpy() for name in ("t", "omega_measured", "omega")), points=400
    )
    axes.plot(t, measured, color=BLACK, linewidth=2.4)
    axes.plot(t, predicted, color=colour, linewidth=1.3)
    framed(axes, measured, 0.15)
    axes.grid(linewidth=0.5)


def _handles(others: bool) -> list[Line2D]:
    kinds = [(INDIGO, "hybrid, network with input q"), *([(WINE, "for comparison")] if others else [])]
    lines = [Line2D([], [], color=colour, linewidth=1.6, label=name) for colour, name in kinds]
    bar = Line2D([], [], color=GREY, linewidth=7, alpha=0.5, label="90 % most accurate")
    mean = Line2D([], [], color="0.4", marker="D", linestyle="", markersize=7, label="mean")
    return [MEASURED, *lines, bar, mean]


def region_of_operations(data: Path) -> Figure:
    """The fastest test signals, predicted from slow training data alone and from data around them.

    Left, the states of the slider in the set I1 of slow trajectories, and in the others. Centre, free runs by
    a model trained on I1 only; right, by models trained on all trajectories but the one that they are tested
    on. Numbers are the RMSE of the signal, mean over the repeats; those in the titles are the mean over all
    faster signals. Outside its region of training the network extrapolates, inside the known physics.
    """
    experiments, signals = (table(data, name) for name in ("experiments", "signals"))
    errors, examples = (table(data, name) for name in ("errors", "examples"))
    experiments = experiments[experiments["campaign"] == "spring"].sort_values("speed")
    runs = {split: _hybrid(plain(examples, split)) for split in ("slow", "leave_one_out")}
    fast = experiments.loc[~experiments["slow"].astype(bool), "id"]
    shown = [name for name in fast if (runs["slow"]["id"] == name).any()][-FASTEST:]
    figure = new_figure(0.7 + 1.7 * max(2, len(shown)))
    parts = figure.subfigures(1, 2, squeeze=False, width_ratios=[0.85, 2.0])[0]
    _subdivision(parts[0].subplots(), experiments, signals[signals["campaign"] == "spring"])
    if not shown:
        absent(parts[1].subplots(), "no fast signal was predicted from the slow ones")
        return figure
    grid = parts[1].subplots(len(shown), 2, sharex=True, sharey="row", squeeze=False)
    titles = ("trained on slow trajectories $I_1$", "leave-one-out")
    for column, (split, title), colour in zip(
        grid.T, zip(runs, titles, strict=True), (WINE, GREEN), strict=True
    ):
        mine = _hybrid(plain(errors, split))
        mine = mine[mine["id"].isin(fast)]
        for axes, name in zip(column, shown, strict=True):
            _free_run(axes, runs[split][runs[split]["id"] == name], colour)
            _rmse_of(axes, mine[mine["id"] == name], colour)
        mean = accuracy(mine).mean if len(mine) else np.nan
        column[0].set_title(f"{title}\nmean RMSE {number(mean)} rad/s", color=colour)
        column[-1].set_xlabel("time t (s)")
    for axes, name in zip(grid[:, 0], shown, strict=True):
        axes.set_ylabel(f"{signal_name(name)}: speed ω (rad/s)")
    parts[1].legend(handles=[MEASURED], loc="outside lower center")
    return figure


def _hybrid(rows: pd.DataFrame) -> pd.DataFrame:
    return rows[rows["model"] == "nnap"]


def _rmse_of(axes: Axes, errors: pd.DataFrame, colour: str) -> None:
    if axes.axison and len(errors):
        text = f"{number(accuracy(errors).mean)} rad/s"
        axes.annotate(text, (0.02, 0.97), xycoords="axes fraction", va="top", color=colour)


def _subdivision(axes: Axes, experiments: pd.DataFrame, signals: pd.DataFrame) -> None:
    runs = dict(list(signals.groupby("id")))
    for slow, colour, label in ((False, GREY, "faster"), (True, ORANGE, "slow, $I_1$")):
        ids = experiments.loc[experiments["slow"].astype(bool) == slow, "id"]
        for name in ids:
            d, v = thin(*(runs[name][column].to_numpy() for column in ("d", "v")), points=250)
            axes.plot(MM * d, v, color=colour, linewidth=1.0)
        axes.plot([], [], color=colour, linewidth=2.0, label=f"{label} ({len(ids)})")
    axes.set(xlabel="slider's position d (mm)", ylabel="slider's speed v (m/s)", title="trajectories")
    axes.grid(linewidth=0.5)
    axes.figure.legend(loc="outside lower center", ncols=2)
