"""Draw results: free runs of a simulation, a training, an identified distribution and the next experiment."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from unmodelled.base.wording import clock
from unmodelled.report.figures.style import (
    BLACK,
    BLUE,
    GREY,
    NEUTRAL,
    ORANGE,
    VERMILION,
    new_figure,
    styled,
    thin,
)
from unmodelled.report.figures.tables import LOOKS, printed

#: Letters of a name that fit beside a panel together with its unit.
LONG = 12
#: Curves of single models of a training that are drawn, at most.
CURVES = 30
#: Deviance at the 95 % limits of one parameter (chi-squared, one degree of freedom), and panels of a row.
LIMIT, ROW = 3.841, 4
#: Largest deviance that is drawn, in limits.
HIGHEST = 3.0


@styled
def measured_and_simulated(rows: pd.DataFrame, units: Mapping[str, tuple[str, str]], title: str) -> Figure:
    """Measured and simulated outputs of one experiment, a row of panels per output.

    Left, the outputs; a free run starts at the measured state and sees the inputs only, a new one every
    horizon. Right, the simulated minus the measured output.
    """
    size, time = clock(float(rows["t"].max()))
    rows = rows.assign(t=rows["t"] / size)
    figure = new_figure(0.9 + 1.9 * len(units))
    grid = figure.subplots(len(units), 2, sharex=True, squeeze=False)
    for (left, right), (name, (unit, of_errors)) in zip(grid, units.items(), strict=True):
        columns = [rows[c].to_numpy(np.float64) for c in ("t", f"{name}_measured", f"{name}_simulated")]
        t, measured, simulated = thin(*columns)
        left.plot(t, measured, color=LOOKS["measured"].colour, linewidth=3.0, label="measured")
        left.plot(t, simulated, color=LOOKS["known"].colour, linewidth=1.6, label="simulated")
        between = "\n" if len(name) > LONG else " "
        left.set_ylabel(f"{name}{between}({printed(unit)})")
        right.plot(t, simulated - measured, color=LOOKS["known"].colour, linewidth=1.0)
        right.set_ylabel(f"error of{between}{name}{between}({printed(of_errors)})")
        for axes in (left, right):
            axes.grid(linewidth=0.5)
    for axes in grid[-1]:
        axes.set_xlabel(f"t ({time})")
    grid[0, 0].set_title(title)
    grid[0, 1].set_title("simulated − measured")
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


@styled
def learned_law(samples: pd.DataFrame, axes: Mapping[str, str], unit: str) -> Figure:
    """Effort of a network and its formula over each coordinate of the port, and the difference of the two.

    Points are measured states of the training experiments.
    """
    figure = new_figure(3.6)
    panels = figure.subplots(1, len(axes) + 1, squeeze=False)[0]
    columns = [samples[c].to_numpy(np.float64) for c in (*axes, "effort", "formula")]
    *coordinates, effort, formula = thin(*columns)
    for panel, x, label in zip(panels, coordinates, axes.values(), strict=False):
        panel.plot(x, effort, ".", color=BLUE, markersize=3.5, markeredgewidth=0, label="network")
        panel.plot(x, formula, ".", color=ORANGE, markersize=2.0, markeredgewidth=0, label="formula")
        panel.set(xlabel=label, ylabel=f"effort ({printed(unit)})")
    panels[-1].plot(coordinates[0], effort - formula, ".", color=GREY, markersize=2.5, markeredgewidth=0)
    panels[-1].set(xlabel=next(iter(axes.values())), ylabel=f"network − formula ({printed(unit)})")
    for panel in panels:
        panel.grid(linewidth=0.5)
    handles = panels[0].get_legend_handles_labels()
    figure.legend(*handles, loc="outside upper center", ncols=2, markerscale=2.5)
    return figure


@styled
def losses(history: pd.DataFrame) -> Figure:
    """Loss of every model after each epoch, and their median."""
    figure = new_figure(2.8)
    axes = figure.subplots()
    groups = [part for _, part in history.groupby(["fold", "repeat"], sort=False)]
    for part in groups[:CURVES]:
        axes.plot(part["epoch"], part["loss"], color=GREY, linewidth=0.7)
    median = history.groupby("epoch")["loss"].median()
    axes.plot(median.index, median, color=BLUE, linewidth=1.8, label="median")
    if (history["loss"] > 0.0).all():
        axes.set_yscale("log")
    axes.set(xlabel="epoch", ylabel="loss")
    axes.grid(linewidth=0.5)
    axes.legend()
    return figure


@styled
def profile_likelihoods(profiles: pd.DataFrame, best: dict[str, float]) -> Figure:
    """Deviance of every distribution parameter, with all others at their best, and its 95 % limit."""
    names = list(dict.fromkeys(profiles["name"]))
    rows = -(-len(names) // ROW)
    figure = new_figure(0.5 + 2.6 * rows)
    grid = figure.subplots(rows, min(ROW, len(names)), squeeze=False, sharey=True).ravel()
    for axes, name in zip(grid, names, strict=False):
        own = profiles[profiles["name"] == name].sort_values("value")
        axes.plot(own["value"], own["deviance"], color=BLUE, marker=".", markersize=4)
        axes.axhline(LIMIT, color=VERMILION, linewidth=1.0, linestyle="--")
        axes.axvline(best[name], color=ORANGE, linewidth=1.2)
        axes.set(xlabel=name, ylim=(0.0, HIGHEST * LIMIT))
        axes.grid(linewidth=0.5)
    for axes in grid[len(names) :]:
        axes.set_visible(False)
    grid[0].set_ylabel("deviance")
    return figure


@styled
def observations(points: pd.DataFrame, unit: str) -> Figure:
    """Observed outputs beside the prediction of least squares, and how likely the distribution makes them."""
    figure = new_figure(3.2)
    left, right = figure.subplots(1, 2)
    order = np.argsort(points["deterministic"].to_numpy(np.float64), kind="stable")
    own = points.iloc[order]
    ends = [own["deterministic"].min(), own["deterministic"].max()]
    left.plot(ends, ends, color=GREY, linewidth=1.0)
    left.plot(own["deterministic"], own["y"], ".", color=BLUE, markersize=6)
    unit = f" ({printed(unit)})" if unit else ""
    left.set(xlabel=f"one value for all{unit}", ylabel=f"observed{unit}")
    right.plot(np.arange(1, len(own) + 1), own["log_likelihood_push_forward"], ".", color=BLUE, markersize=6)
    right.set(xlabel="observation", ylabel="log-likelihood")
    for axes in (left, right):
        axes.grid(linewidth=0.5)
    return figure


@styled
def next_experiment(
    rows: pd.DataFrame, limits: Mapping[tuple[str, str], tuple[float | None, float | None]]
) -> Figure:
    """Inputs of the next experiment, and predicted outputs of the named model and of every alternative.

    Args:
        rows: kind (input, output, and lowest and highest output of all draws), signal, unit, label of the
            model, t (s) and value, a row per sample.
        limits: lowest and highest allowed value by kind and signal; None where there is none.
    """
    size, time = clock(float(rows["t"].max()))
    rows = rows.assign(t=rows["t"] / size)
    seen = rows[rows["kind"].isin(["input", "output"])]
    signals = list(seen[["kind", "signal", "unit"]].drop_duplicates().itertuples(index=False, name=None))
    labels = [label for label in rows["label"].drop_duplicates() if label]
    looks = {label: (NEUTRAL[1:] + NEUTRAL[:1])[k % len(NEUTRAL)] for k, label in enumerate(labels)}
    figure = new_figure(1.2 + 0.3 * len(labels) + 1.7 * len(signals))
    panels = figure.subplots(len(signals), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (kind, signal, unit) in zip(panels, signals, strict=True):
        own = rows[(rows["kind"] == kind) & (rows["signal"] == signal)]
        for k, (label, part) in enumerate(own.groupby("label", sort=False)):
            t, value = thin(part["t"].to_numpy(np.float64), part["value"].to_numpy(np.float64))
            colour, line = looks.get(str(label), BLACK), "--" if k else "-"
            axes.plot(t, value, color=colour, linestyle=line, label=str(label) or None)
            beside = rows[(rows["signal"] == signal) & (rows["label"] == label)]
            ends = [beside[beside["kind"] == end] for end in ("lowest", "highest")]
            if kind == "output" and len(ends[0]):
                low, high = (end["value"].to_numpy(np.float64) for end in ends)
                axes.fill_between(
                    *thin(ends[0]["t"].to_numpy(np.float64), low, high), color=colour, alpha=0.15
                )
        for end in limits.get((kind, signal), ()):
            if end is not None:
                axes.axhline(end, color=VERMILION, linestyle=":", label="limit")
        axes.set_ylabel(f"{signal} ({printed(unit)})")
        axes.grid(linewidth=0.5)
    panels[-1].set_xlabel(f"t ({time})")
    handles = {
        label: h for axes in panels for h, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(handles.values(), handles.keys(), loc="outside upper center", ncols=1)
    return figure
