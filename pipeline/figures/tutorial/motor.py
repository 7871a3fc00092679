"""Draw the efficiency of a motor, by two physical parameters and by networks of any number of neurons."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from pipeline.figures.palette import INDIGO, listed_x, plain_log
from pipeline.figures.tutorial.tables import (
    CURRENT,
    EFFICIENCY,
    LOOKS,
    REGION,
    SAMPLES,
    TRUTH,
    about,
    efficiencies,
    line,
    table,
)
from unmodelled.base.arrays import Array, Mask
from unmodelled.report.figures.style import BLACK, ORANGE, PURPLE, SKY, new_figure

PHYSICS = LOOKS["physics"].colour


def physical_parameters(data: Path) -> Figure:
    """Two physical parameters, identified from the measured efficiency of a DC motor at constant voltage.

    Left: shares of the electrical power in the model: heat of the winding, friction, and the remainder, which
    is the efficiency. Right: measured samples and the identified model. The real machine also has a fan,
    brushes and a warm winding, which the model omits; the model therefore misses details of the data, but
    keeps the trend at currents that were not measured.
    """
    facts, curve = about(data), table(data, "physics")
    figure = new_figure(4.2)
    left, right = figure.subplots(1, 2)
    emf = 1.0 - facts["resistance"] * curve["current"] / facts["voltage"]
    friction = facts["friction"] * facts["voltage"] * emf**2 / curve["current"]
    useful = curve["efficiency"].clip(lower=0.0)
    parts = {
        "useful: efficiency ζ": (useful, PHYSICS),
        f"winding, $R_a$ = {facts['resistance']:.2f} Ω": (1.0 - emf, SKY),
        f"friction, $B'$ = {1e3 * facts['friction']:.2f} mA/V": (friction, PURPLE),
    }
    shares, colours = zip(*parts.values(), strict=True)
    left.stackplot(curve["current"], *shares, colors=colours, labels=list(parts), alpha=0.85)
    left.set(xlabel=CURRENT, ylabel="share of the electrical power (-)", ylim=(0.0, 1.0))
    left.set_xlim(curve["current"].min(), curve["current"].max())
    left.xaxis.set_major_locator(MultipleLocator(5.0))
    efficiencies(right, data, whole=True)
    right.plot(curve["current"], curve["efficiency"], color=PHYSICS, linewidth=2.0)
    right.set_ylabel(EFFICIENCY)
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16))
    handles = [REGION, SAMPLES, line("identified model", PHYSICS), TRUTH]
    right.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)
    return figure


def network_beyond_the_data(data: Path) -> Figure:
    """Networks fitted to the same efficiency: accurate at measured currents, wrong at the others.

    Thin lines: networks that differ in their initial weights only; beyond the measured range they disagree.
    No data tell them that the heat of the winding grows with the square of the current, or that a motor needs
    some current to turn. Thick line: networks with a penalty on the weights. They agree with each other and
    are all wrong, so that agreement is no evidence of accuracy. Right: the measured range, in which the
    networks fit details that the two physical parameters cannot. Numbers: RMSE against the true efficiency.
    """
    facts, curve, networks = about(data), table(data, "physics"), table(data, "networks")
    networks = networks[networks["hidden"] == networks["hidden"].max()]
    priced, free = (networks[networks["penalty"] == price] for price in (facts["penalty"], 0.0))
    truth = table(data, "truth")["efficiency"].to_numpy()
    figure = new_figure(4.4)
    whole, zoom = figure.subplots(1, 2)
    for axes in (whole, zoom):
        efficiencies(axes, data, whole=axes is whole)
        for shown, width in ((free, 0.6), (priced, 1.8)):
            for _, one in shown.groupby("seed"):
                if axes is whole or shown is priced:
                    axes.plot(one["current"], one["efficiency"], color=ORANGE, linewidth=width)
        axes.plot(curve["current"], curve["efficiency"], color=PHYSICS, linewidth=2.0)
    inside = curve["current"].between(facts["lowest"], facts["highest"]).to_numpy()
    zoom.plot(curve["current"], truth, color=BLACK, linestyle=":", linewidth=1.4, zorder=3)
    zoom.set_xlim(facts["lowest"] - 0.3, facts["highest"] + 0.3)
    zoom.set_ylim(truth[inside].min() - 0.03, truth[inside].max() + 0.03)
    whole.set_ylabel(EFFICIENCY)
    for axes, where, name in ((whole, ~inside, "not measured"), (zoom, inside, "measured")):
        _errors(axes, name, curve, priced, truth, where)
    handles = [REGION, SAMPLES, line("networks", ORANGE), line("physics", PHYSICS), TRUTH]
    figure.legend(handles=handles, loc="outside lower center", ncols=5)
    return figure


def _errors(
    axes: Axes, name: str, curve: pd.DataFrame, networks: pd.DataFrame, truth: Array, where: Mask
) -> None:
    """A title with the errors of both at the currents `where`."""
    predicted = networks.pivot(index="seed", columns="current", values="efficiency").to_numpy()
    network = np.median(np.sqrt(np.mean((predicted - truth)[:, where] ** 2, axis=1)))
    physics = np.sqrt(np.mean((curve["efficiency"].to_numpy() - truth)[where] ** 2))
    axes.set_title(f"where {name}: networks {network:.3f}, physics {physics:.3f}")


def flexibility(data: Path) -> Figure:
    """Efficiency by networks with too few, too many and a suitable number of neurons, and their errors.

    Top left: one neuron underfits. Top right: the largest number of neurons fits the noise of every training
    sample and misses new samples (a part of them is drawn). Bottom left: the number of neurons with the
    smallest error on new samples. These networks have no penalty on their weights; of the trainings from
    different initial weights, the one with the median error is shown. Bottom right: RMSE over the number of
    neurons, median of the trainings. With the penalty of eq. 2.6 a large number of neurons does no harm, and
    a small one is too stiff, as few weights share the penalty.
    """
    curves, errors, facts = table(data, "networks"), table(data, "network_errors"), about(data)
    free = errors[errors["penalty"] == 0.0]
    medians = free.groupby("hidden")["new"].median()
    sizes = {"a: underfit": medians.index[0], "b: overfit": medians.index[-1]}
    sizes["c: balance"] = medians.idxmin()
    figure = new_figure(7.0)
    grid = figure.subplots(2, 2)
    for axes, (name, hidden) in zip(grid.ravel(), sizes.items(), strict=False):
        runs = free[free["hidden"] == hidden].sort_values("new")
        middle = runs.iloc[(len(runs) - 1) // 2]
        chosen = (
            (curves["penalty"] == 0.0) & (curves["hidden"] == hidden) & (curves["seed"] == middle["seed"])
        )
        _fit(axes, data, curves[chosen], facts)
        training, new = (f"{1e3 * middle[column]:.3g}" for column in ("training", "new"))
        count = f"{hidden} neuron{'s' if hidden > 1 else ''}"
        axes.set_title(f"{name}, {count}\nRMSE {training} ‰ in training, {new} ‰ on new samples")
    _sizes(grid[1, 1], errors, facts)
    return figure


def _fit(axes: Axes, data: Path, curve: pd.DataFrame, facts: dict[str, float]) -> None:
    new = table(data, "new")
    part = new.iloc[::4]
    axes.plot(part["current"], part["efficiency"], "+", color=PURPLE, markersize=4.5, label="new samples")
    efficiencies(axes, data, whole=False)
    axes.plot(curve["current"], curve["efficiency"], color=ORANGE, linewidth=2.0, label="network")
    axes.set_xlim(facts["lowest"] - 0.3, facts["highest"] + 0.3)
    low, high = new["efficiency"].min(), new["efficiency"].max()
    axes.set(ylim=(low - 0.02, high + 0.02), ylabel=EFFICIENCY)
    handles = [SAMPLES, *axes.get_legend_handles_labels()[0]]
    axes.legend(handles=handles, loc="lower left")


def _sizes(axes: Axes, errors: pd.DataFrame, facts: dict[str, float]) -> None:
    penalties = {0.0: ("no penalty", ORANGE, "s"), facts["penalty"]: ("penalty", INDIGO, "^")}
    for penalty, (label, colour, marker) in penalties.items():
        medians = errors[errors["penalty"] == penalty].groupby("hidden")[["training", "new"]].median()
        # a network that visits every sample has an error of about nothing, far below the axis
        for column, style in (("new", "-"), ("training", ":")):
            what = "new samples" if column == "new" else "training samples"
            look: dict[str, Any] = {"marker": marker, "color": colour, "linestyle": style}
            axes.plot(medians.index, medians[column], **look, label=f"{label}, {what}")
    axes.axhline(facts["noise"], color=BLACK, linewidth=0.9, linestyle="--", label="noise of a sample")
    axes.set_yscale("log")
    largest = float(errors.groupby(["penalty", "hidden"])["new"].median().max())
    axes.set_ylim(0.2 * facts["noise"], 1.3 * largest)
    plain_log(axes)
    listed_x(axes, np.unique(errors["hidden"]))
    axes.set(xlabel="hidden neurons $n_h$ (-)", ylabel="RMSE of the efficiency (-)")
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.18), ncols=2)
