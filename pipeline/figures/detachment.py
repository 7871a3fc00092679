"""Draw the interface force F† for permanent contact, beside the measured motion of the follower."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.labels import full_revolutions
from pipeline.chapters.boundary import SETTING, first_crossing, measured
from pipeline.figures.examples import experiments_of, levels, median_row, nominal_and_bouncing, read
from pipeline.figures.palette import nothing
from pipeline.figures.panels import boundary_line, cells, finish_map, map_grid
from pipeline.figures.settings import LABELS, MM, setting
from unmodelled.base.arrays import Array
from unmodelled.report.figures.style import BLACK, absent, new_figure, signed

FORCE = "$F^†$ (N)"


def force_examples(data: Path) -> Figure:
    """Force F† that would keep contact, and detachment, of a contact run and of a jump run.

    Both runs are the median of their label by the mean of the minima per revolution (dashed). While F† is
    positive the follower stays on the cam. Where it is negative the cam would have to pull, and the follower
    leaves at that moment.
    """
    campaign = read(data, "features", "t", "theta", "eps", "F_dagger")
    table = campaign.experiments
    figure = new_figure(5.4)
    panels = figure.subplots(2, 2, sharex="col", sharey="row")
    for (upper, lower), kind in zip(panels.T, ("contact", "jump"), strict=True):
        row = median_row(table[table["label"] == kind], "f_bar_min")
        if row is None:
            absent(upper, f"no run of this campaign has the label {kind}")
            absent(lower, "")
            continue
        log = campaign[row]
        _force(upper, log, LABELS[kind])
        turns = full_revolutions(log["theta"])
        lowest = [turn.start + int(np.argmin(log["F_dagger"][turn])) for turn in turns]
        upper.plot(log["t"][lowest], log["F_dagger"][lowest], "o", color=BLACK, markersize=4)
        mean = float(table["f_bar_min"][row])
        upper.axhline(mean, color=BLACK, linestyle="--", linewidth=1.0)
        upper.set_title(f"{kind}: {setting(table.loc[row])}\nmean of the minima {signed(mean)} N")
        lower.plot(log["t"], MM * log["eps"], color=LABELS[kind])
        lower.set(xlabel="time (s)", ylabel="ε (mm)")
        lower.tick_params(labelleft=True)
    return figure


def _force(axes: Axes, log: dict[str, Array], colour: str) -> None:
    axes.plot(log["t"], log["F_dagger"], color=colour)
    axes.fill_between(
        log["t"], log["F_dagger"], 0.0, where=log["F_dagger"] < 0.0, color=colour, alpha=0.25, linewidth=0
    )
    axes.axhline(0.0, color="0.5", linewidth=0.8, zorder=0)
    axes.set_ylabel(FORCE)
    axes.tick_params(labelleft=True)  # the panel beside it may be empty


def minimal_force_of_two_runs(data: Path) -> Figure:
    """The force F† of a nominal and of a bouncing run, with the smallest value of each.

    A smallest value above zero stands for a nominal run; below zero the minimal contact force is set to zero
    and the run counts as bouncing, without any measurement of the follower.
    """
    campaign = read(data, "features", "t", "F_dagger")
    figure = new_figure(3.4)
    panels = figure.subplots(1, 2, sharey=True)
    for axes, row, kind in zip(
        panels, nominal_and_bouncing(campaign.experiments), ("contact", "jump"), strict=True
    ):
        if row is None:
            absent(axes, f"no run of this campaign has the label {kind}")
            continue
        log, run = campaign[row], campaign.experiments.loc[row]
        _force(axes, log, LABELS[kind])
        k = int(np.argmin(log["F_dagger"]))
        axes.plot(log["t"][k], log["F_dagger"][k], "o", color=BLACK, markersize=5)
        lowest = float(run["f_min"])
        text = (
            f"{kind}: {setting(run)}\n"
            rf"$F^†_{{min}}$ = {signed(lowest)} N, so $F_{{min}}$ = {signed(max(lowest, 0.0))} N"
        )
        axes.set(title=text, xlabel="time (s)")
    return figure


def mean_minimal_force_map(data: Path) -> Figure:
    """Mean over the revolutions of the smallest F† at every voltage and mass, in a panel for every cam.

    The line joins the voltages where the mean is zero: to its right the force that would keep contact is
    negative (red) and the follower should jump. Values below the range of the colours share one red.
    """
    table = experiments_of(data, "features")
    figure, panels = map_grid(table)
    force = table["f_bar_min"].to_numpy(np.float64)
    limit = float(np.max(force, initial=1.0, where=np.isfinite(force)))
    mesh = cells(panels, table, force, mpl.colormaps["RdBu"], Normalize(-limit, limit))
    line = boundary_line(panels, _zero(table), levels(table, "m"), "mean smallest F† = 0")
    finish_map(figure, panels, mesh, line, "mean smallest $F^†$ of the revolutions (N)", extend="min")
    return figure


def _zero(table: pd.DataFrame) -> pd.DataFrame:
    """Voltage Q, for every cam and mass, where the mean minimal force falls through zero."""
    running = table.dropna(subset="f_bar_min").sort_values("V")
    rows = [
        (*key, first_crossing(group["V"].to_numpy(), -group["f_bar_min"].to_numpy(), 0.0))
        for key, group in running.groupby(SETTING)
    ]
    return pd.DataFrame(rows, columns=[*SETTING, "Q"]).dropna()


def force_against_detachment(data: Path) -> Figure:
    """Mean smallest force F† against mean largest detachment for all runs that turn.

    F† alone should sort the runs: positive for contact, negative for jumps. Rings mark the runs where its
    sign contradicts the label; they lie close to the boundary. Both axes are stretched towards zero.
    """
    table = experiments_of(data, "features")
    table = table[table["label"] != "stall"].dropna(subset="f_bar_min")
    wrong = (table["label"] == "jump") != (table["f_bar_min"] < 0.0)
    if table.empty:
        return nothing("no run of this campaign turns", 4.6, 8.0)
    figure = new_figure(4.6, 8.0)
    axes = figure.subplots()
    for kind in ("contact", "jump"):
        of_kind = table["label"] == kind
        _scatter(axes, table[of_kind & ~wrong], LABELS[kind], f"{kind}, sign agrees", ring=False)
        _scatter(axes, table[of_kind & wrong], LABELS[kind], f"{kind}, sign contradicts", ring=True)
    axes.axhline(0.0, color="0.4", linewidth=1.0)
    axes.set_xscale("log")
    axes.set_yscale("symlog", linthresh=10.0, subs=[3.0])
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}".replace("-", "−")))
    axes.set(
        xlabel="mean largest ε of the revolutions (mm)",
        ylabel="mean smallest $F^†$ of the revolutions (N)",
        title=f"{(~wrong).sum()} of {len(table)} runs on the right side of zero, {(~wrong).mean():.1%}",
    )
    axes.legend(loc="lower left")
    return figure


def _scatter(axes: Axes, runs: pd.DataFrame, colour: str, name: str, ring: bool) -> None:
    axes.scatter(
        np.maximum(MM * runs["eps_share"] * runs["H"], 1e-3),  # a logarithmic axis has no zero
        runs["f_bar_min"],
        s=34 if ring else 12,
        facecolor=colour,
        edgecolor=BLACK if ring else "none",
        alpha=1.0 if ring else 0.5,
        zorder=3 if ring else 2,
        rasterized=not ring,
        label=f"{name} ({len(runs)})",
    )


def minimal_force_map(data: Path) -> Figure:
    """Minimal contact force of every run, and the measured boundary Q of the jumps, in a panel for every cam.

    The force, equation 6.12, comes from the motor side only, the line from measurements of the follower. The
    force reaches zero (light orange) where the line runs: it can stand in for the measurement of jumps.
    """
    table = experiments_of(data, "features")
    figure, panels = map_grid(table)
    force = np.maximum(table["f_min"].to_numpy(np.float64), 0.0)
    force[(table["label"] == "stall").to_numpy()] = np.nan
    colours = mpl.colormaps["viridis"].with_extremes(under="#F6C9A8")
    limit = float(np.max(force, initial=1.0, where=np.isfinite(force)))
    mesh = cells(panels, table, force, colours, Normalize(1e-9, limit))
    boundary = measured(table, CamFollower().jump_share)
    line = boundary_line(panels, boundary, levels(table, "m"), "measured boundary Q")
    finish_map(figure, panels, mesh, line, "minimal contact force $F_{min}$ (N)", extend="min")
    return figure
