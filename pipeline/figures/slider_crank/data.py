"""Draw the measurements of the slider-crank: spring, torques and trajectories."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure

from pipeline.figures.palette import INDIGO
from pipeline.figures.settings import MM
from pipeline.figures.slider_crank.tables import CAMPAIGNS, natural, table
from unmodelled.report.figures.style import GREY, new_figure, thin

TURN = 2.0 * np.pi
#: Viridis without its lightest end, which is lost on white.
SPEEDS = ListedColormap(mpl.colormaps["viridis_r"](np.linspace(0.12, 1.0, 256)), "speeds")


def spring_characteristic(data: Path) -> Figure:
    """Force of the compression spring (N) over the position d of the slider.

    The characteristic was measured separately, to judge the network; no model uses it.
    The grey bar holds the positions that the trajectories reach; d = 0 is where the slider is closest to the
    shaft.
    """
    spring, signals = table(data, "spring").sort_values("d"), table(data, "signals")
    figure = new_figure(3.6, 6.5)
    axes = figure.subplots()
    reached = MM * signals.loc[signals["campaign"] == "spring", "d"]
    if len(reached):
        floor = float(spring["F"].min() - 0.06 * np.ptp(spring["F"]))
        ends = [reached.min(), reached.max()]
        axes.plot(ends, [floor, floor], color=GREY, linewidth=5, label="reached by the trajectories")
    axes.plot(MM * spring["d"], spring["F"], "o-", color=INDIGO, markersize=3.5, label="spring $F_s$")
    axes.set(xlabel="position d (mm)", ylabel="spring force $F_s$ (N)")
    axes.grid(linewidth=0.5)
    axes.legend(loc="best")
    return figure


def torque_signals(data: Path) -> Figure:
    """Torques that drive the crank (N m), chosen by hand to excite it in different ways.

    Each profile is applied from two positions of the crank; two lines appear where the drive gave different
    torques. The same profiles are repeated without the spring.
    """
    experiments, signals = table(data, "experiments"), table(data, "signals")
    first = experiments["campaign"].iloc[0]
    experiments = experiments[experiments["campaign"] == first]
    profiles = sorted(experiments["profile"].unique())
    columns = min(5, len(profiles))
    rows = -(-len(profiles) // columns)
    figure = new_figure(0.5 + 1.6 * rows)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    runs = dict(list(signals[signals["campaign"] == first].groupby("id")))
    for axes, profile in zip(panels, profiles, strict=False):
        axes.axhline(0.0, color="0.8", linewidth=0.8, zorder=0)
        for name in sorted(experiments.loc[experiments["profile"] == profile, "id"], key=natural):
            axes.plot(runs[name]["t"], runs[name]["T"], color=INDIGO)
        axes.set_title(f"$T_{{{profile}}}$")
        axes.grid(linewidth=0.5)
        axes.tick_params(labelbottom=True)
    for axes in panels[len(profiles) :]:
        axes.set_axis_off()
    figure.supxlabel("time t (s)", fontsize=10)
    figure.supylabel("torque T (N m)", fontsize=10)
    return figure


def collected_data(data: Path) -> Figure:
    """Measured trajectories: angle and speed of the crank over time, and the states that the slider visits.

    Colour is the rms speed of the crank over the trajectory. The load depends on position d and speed v of
    the slider, so the right panel shows where a network can learn it. Near the ends of the stroke v is small
    whatever the crank does, so the corners stay empty.
    """
    experiments, signals = table(data, "experiments"), table(data, "signals")
    campaigns = [name for name in CAMPAIGNS if (signals["campaign"] == name).any()]
    figure = new_figure(0.6 + 2.7 * len(campaigns))
    grid = figure.subplots(len(campaigns), 3, sharex="col", sharey="col", squeeze=False)
    norm = Normalize(float(experiments["speed"].min()), float(experiments["speed"].max()))
    for row, campaign in zip(grid, campaigns, strict=True):
        runs = dict(list(signals[signals["campaign"] == campaign].groupby("id")))
        speeds = experiments[experiments["campaign"] == campaign].sort_values("speed", ascending=False)
        for name, speed in zip(speeds["id"], speeds["speed"], strict=True):
            _trajectory(row, runs[name], SPEEDS(norm(speed)))
        row[0].set_ylabel("angle θ (revolutions)")
        row[1].set(ylabel="speed ω (rad/s)", title=f"{CAMPAIGNS[campaign]}: {len(runs)} trajectories")
        row[2].set_ylabel("slider's speed v (m/s)")
    for axes, label in zip(grid[-1], ("time t (s)", "time t (s)", "slider's position d (mm)"), strict=True):
        axes.set_xlabel(label)
    for axes in grid.flat:
        axes.grid(linewidth=0.5)
    bar = figure.colorbar(ScalarMappable(norm, SPEEDS), ax=list(grid.flat), aspect=35, pad=0.01)
    bar.set_label("rms speed of the crank (rad/s)")
    return figure


def _trajectory(row: list[Axes], run: pd.DataFrame, colour: tuple[float, ...]) -> None:
    t, theta, omega, d, v = thin(
        *(run[name].to_numpy() for name in ("t", "theta", "omega", "d", "v")), points=250
    )
    pairs = ((t, theta / TURN), (t, omega), (MM * d, v))
    for axes, (x, y) in zip(row, pairs, strict=True):
        axes.plot(x, y, color=colour, linewidth=1.0)
        axes.plot(x[0], y[0], ".", color=GREY, markersize=3.0, zorder=1)
