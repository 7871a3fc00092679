"""Draw jump runs: predictions over time, and one explained run with its inputs and contributions."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pipeline.figures.examples import experiments_of, read
from pipeline.figures.jumps.tables import (
    EXPLAINED,
    FEATURE_SETS,
    INPUTS,
    LOOKS,
    MEASURED,
    SCARCE,
    SIMULATED,
    UNIFORM,
    line_handle,
    models,
    of_fold,
    patch,
    run_title,
    table,
    with_angle,
)
from pipeline.figures.palette import nothing
from pipeline.figures.settings import MM
from unmodelled.base.arrays import Array
from unmodelled.report.figures.style import BLACK, GREY, new_figure

PERIOD = 0.01  # s, of the steps that are explained
ROOM = 1.4  # from one lane of inputs to the next, in heights of a signal


def shown_run(phi: pd.DataFrame) -> int | None:
    """Return the explained run of medium detachment."""
    exps = list(dict.fromkeys(phi["exp"]))
    return int(exps[len(exps) // 2]) if exps else None


def jump_with_inputs(data: Path) -> Figure:
    """A jump run outside the training data: displacement, predicted detachment, and inputs of the networks.

    Top left: the follower leaves the cam after each crest. Bottom left: median predictions of networks
    trained on 30 % of the runs. Right: the inputs of the networks, each scaled from its smallest to its
    largest value in this run; the two values stand beside it. F† falls below zero (dotted) where the follower
    jumps.
    """
    phi, examples = table(data, "phi"), of_fold(table(data, "examples"), UNIFORM, EXPLAINED)
    exp = shown_run(phi)
    rows = examples[examples["exp"] == exp]
    if rows.empty:
        return nothing("no jump run was explained")
    campaign = read(data, "features")
    place = int(np.flatnonzero(campaign.experiments["exp"].to_numpy() == exp)[0])
    log = _inputs(campaign[place], float(rows["t"].max()))
    figure = new_figure(6.0)
    grid = figure.add_gridspec(2, 2, width_ratios=[1.25, 1.0])
    upper, lower = (figure.add_subplot(grid[k, 0]) for k in (0, 1))
    upper.plot(log["t"], MM * (log["h"] + log["eps"]), color=BLACK, linewidth=2.0, label="follower y")
    upper.plot(log["t"], MM * log["h"], color=GREY, linestyle="--", label="cam h")
    upper.set(ylabel="displacement (mm)", xlabel="time (s)")
    upper.legend(loc="upper right", ncols=2, bbox_to_anchor=(1.0, 1.12))
    names = models(rows, FEATURE_SETS)
    draw_predictions(lower, rows, names)
    lower.set(ylabel="ε (mm)", xlabel="time (s)")
    used = set(phi["feature"])
    _lanes(figure.add_subplot(grid[:, 1]), log, [name for name in INPUTS if name in used and name in log])
    figure.suptitle(run_title(campaign.experiments, int(rows["exp"].iloc[0])), fontsize=10)
    handles = [MEASURED, *(line_handle(LOOKS[name]) for name in names)]
    figure.legend(handles=handles, loc="outside lower center", ncols=5)
    return figure


def _inputs(log: Mapping[str, Array], end: float) -> dict[str, Array]:
    """Signals of the explained part of a run, and the sine and cosine of its angle."""
    kept = log["t"] <= end + 1e-9
    cut = {name: values[kept] for name, values in log.items()}
    return {**cut, "sin(theta)": np.sin(cut["theta"]), "cos(theta)": np.cos(cut["theta"])}


def _lanes(axes: Axes, log: Mapping[str, Array], names: list[str]) -> None:
    """Signals one below the other, each over its own range."""
    for k, name in enumerate(names):
        low, high = float(log[name].min()), float(log[name].max())
        span, foot = max(high - low, 1e-12), -ROOM * k
        axes.plot(log["t"], foot + (log[name] - low) / span, color=INPUTS[name].colour, linewidth=1.6)
        if name == "F_dagger" and low < 0.0 < high:
            axes.axhline(foot - low / span, color=BLACK, linestyle=":", linewidth=1.2)
        for value, height in ((low, foot + 0.25), (high, foot + 0.75)):
            # a rounding error beside the range is zero
            text = f"{0.0 if abs(value) < 1e-4 * span else value:.3g}".replace("-", "−")
            axes.annotate(text, (1.01, height), xycoords=("axes fraction", "data"), va="center", fontsize=9)
    labels = [f"{INPUTS[name].label} ({INPUTS[name].unit})" for name in names]
    axes.set_yticks([0.5 - ROOM * k for k in range(len(names))], labels)
    axes.tick_params(axis="y", length=0)
    axes.set(xlabel="time (s)", ylim=(0.9 - ROOM * len(names), 1.2), ylabel="normalised inputs (-)")


def contributions_over_time(data: Path) -> Figure:
    """Contributions Φ (mm) of every input to the predicted detachment over time, for the jump run of Fig.
    5.21.

    DeepSHAP against contact runs. Areas above zero raise the prediction, areas below zero lower it; their sum
    is the line, the difference between the prediction and the mean of the contact runs. The contribution of
    an input includes its earlier values; sine and cosine of the angle are one input. Orange: signals of the
    encoder; indigo: force F†; green: shape of the cam; purple: motion along the cam; hatched: settings.
    """
    phi, explained = table(data, "phi"), table(data, "explained")
    exp = shown_run(phi)
    phi, explained = phi[phi["exp"] == exp], explained[explained["exp"] == exp]
    names = models(phi, FEATURE_SETS)
    if not names:
        return nothing("no jump run was explained")
    merged = with_angle(phi, ["model", "step"])
    used = [name for name in INPUTS if name in set(merged["feature"])]
    figure = new_figure(1.0 + 1.75 * len(names))
    panels = figure.subplots(len(names), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axes, name in zip(panels, names, strict=True):
        own = merged[merged["model"] == name].pivot(index="step", columns="feature", values="phi")
        _stack(axes, MM * own[[column for column in used if column in own]])
        line = explained[explained["model"] == name].sort_values("step")
        axes.plot(PERIOD * line["step"], MM * (line["output"] - line["base"]), color=BLACK, linewidth=1.8)
        axes.set_title(LOOKS[name].label, loc="left")
        axes.set_ylabel("Φ (mm)")
    panels[-1].set_xlabel("time (s)")
    handles = [
        Line2D([], [], color=BLACK, linewidth=1.8, label="sum"),
        # from top to bottom as they are stacked
        *map(patch, reversed(used)),
    ]
    figure.legend(handles=handles, loc="outside right center")
    return figure


def _stack(axes: Axes, phi: pd.DataFrame) -> None:
    """Areas of the positive contributions upwards and of the negative ones downwards."""
    t = PERIOD * phi.index.to_numpy(np.float64)
    colours, hatches = ([getattr(INPUTS[name], key) for name in phi] for key in ("colour", "hatch"))
    for part in (phi.clip(lower=0.0), phi.clip(upper=0.0)):
        stack = part.to_numpy(np.float64).T
        axes.stackplot(t, stack, colors=colours, hatch=hatches, edgecolor="white", linewidth=0.3)
    axes.axhline(0.0, color=BLACK, linewidth=0.8)


#: Title of a column -> its models.
COLUMNS = {"networks": FEATURE_SETS, "with a simulation of impacts": SIMULATED}


def predicted_detachment(data: Path) -> Figure:
    """Measured and predicted detachment (mm) over time, of runs outside the training data, one row per run.

    Jumps of small to large detachment, then contact; every row has its own scale. Trained on 5 % of the runs;
    thin lines are the median of the repeats. Left: networks with the settings m, H, β and the inputs in the
    legend: signals of the encoder (angle, speed, acceleration), the force F† that would keep contact, the
    shape of the cam, or speed and acceleration along the cam instead of the encoder's. Right: a simulation of
    impacts, and a network on top of it.
    """
    rows = of_fold(table(data, "examples"), UNIFORM, SCARCE)
    if rows.empty:
        return nothing("there is no run to show")
    columns = {title: models(rows, among) for title, among in COLUMNS.items()}
    columns = {title: names for title, names in columns.items() if names}
    exps, runs = list(dict.fromkeys(rows["exp"])), experiments_of(data, "features")
    figure = new_figure(1.0 + 1.75 * len(exps))
    grid = figure.subplots(len(exps), len(columns), sharex=True, sharey="row", squeeze=False)
    for line, exp in zip(grid, exps, strict=True):
        for axes, names in zip(line, columns.values(), strict=True):
            draw_predictions(axes, rows[rows["exp"] == exp], names)
        line[0].set(ylabel="ε (mm)")
        line[0].set_title(run_title(runs, exp), loc="left")
    for top, bottom, title in zip(grid[0], grid[-1], columns, strict=True):
        top.set_title(title, y=1.18, fontweight="bold")  # above that of the run
        bottom.set_xlabel("time (s)")
    figure.align_ylabels(grid[:, 0])
    handles = [MEASURED, *(line_handle(LOOKS[name]) for names in columns.values() for name in names)]
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def draw_predictions(axes: Axes, rows: pd.DataFrame, names: list[str]) -> None:
    """Draw the measured detachment of a run as a broad line, with the median predictions of models."""
    first = rows[rows["model"] == rows["model"].iloc[0]]
    axes.axhline(0.0, color="0.7", linewidth=0.8, zorder=0)
    axes.plot(first["t"], MM * first["measured"], color=BLACK, linewidth=2.6)
    for name in names:
        own, look = rows[rows["model"] == name], LOOKS[name]
        # a dashed line shows on a solid one that it coincides with, not below it
        order = 3 if look.line == "--" else 2
        axes.plot(own["t"], MM * own["predicted"], look.line, color=look.colour, lw=1.4, zorder=order)
