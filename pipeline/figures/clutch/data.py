"""Draw measurements of the clutch beside simulations: currents, shifting times, one engagement."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pipeline.figures.clutch.points import PANEL, measured, measured_handles, places
from pipeline.figures.clutch.tables import MS, about, table
from pipeline.figures.palette import INDIGO, WINE, nothing
from pipeline.figures.settings import MM
from unmodelled.report.figures.style import (
    BLACK,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    new_figure,
    shades,
    thin,
)

ARROW = {"arrowstyle": "<->", "color": BLACK, "shrinkA": 0, "shrinkB": 0, "linewidth": 1.2}
#: The annotated signal is shown until this many widths of its pulse.
WIDTHS = 8.0


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


BAR = 1e-5  # bar per Pa
#: Measured signals: broad and light, under the thin lines of the simulation.
MEASURED: dict[str, Any] = {"color": "0.72", "linewidth": 4.0}


def filling(data: Path) -> Figure:
    """Pressure in the chamber, piston and pressure on the plates during an engagement.

    Left, over time: the pressure rises with the current, the piston follows and is stopped at z_M; the
    plates take pressure once it passes z_p. Right, the share δ_t of the torque that friction transmits
    instead of the oil film, over the position of the piston.
    """
    run = table(data, "engagement")
    end = _until(run)
    run = run[run["t"] <= end]
    figure = new_figure(5.2)
    left, right = figure.subfigures(1, 2, squeeze=False, width_ratios=[1.9, 1.0])[0]
    upper, lower = left.subplots(2, 1, sharex=True, height_ratios=[1.3, 1.0])
    _lines(upper, run["t"], {"p_plates": (ORANGE, "-")}, run, BAR)
    upper.plot(*thin(run["t"].to_numpy(), BAR * run["measured_p"].to_numpy()), **MEASURED, zorder=1)
    _lines(upper, run["t"], {"p": (INDIGO, "-")}, run, BAR)
    upper.set(ylabel="pressure (bar)", ylim=(0.0, 1.45 * BAR * float(run["p"].max())))
    legend = [
        Line2D([], [], **MEASURED, label="chamber $p_{hc}$, measured"),
        Line2D([], [], color=INDIGO, label="chamber $p_{hc}$, simulated"),
        Line2D([], [], color=ORANGE, label="on the plates, simulated"),
    ]
    upper.legend(handles=legend, loc="upper left")
    contact, stop = _thresholds(run)
    lower.plot(run["t"], MM * run["z"], color=GREEN, linewidth=1.8)
    for value, name in ((contact, "z_p"), (stop, "z_M")):
        lower.axhline(MM * value, color=BLACK, linestyle=":", linewidth=1.2)
        lower.annotate(f"${name}$", (0.02, MM * value), (0, 2), textcoords="offset points", va="bottom")
    lower.set(xlabel="time t (s)", ylabel="piston z (mm)", xlim=(0.0, end), ylim=(0.0, 1.2 * MM * stop))
    _transition(right.subplots(), run, contact)
    for axes in (upper, lower):
        axes.grid(linewidth=0.5)
    return figure


def _until(run: pd.DataFrame) -> float:
    """A little after both shafts turn together, s."""
    joined = run.loc[run["synchronous"], "t"]
    return float(min(1.6 * joined.min(), run["t"].max())) if len(joined) else float(run["t"].max())


def _thresholds(run: pd.DataFrame) -> tuple[float, float]:
    """Positions where half of the torque is friction, which is z_p, and where the piston ends, m."""
    path = run.sort_values("z")
    return float(np.interp(0.5, path["delta_t"], path["z"])), float(run["z"].max())


def _lines(
    axes: Axes, t: pd.Series, looks: dict[str, tuple[str, str]], run: pd.DataFrame, unit: float = 1.0
) -> None:
    for name, (colour, line) in looks.items():
        axes.plot(t, unit * run[name], color=colour, linestyle=line, linewidth=1.8)


def _transition(axes: Axes, run: pd.DataFrame, contact: float) -> None:
    path = run[~run["synchronous"]].sort_values("z")
    axes.plot(MM * path["z"], path["delta_t"], color=GREEN, linewidth=2.2)
    axes.axvline(MM * contact, color=BLACK, linestyle=":", linewidth=1.2)
    axes.annotate("$z_p$", (MM * contact, 1.02), (4, 0), textcoords="offset points", va="bottom")
    axes.set(xlabel="piston z (mm)", ylabel=r"share of friction $\delta_t$ (-)", ylim=(-0.02, 1.12))
    axes.grid(linewidth=0.5)


def torques_and_speeds(data: Path) -> Figure:
    """Torques and speeds of an engagement, measured and simulated with the nominal parameters.

    Left: torque T₁ of the converter on the input shaft, T₂ of the clutch on the output shaft and T_b
    of the brake. Right: speeds of both shafts, the output shaft's times the gear ratio R. The asynchronous
    phase ends where they meet, the shifting time; from then on (grey) the torque of the converter passes
    as it is. The simulation shifts at another time than the bench did.
    """
    run = table(data, "engagement")
    joined = run[run["synchronous"]]
    if joined.empty:
        return nothing("the simulated shafts never turn together")
    ratio, simulated = float((joined["omega_1"] / joined["omega_2"]).median()), float(joined["t"].min())
    points, name = table(data, "points"), str(about(data).get("shown", ""))
    observed = float(points.loc[points["id"] == name, "y"].max())
    figure = new_figure(4.4)
    left, right = figure.subplots(1, 2, width_ratios=[1.0, 1.15])
    torques = {"T_1": (INDIGO, "-"), "T_2": (ORANGE, "-"), "T_b": (PURPLE, "-")}
    _lines(left, run["t"], torques, run.assign(T_2=ratio * run["T_c"]))
    labels = ("$T_1$ converter", "$T_2$ clutch, output side", "$T_b$ brake")
    handles = [
        Line2D([], [], color=c, linewidth=1.8, label=label)
        for (c, _), label in zip(torques.values(), labels, strict=True)
    ]
    left.legend(handles=handles, loc="upper right")
    left.set(xlabel="time t (s)", ylabel="torque (N m)")
    _speeds(right, run, ratio)
    for axes in (left, right):
        axes.set_xlim(0.0, min(2.2 * np.nanmax([simulated, observed]), float(run["t"].max())))
        axes.grid(linewidth=0.5)
        axes.axvspan(simulated, float(run["t"].max()), color=GREY, alpha=0.15, linewidth=0)
    for time, colour, label in ((observed, BLACK, "measured"), (simulated, WINE, "simulated")):
        if np.isfinite(time):
            right.axvline(
                time, color=colour, linestyle="--", linewidth=1.4, label=f"shift, {label}: {time:.3f} s"
            )
    right.legend(loc="lower right")
    figure.suptitle(f"engagement {name}")
    return figure


def _speeds(axes: Axes, run: pd.DataFrame, ratio: float) -> None:
    measured = (("1", 1.0, INDIGO, r"$\omega_1$"), ("2", ratio, GREEN, rf"$R\,\omega_2$, R = {ratio:.2f}"))
    for shaft, factor, _, _ in measured:
        t, omega = thin(run["t"].to_numpy(), factor * run[f"measured_omega_{shaft}"].to_numpy())
        axes.plot(t, omega, **MEASURED, label="measured" if shaft == "1" else None)
    for shaft, factor, colour, label in measured:
        axes.plot(run["t"], factor * run[f"omega_{shaft}"], color=colour, linewidth=1.8, label=label)
    axes.set(xlabel="time t (s)", ylabel="speed (rad/s)")
