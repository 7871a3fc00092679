"""Draw measured runs over time and over the angle, at the logged rate."""

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.cam_follower.labels import full_revolutions
from pipeline.figures.examples import FACTORS, centre, folded, nominal_and_bouncing, read, varied
from pipeline.figures.settings import LABELS, MM, angle_axis, level, setting
from unmodelled.base.arrays import Array
from unmodelled.report.figures.style import BLACK, GREY, NEUTRAL, absent, new_figure, shades, thin


def _centre_title(experiments: pd.DataFrame) -> str:
    return "settings that are not listed: " + setting(pd.Series(centre(experiments)))


def detachment_over_time(data: Path) -> Figure:
    """Speed and detachment over time when one setting of the machine is changed and the others stay.

    The dots mark the largest detachment of every full revolution; their mean decides whether a run counts as
    a jump. A higher voltage or a higher cam makes the follower bounce, a shorter fall (a larger rise beta)
    too, whereas weight keeps it on the cam. A run that takes much longer than the others is cut.
    """
    campaign = read(data, "trajectories", "t", "theta", "omega", "eps")
    figure = new_figure(8.4)
    panels = figure.subplots(len(FACTORS), 2, sharex="row", squeeze=False)
    for (speed, gap), factor in zip(panels, FACTORS, strict=True):
        rows = varied(campaign.experiments, factor)
        if not rows:
            absent(speed, "no run turns at these settings")
            absent(gap, "")
            continue
        for row, colour in zip(rows, shades(len(rows)), strict=True):
            _over_time(speed, gap, campaign[row], colour)
            gap.plot([], [], color=colour, label=level(factor, campaign.experiments[factor][row]))
        durations = campaign.experiments["duration"][rows]
        speed.set_xlim(0.0, min(durations.max(), 2.0 * durations.median()))
        speed.set(ylabel="ω (rad/s)", xlabel="time (s)")
        gap.set(ylabel="ε (mm)", xlabel="time (s)")
        gap.plot([], [], ".", color=BLACK, label="peaks")
        gap.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.suptitle(_centre_title(campaign.experiments), fontsize=10)
    return figure


def _over_time(speed: Axes, gap: Axes, log: dict[str, Array], colour: tuple[float, ...]) -> None:
    t, omega, eps = thin(log["t"], log["omega"], log["eps"], points=800)
    speed.plot(t, omega, color=colour)
    gap.plot(t, MM * eps, color=colour, linewidth=1.0)
    peaks = [turn.start + int(np.argmax(log["eps"][turn])) for turn in full_revolutions(log["theta"])]
    gap.plot(log["t"][peaks], MM * log["eps"][peaks], ".", color=BLACK, markersize=6, zorder=5)


def detachment_over_angle(data: Path) -> Figure:
    """Detachment over the angle of the cam, all full revolutions of the same runs folded onto one.

    The dotted lines mark the crest of the cam, where the fall begins. There the jumps start; the follower
    lands on the falling flank or, after a high jump, on the next rise. Distances below zero right after a
    landing are in the measurements.
    """
    campaign = read(data, "trajectories", "theta", "eps")
    figure = new_figure(6.2)
    panels = figure.subplots(2, 2, squeeze=False).ravel()
    for axes, factor in zip(panels, FACTORS, strict=True):
        rows = varied(campaign.experiments, factor)
        if not rows:
            absent(axes, "no run turns at these settings")
            continue
        for row, colour in zip(rows, shades(len(rows)), strict=True):
            log, run = campaign[row], campaign.experiments.loc[row]
            for turn in full_revolutions(log["theta"]):
                theta, eps = thin(folded(log["theta"][turn]), log["eps"][turn], points=400)
                axes.plot(theta, MM * eps, color=colour, linewidth=1.0)
            crest = colour if factor == "beta" else GREY
            axes.axvline(float(run["beta"]), color=crest, linestyle=":", linewidth=1.2, zorder=0)
            axes.plot([], [], color=colour, label=level(factor, float(run[factor])))
        angle_axis(axes)
        axes.set(xlabel="θ (rad)", ylabel="ε (mm)")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.suptitle(_centre_title(campaign.experiments), fontsize=10)
    return figure


def example_trajectories(data: Path) -> Figure:
    """Angle, speed and acceleration after a start from standstill, for four settings of the machine.

    The runs are spread over the durations found in the campaign. The speed never becomes constant: the cam
    loads the motor on every rise and drives it on every fall.
    """
    campaign = read(data, "trajectories", "t", "theta", "omega", "alpha")
    running = campaign.experiments[campaign.experiments["label"] != "stall"].sort_values(["duration", "exp"])
    figure = new_figure(6.6)
    panels = figure.subplots(3, 1, sharex=True)
    if running.empty:
        for axes in panels:
            absent(axes, "no run of this campaign turns")
        return figure
    places = np.unique(np.round(np.array([0.05, 0.35, 0.65, 0.95]) * (len(running) - 1)).astype(int))
    for row, colour in zip(running.index[places], NEUTRAL, strict=False):
        log = campaign[int(row)]
        t, *signals = thin(log["t"], log["theta"], log["omega"], log["alpha"], points=1200)
        for axes, signal in zip(panels, signals, strict=True):
            axes.plot(t, signal, color=colour, label=setting(running.loc[row]))
    for axes, name in zip(panels, ("θ (rad)", "ω (rad/s)", "dω/dt (rad/s²)"), strict=True):
        axes.set_ylabel(name)
    panels[-1].set_xlabel("time (s)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def nominal_and_bouncing_motion(data: Path) -> Figure:
    """Follower position and its distance from the cam for a nominal and for a bouncing run.

    Both runs use the same cam and mass wherever the campaign has such a pair; only the voltage differs. The
    bouncing follower leaves the cam after the crest and comes back to it on the way down or later.
    """
    campaign = read(data, "trajectories", "t", "y", "h", "eps")
    figure = new_figure(5.2)
    panels = figure.subplots(2, 2, sharex="col", sharey="row", height_ratios=[1.4, 1.0])
    for (upper, lower), row, kind in zip(
        panels.T, nominal_and_bouncing(campaign.experiments), ("contact", "jump"), strict=True
    ):
        if row is None:
            absent(upper, f"no run of this campaign has the label {kind}")
            absent(lower, "")
            continue
        log = campaign[row]
        t, y, h, eps = thin(log["t"], log["y"], log["h"], log["eps"])
        upper.plot(
            t, MM * h, color=BLACK, linestyle="--", linewidth=1.0, label="displacement h of the cam", zorder=3
        )
        upper.plot(t, MM * y, color=LABELS[kind], label=f"follower y, {kind}")
        lower.plot(t, MM * eps, color=LABELS[kind])
        upper.set_title(f"{kind}: {setting(campaign.experiments.loc[row])}")
        upper.set_ylabel("position (mm)")
        lower.set(xlabel="time (s)", ylabel="ε (mm)")
        for axes in (upper, lower):
            axes.tick_params(labelleft=True)  # the panel beside it may be empty
    handles = {h.get_label(): h for axes in panels[0] for h in axes.get_lines()}
    figure.legend(handles=list(handles.values()), loc="outside upper center", ncols=3)
    return figure
