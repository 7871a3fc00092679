"""Draw the efficiency of a motor, by two physical parameters and by networks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from pipeline.arrays import Array, Bools
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
from unmodelled.report.figures.style import BLACK, ORANGE, PURPLE, SKY, new_figure, styled

PHYSICS = LOOKS["physics"].colour


@styled
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


@styled
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
    axes: Axes,
    name: str,
    curve: pd.DataFrame,
    networks: pd.DataFrame,
    truth: Array,
    where: Bools,
) -> None:
    """A title with the errors of both at the currents `where`."""
    predicted = networks.pivot(index="seed", columns="current", values="efficiency").to_numpy()
    network = np.median(np.sqrt(np.mean((predicted - truth)[:, where] ** 2, axis=1)))
    physics = np.sqrt(np.mean((curve["efficiency"].to_numpy() - truth)[where] ** 2))
    axes.set_title(f"where {name}: networks {network:.3f}, physics {physics:.3f}")
