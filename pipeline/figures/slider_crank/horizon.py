"""Draw accuracy and cost of training over a horizon of N steps."""

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pipeline.figures.palette import INDIGO, WINE, nothing, plain_log
from pipeline.figures.slider_crank.tables import (
    MEASURED,
    RMSE,
    Accuracy,
    accuracy,
    example,
    framed,
    horizons,
    signal_name,
    table,
)
from unmodelled.report.figures.style import BLACK, ORANGE, absent, new_figure, shades, thin

Colour = str | tuple[float, float, float, float]


def horizon_length(data: Path) -> Figure:
    """Influence of the horizon N of the training on the accuracy of free runs, and on the time it takes.

    Every model starts from the same trained feedforward model and is trained on for as many epochs; the
    reference line is the feedforward model after as many. Left, leave-one-out: the mean over the test signals
    and, as bars, the 90 % most accurate; runs that diverge are counted beside the point, not in its mean.
    Right, time per epoch, a dot for each fold, all on one machine; a straight line is a power law, its
    exponent is in the legend.
    """
    errors, timing = table(data, "errors"), table(data, "timing")
    figure = new_figure(4.2)
    left, right = figure.subplots(1, 2)
    study = horizons(errors)
    if len(study):
        _accuracy_over_horizon(left, study, errors[errors["model"] == "nnap_shooting"])
    else:
        absent(left, "no model was trained over a horizon")
    _time_over_horizon(right, timing)
    return figure


def _accuracy_over_horizon(axes: Axes, study: pd.DataFrame, shooting: pd.DataFrame) -> None:
    results = {int(N): accuracy(rows) for N, rows in study.groupby("horizon")}
    longer = {N: result for N, result in results.items() if N > 1}
    _bars(axes, longer, INDIGO, "o-", "recurrent, mean and 90 %")
    if len(shooting):
        points = {int(N): accuracy(rows) for N, rows in shooting.groupby("horizon")}
        _bars(axes, {1.12 * N: point for N, point in points.items()}, WINE, "D", "multiple shooting")
    if 1 in results:
        base = results[1]
        axes.axhspan(base.best, min(base.limit, 10.0 * base.mean), color=ORANGE, alpha=0.15, linewidth=0)
        axes.axhline(
            base.mean, color=ORANGE, linewidth=2.0, linestyle="--", label="feedforward, mean and 90 %"
        )
        _gain(axes, base, longer)
    axes.set(xscale="log", yscale="log", xlabel="horizon N of the training (samples)", ylabel=RMSE)
    axes.set_xticks(list(longer), [str(N) for N in longer])
    axes.minorticks_off()
    plain_log(axes)
    axes.figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)


def _bars(
    axes: Axes, results: dict[int, Accuracy] | dict[float, Accuracy], colour: str, line: str, label: str
) -> None:
    at, mean = list(results), [result.mean for result in results.values()]
    axes.plot(at, mean, line, color=colour, markersize=7, markeredgecolor="white", zorder=3, label=label)
    highest = 3.0 * np.nanmax([1e-9, *mean])
    for x, result in results.items():
        axes.plot([x, x], [result.best, min(result.limit, highest)], color=colour, linewidth=5, alpha=0.3)
        if result.diverged:
            axes.annotate(f"{result.diverged} diverged", (x, result.mean), (6, 6), textcoords="offset points")


def _gain(axes: Axes, base: Accuracy, longer: dict[int, Accuracy]) -> None:
    """The lowest mean, against the feedforward model's."""
    means = {N: result.mean for N, result in longer.items() if np.isfinite(result.mean)}
    if not means or not base.mean > 0.0:
        return
    N = min(means, key=lambda n: means[n])
    change = f"{100.0 * (means[N] / base.mean - 1.0):+.0f} %".replace("-", "−")
    axes.set_title(f"lowest mean: {change} at N = {N}, against feedforward")


def _time_over_horizon(axes: Axes, timing: pd.DataFrame) -> None:
    N, seconds = (timing[name].to_numpy(np.float64) for name in ("horizon", "seconds_per_epoch"))
    axes.plot(N, seconds, "o", color=INDIGO, alpha=0.4, markersize=5, markeredgewidth=0, label="a fold")
    longer = N > 1
    if len(np.unique(N[longer])) > 1:
        slope, offset = np.polyfit(np.log(N[longer]), np.log(seconds[longer]), 1)
        ends = np.array([N[longer].min(), N.max()])
        law = f"fit: seconds ∝ $N^{{{slope:.2f}}}$"
        axes.plot(ends, np.exp(offset) * ends**slope, color=ORANGE, linewidth=2.0, label=law)
    axes.set(
        xscale="log", yscale="log", xlabel="horizon N of the training (samples)", ylabel="time per epoch (s)"
    )
    known = [int(n) for n in np.unique(N)]
    axes.set_xticks(known, [str(n) for n in known])
    axes.minorticks_off()
    plain_log(axes)
    axes.legend(loc="upper left")


def multistep_prediction(data: Path) -> Figure:
    """Free run of a test signal by models trained over different horizons N, and how the error grows.

    Leave-one-out: none of the models has seen the signal; each gets the measured start and the torque only.
    a) speed of the crank, b) its error, c) rms of the error over all test signals on file, which says more
    than one signal. N = 1 is the feedforward model after as many additional epochs.
    """
    examples = horizons(table(data, "examples"))
    if not len(examples):
        return nothing("no model was trained over a horizon", 6.2)
    figure = new_figure(6.2)
    chosen = example(examples["id"])
    steps = sorted(int(N) for N in examples["horizon"].unique())
    light = shades(len(steps))[::-1]
    colours = {N: ORANGE if N == 1 else colour for N, colour in zip(steps, light, strict=True)}
    top, (left, right) = _panels(figure)
    for N in steps:
        mine = examples[examples["horizon"] == N]
        run = mine[mine["id"] == chosen].sort_values("t")
        t, error = run["t"], run["omega"] - run["omega_measured"]
        top.plot(*thin(t.to_numpy(), run["omega"].to_numpy(), points=400), color=colours[N])
        left.plot(*thin(t.to_numpy(), error.to_numpy(), points=400), color=colours[N])
        _rms_over_time(right, mine, colours[N])
    measured = examples[(examples["id"] == chosen) & (examples["horizon"] == steps[0])].sort_values("t")
    top.plot(measured["t"], measured["omega_measured"], color=BLACK, linewidth=2.4, zorder=1)
    framed(top, measured["omega_measured"].to_numpy(), 0.12)
    _centred(left, 0.5 * float(np.ptp(measured["omega_measured"])))
    left.axhline(0.0, color=BLACK, linewidth=0.8)
    top.set(ylabel="speed ω (rad/s)", title=f"a) test signal {signal_name(chosen)}")
    left.set(ylabel="error of ω (rad/s)", title=f"b) error on {signal_name(chosen)}")
    count = examples["id"].nunique()
    right.set(ylabel="rms error of ω (rad/s)", title=f"c) over {count} test signals", ylim=(0.0, None))
    lines = [Line2D([], [], color=colours[N], linewidth=2.0, label=f"N = {N}") for N in steps]
    figure.legend(handles=[MEASURED, *lines], loc="outside lower center", ncols=7)
    return figure


def _panels(figure: Figure) -> tuple[Axes, tuple[Axes, Axes]]:
    grid = figure.add_gridspec(2, 2, height_ratios=[1.25, 1.0])
    top = figure.add_subplot(grid[0, :])
    left, right = figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1])
    for axes in (top, left, right):
        axes.set_xlabel("time t (s)")
        axes.grid(linewidth=0.5)
    return top, (left, right)


def _centred(axes: Axes, most: float) -> None:
    """Zero in the middle; errors beyond `most` leave the axes."""
    limit = min(max(-axes.dataLim.y0, axes.dataLim.y1), most)
    axes.set_ylim(-1.05 * limit, 1.05 * limit)


def _rms_over_time(axes: Axes, runs: pd.DataFrame, colour: Colour) -> None:
    """Signals start together, so that their samples align in time."""
    square = ((runs["omega"] - runs["omega_measured"]) ** 2).groupby(runs["t"].round(6)).mean()
    rms = np.sqrt(square.to_numpy(np.float64))
    axes.plot(*thin(square.index.to_numpy(np.float64), rms, points=400), color=colour)
