"""Draw the load on the slider that the network has learned without force measurements, and its formula."""

from pathlib import Path
from textwrap import fill

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pipeline.figures.palette import INDIGO
from pipeline.figures.settings import MM
from pipeline.figures.slider_crank.tables import CAMPAIGNS, DIRECTIONS, by_direction, number, table
from unmodelled.base.arrays import Array
from unmodelled.report.figures.style import BLACK, GREEN, GREY, ORANGE, absent, halo, new_figure, thin

POSITION, SPEED = "slider's position d (mm)", "slider's speed v (m/s)"
STAGES = {"initial": "a) before training", "converged": "b) after training"}
FORCES = "RdBu_r"


def network_surface(data: Path) -> Figure:
    """Force of one model's network over position and speed of the slider, before and after training.

    Dots are the states in the training data. Before training the weights, and with them the force, are
    random. After training the force can resemble the load of spring and friction where there are dots;
    elsewhere the network extrapolates.
    """
    surface, samples = table(data, "surface"), _samples(table(data, "force"), "spring", "nnap")
    stages = [stage for stage in STAGES if (surface["stage"] == stage).any()]
    norm = _norm(surface["F"].to_numpy())
    figure = new_figure(4.2, 10.0 if len(stages) > 1 else 6.0)
    panels = figure.subplots(1, len(stages), sharex=True, sharey=True, squeeze=False)[0]
    for axes, stage in zip(panels, stages, strict=True):
        field = surface[surface["stage"] == stage].pivot_table(index="v", columns="d", values="F")
        d, v = MM * field.columns.to_numpy(), field.index.to_numpy()
        axes.pcolormesh(d, v, field.to_numpy(), cmap=FORCES, norm=norm, shading="gouraud", rasterized=True)
        if field.to_numpy().min() < field.to_numpy().max():
            lines = axes.contour(d, v, field.to_numpy(), levels=8, colors="0.25", linewidths=0.7)
            for text in axes.clabel(lines, fmt="%g N", fontsize=8, colors="k"):
                text.set_path_effects(halo(2.5))
        points = thin(MM * samples["d"].to_numpy(), samples["v"].to_numpy())
        axes.plot(*points, ".", color=BLACK, markersize=1.6, alpha=0.6, rasterized=True)
        low, high = number(float(field.min(axis=None))), number(float(field.max(axis=None)))
        axes.set(
            title=f"{STAGES[stage]}: {low} to {high} N",
            xlabel=POSITION,
            xlim=(d[0], d[-1]),
            ylim=(v[0], v[-1]),
        )
    panels[0].set_ylabel(SPEED)
    _bar(figure, list(panels), norm, "force F of the network (N)")
    return figure


def learned_force(data: Path) -> Figure:
    """Force of the trained network on its training data, mean of the models of all folds.

    a) over position and speed of the slider; b) the same samples over the position, with the characteristic
    of the spring. Where the colours separate, the network adds a force that depends on the direction, as
    friction does. Grey: load of the virtual bench, for virtual data.
    """
    spring, samples = table(data, "spring"), _samples(table(data, "force"), "spring", "nnap")
    figure = new_figure(4.4)
    left, right = figure.subplots(1, 2)
    if not len(samples):
        for axes in (left, right):
            absent(axes, "no network was evaluated")
        return figure
    norm = _norm(samples["F"].to_numpy())
    _map(left, samples, "F", norm)
    left.set_title("a) on the states of the slider")
    _bar(figure, [left], norm, "force F of the network (N)")
    _side(right, MM * samples["d"].to_numpy(), samples["F"].to_numpy(), samples["F_true"].to_numpy(), samples)
    _spring(right, spring)
    right.set(title="b) side view", xlabel=POSITION, ylabel="force F (N)")
    truth = bool(samples["F_true"].notna().any())
    figure.legend(handles=_handles(truth), loc="outside lower center", ncols=5)
    return figure


def split_force(data: Path) -> Figure:
    """Forces of a conservative and of a dissipative network, on the training data with and without the
    spring.

    The load is the sum of F_c, a network of the position, and F_nc, a network of position and speed. The
    square of F_nc is penalised so that it does not learn the spring as well; mean of the models of all folds.
    F_c should follow the characteristic of the spring, and vanish without a spring; F_nc should be the same
    friction in both columns. Grey: load of the virtual bench without the spring, for virtual data.
    """
    spring, force = table(data, "spring").sort_values("d"), table(data, "force")
    found = {name: _samples(force, name, "nnap_split") for name in CAMPAIGNS}
    found = {name: samples for name, samples in found.items() if len(samples)}
    figure = new_figure(8.4 if found else 2.0, 10.0 if len(found) != 1 else 6.0)
    if not found:
        absent(figure.subplots(), "no model with two networks was evaluated")
        return figure
    grid = figure.subplots(3, len(found), sharex="row", sharey="row", squeeze=False)
    norm = _norm(np.concatenate([samples["F_nc"].to_numpy() for samples in found.values()]))
    for column, (campaign, samples) in zip(grid.T, found.items(), strict=True):
        column[0].set_title(CAMPAIGNS[campaign])
        _split_column(column, samples, spring if campaign == "spring" else spring.assign(F=0.0), norm)
    for axes, label in zip(
        grid[:, 0], ("conservative $F_c$ (N)", SPEED, "dissipative $F_{nc}$ (N)"), strict=True
    ):
        axes.set_ylabel(label)
    grid[1, -1].set_ylabel(SPEED if len(found) == 1 else "")
    _bar(figure, list(grid[1]), norm, "dissipative $F_{nc}$ (N)")
    truth = any(samples["F_true"].notna().any() for samples in found.values())
    conservative = Line2D([], [], color=GREEN, linewidth=4.0, label="network $F_c$")
    figure.legend(handles=[conservative, *_handles(truth)], loc="outside lower center", ncols=5)
    return figure


def _split_column(column: list[Axes], samples: pd.DataFrame, spring: pd.DataFrame, norm: Normalize) -> None:
    """F_c over d, F_nc on the states of the slider, and F_nc over v."""
    d, v, F_c, F_nc, F_true = (
        samples[name].to_numpy(np.float64) for name in ("d", "v", "F_c", "F_nc", "F_true")
    )
    order = np.argsort(d, kind="stable")
    _spring(column[0], spring)
    column[0].plot(*thin(MM * d[order], F_c[order], points=400), color=GREEN, linewidth=4.0)
    column[0].set_xlabel(POSITION)
    column[0].grid(linewidth=0.5)
    _map(column[1], samples, "F_nc", norm)
    _side(column[2], v, F_nc, F_true - np.interp(d, spring["d"], spring["F"]), samples)
    column[2].set_xlabel(SPEED)


def _samples(force: pd.DataFrame, campaign: str, model: str) -> pd.DataFrame:
    chosen = (force["campaign"] == campaign) & (force["model"] == model) & (force["stage"] == "converged")
    return force[chosen]


def _norm(values: Array) -> Normalize:
    """Zero is white; the same shade is the same size of force, whatever its sign."""
    limit = float(np.nanmax(np.abs(values), initial=1e-9))
    return Normalize(-limit, limit)


def _bar(figure: Figure, panels: list[Axes], norm: Normalize, label: str) -> None:
    figure.colorbar(ScalarMappable(norm, FORCES), ax=panels, label=label, aspect=30, pad=0.01)


def _map(axes: Axes, samples: pd.DataFrame, column: str, norm: Normalize) -> None:
    d, v, F = thin(*(samples[name].to_numpy(np.float64) for name in ("d", "v", column)), points=6000)
    axes.scatter(MM * d, v, c=F, s=7.0, cmap=FORCES, norm=norm, linewidths=0, rasterized=True)
    axes.set(xlabel=POSITION, ylabel=SPEED, facecolor="0.88")


def _side(axes: Axes, x: Array, F: Array, truth: Array, samples: pd.DataFrame) -> None:
    """Forces over one coordinate, coloured by the slider's direction, on those of the bench in grey."""
    x, F, truth, v = thin(x, F, truth, samples["v"].to_numpy(), points=4000)
    if np.isfinite(truth).any():
        axes.plot(x, truth, ".", color=GREY, markersize=2.0, alpha=0.6, rasterized=True)
    for _, colour, mask in by_direction(v):
        axes.plot(x[mask], F[mask], ".", color=colour, markersize=2.5, markeredgewidth=0, rasterized=True)
    axes.grid(linewidth=0.5)


def _spring(axes: Axes, spring: pd.DataFrame) -> None:
    axes.plot(
        MM * spring["d"],
        spring["F"],
        color=BLACK,
        linewidth=2.0,
        linestyle="--",
        path_effects=halo(3.6),
        zorder=3,
    )


def _handles(truth: bool) -> list[Line2D]:
    dots = [("network, " + name, colour) for name, colour in DIRECTIONS.items()]
    dots += [("load of the bench", GREY)] if truth else []
    marks = [Line2D([], [], color=c, marker="o", linestyle="", markersize=5, label=name) for name, c in dots]
    return [Line2D([], [], color=BLACK, linestyle="--", linewidth=2.0, label="spring $F_s$"), *marks]


def closed_form(data: Path) -> Figure:
    """Load on the slider by the network, and a short formula fitted to it.

    The formula stands above the panels, with d in m, v in m/s and F in N. It is fitted to the network,
    evaluated at the states of its training data; no measured force is used. Left: both over the position of
    the slider. Right: difference between network and formula.
    """
    points = table(data, "closed_form")
    columns = (points[name].to_numpy(np.float64) for name in ("d", "F", "F_formula"))
    d, F, formula = thin(*columns, points=4000)
    figure = new_figure(4.4)
    figure.suptitle(
        fill(f"F = {points['formula'].iloc[0].removeprefix('F = ')}", 110), fontsize=11, family="monospace"
    )
    left, right = figure.subplots(1, 2)
    _dots(left, MM * d, F, INDIGO, 4.5, "network")
    _dots(left, MM * d, formula, ORANGE, 2.5, "formula")
    _dots(right, MM * d, F - formula, INDIGO, 2.5, "")
    right.axhline(0.0, color=BLACK, linewidth=0.9)
    rms = float(np.sqrt(np.mean((F - formula) ** 2)))
    share = 1.0 - rms**2 / max(float(np.var(F)), 1e-12)
    right.set_title(f"rms {number(rms)} N, R² = {share:.3f}")
    left.set(xlabel="slider's position d (mm)", ylabel="force F (N)")
    right.set(xlabel="slider's position d (mm)", ylabel="network − formula (N)")
    left.legend(loc="best", markerscale=2)
    return figure


def _dots(axes: Axes, x: Array, y: Array, colour: str, size: float, label: str) -> None:
    axes.plot(x, y, ".", color=colour, markersize=size, markeredgewidth=0, rasterized=True, label=label)
    axes.grid(linewidth=0.5)
