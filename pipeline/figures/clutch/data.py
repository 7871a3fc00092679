"""Draw the measurements of the clutch: current signals and shifting times, beside the deterministic model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pipeline.figures.clutch.points import PANEL, measured, measured_handles, places
from pipeline.figures.clutch.tables import INDIGO, MS, WINE, table
from unmodelled.report.figures.style import BLACK, new_figure, shades, styled

ARROW = {"arrowstyle": "<->", "color": BLACK, "shrinkA": 0, "shrinkB": 0, "linewidth": 1.2}
#: The annotated signal is shown until this many widths of its pulse.
WIDTHS = 8.0


@styled
def current_signals(data: Path) -> Figure:
    """Feedforward current of the valve: a pulse that fills the chamber, then a ramp that presses the plates.

    Left, the three control parameters: width u₁ of the pulse, level u₂ from which the ramp starts and
    its slope u₃. Right, all profiles; colour is u₁, the lines of one colour differ in u₂. A profile
    stays the same for every motor speed and brake torque.
    """
    signals = table(data, "currents")
    settings = table(data, "experiments").groupby("profile")[["u1", "u2", "u3"]].first()
    settings = settings[settings.index.isin(signals["profile"])]
    slopes = sorted(settings["u3"].unique())
    figure = new_figure(3.8)
    panels = figure.subplots(1, 1 + len(slopes), width_ratios=[1.35, *[1.0] * len(slopes)])
    panels = np.atleast_1d(panels)
    middle = settings.index[len(settings) // 2]
    _annotated(panels[0], signals[signals["profile"] == middle], settings.loc[middle])
    widths = sorted(settings["u1"].unique())
    colours = dict(zip(widths, shades(len(widths)), strict=True))
    for axes, slope in zip(panels[1:], slopes, strict=True):
        for profile, row in settings[settings["u3"] == slope].iterrows():
            mine = signals[signals["profile"] == profile]
            axes.plot(*_from_rest(mine), color=colours[row["u1"]], linewidth=1.1)
        count = int((settings["u3"] == slope).sum())
        axes.set_title(f"{count} profiles, $u_3$ = {slope:.3f} A/s")
        axes.set(ylim=(0.0, 1.08 * float(signals["u"].max())))
    for axes in panels:
        axes.set(xlabel="time t (s)")
        axes.grid(linewidth=0.5)
    panels[0].set_ylabel("current u (A)")
    handles = [
        Line2D([], [], color=colour, label=f"$u_1$ = {MS * u1:.0f} ms") for u1, colour in colours.items()
    ]
    panels[-1].legend(handles=handles, loc="lower right")
    return figure


def _from_rest(signal: pd.DataFrame) -> tuple[list[float], list[float]]:
    """Times and currents with a little of the rest before."""
    return [-0.05, 0.0, *signal["t"]], [0.0, 0.0, *signal["u"]]


def _annotated(axes: Axes, signal: pd.DataFrame, setting: pd.Series) -> None:
    u1, u2, u3 = setting[["u1", "u2", "u3"]]
    end, top = WIDTHS * u1, float(signal.loc[signal["t"] < u1, "u"].max())
    axes.plot(*_from_rest(signal), color=INDIGO, linewidth=2.2)
    axes.set(xlim=(-0.4 * u1, end), ylim=(0.0, 1.35 * max(top, u2 + u3 * (end - u1))))
    axes.annotate("", (0.0, 1.08 * top), (u1, 1.08 * top), arrowprops=ARROW)
    axes.text(u1 / 2.0, 1.1 * top, "$u_1$", ha="center", va="bottom", fontsize=13)
    foot = 1.7 * u1
    axes.plot([u1, 2.2 * u1], [u2, u2], color=BLACK, linewidth=0.8, linestyle=":")
    axes.annotate("", (foot, 0.0), (foot, u2), arrowprops=ARROW)
    axes.text(1.1 * foot, u2 / 2.0, "$u_2$", ha="left", va="center", fontsize=13)
    a, b = 3.4 * u1, 5.4 * u1
    low, high = (u2 + u3 * (t - u1) for t in (a, b))
    axes.plot([a, b, b], [low, low, high], color=BLACK, linewidth=1.2)
    axes.text(1.02 * b, (low + high) / 2.0, "slope $u_3$", ha="left", va="center", fontsize=13)
    axes.set_title("parameters of a profile")


@styled
def deterministic_times(data: Path) -> Figure:
    """Measured shifting times and those of the deterministic model, s, for all operating points.

    The model has one value for each of the two uncertain parameters, identified by least squares over all
    points. Bars join the measured and the simulated time of one point. The model follows the trend over
    profile, motor speed and brake torque, but misses single engagements, because the parameters differ from
    one engagement to the next.
    """
    experiments, points = table(data, "experiments"), table(data, "points")
    experiments = experiments[experiments["id"].isin(points["id"])]
    figure = new_figure(0.9 + PANEL * experiments["rpm"].nunique())
    where = places(figure, experiments)
    for row in points.itertuples(index=False):
        place = where[str(row.id)]
        place.axes.plot([place.x] * 2, [row.y, row.deterministic], color=WINE, linewidth=1.0, zorder=3)
        place.axes.plot(place.x, row.deterministic, "_", color=WINE, markersize=9, markeredgewidth=2.4)
    measured(where, points)
    gap = points["y"] - points["deterministic"]
    figure.suptitle(f"root mean square of the difference: {MS * float(np.sqrt((gap**2).mean())):.0f} ms")
    model = Line2D([], [], color=WINE, marker="_", markersize=9, markeredgewidth=2.4, linestyle="")
    model.set_label("deterministic model")
    figure.legend(handles=[*measured_handles(where), model], loc="outside lower center", ncols=3)
    return figure
