"""Draw the geometry of the cams of a campaign, and the measured follower beside it."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from pipeline.cam_follower.cam import TURN, Cam, cycloid
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.labels import full_revolutions
from pipeline.figures.examples import experiments_of, folded, levels, median_row, read
from pipeline.figures.panels import cam_grid
from pipeline.figures.settings import MM, angle_axis, level, setting
from unmodelled.base.arrays import Array
from unmodelled.report.figures.style import (
    BLACK,
    GREEN,
    GREY,
    PURPLE,
    SKY,
    VERMILION,
    absent,
    new_figure,
    shades,
    thin,
)


def _around(radius: Array, phi: Array) -> tuple[Array, Array]:
    """Points of a closed curve with polar `radius` (m), mm, with phi = 0 upwards, eq. 5.23."""
    return MM * radius * np.sin(phi), MM * radius * np.cos(phi)


def cam_shapes(data: Path) -> Figure:
    """The cams of the campaign, each fixed by its stroke H and the angle beta of its rise.

    All are drawn to the same scale at the angle zero; the dotted circle is the base circle, which they share.
    A higher stroke makes the flanks steeper, an angle far from pi makes one of them hollow. Where the word
    "undercut" stands, the roller is too large to follow the hollow.
    """
    experiments, bench = experiments_of(data, "trajectories"), CamFollower()
    figure, panels = cam_grid(experiments, panel_height=1.4)
    phi = np.linspace(0.0, TURN, 361)
    for (H, beta), axes in panels.items():
        cam = bench.cam(H, beta)
        x, y = _around(cam.base_radius + cycloid(phi, H, beta)[0], phi)
        axes.fill(x, y, facecolor="#dbe9f4", edgecolor=BLACK, linewidth=1.2)
        axes.add_patch(Circle((0, 0), MM * cam.base_radius, fill=False, linestyle=":", edgecolor="0.35"))
        axes.plot(0, 0, "+", color="0.35", markersize=5)
        axes.set_aspect("equal")
        if cam.undercut:
            axes.text(0.02, 0.03, "undercut", fontsize=9, color=VERMILION, transform=axes.transAxes)
    figure.supxlabel("x (mm)", fontsize=10)
    figure.supylabel("y (mm)", fontsize=10)
    return figure


def displacement_functions(data: Path) -> Figure:
    """Theoretical displacement of a knife-edge follower over one revolution of each cam, equation 5.1.

    The follower rises to the stroke H at the angle beta (dotted) and falls back in the rest of the turn,
    without dwell. The shorter of the two phases is the one with the larger accelerations.
    """
    experiments = experiments_of(data, "trajectories")
    strokes, rises = levels(experiments, "H"), levels(experiments, "beta")
    figure = new_figure(3.0)
    panels = figure.subplots(1, len(rises), sharey=True, squeeze=False)[0]
    theta = np.linspace(0.0, TURN, 361)
    for axes, beta in zip(panels, rises, strict=True):
        axes.axvline(beta, color=GREY, linestyle=":", linewidth=1.0)
        for H, colour in zip(strokes, shades(len(strokes)), strict=True):
            axes.plot(theta, MM * cycloid(theta, H, beta)[0], color=colour, label=level("H", H))
        angle_axis(axes)
        axes.set(title=level("beta", beta), xlabel="θ (rad)")
    panels[0].set_ylabel("displacement $h_c$ (mm)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=len(strokes))
    return figure


def pitch_curve(data: Path) -> Figure:
    """The pitch curve is the path of the roller's centre around the cam, shown for the most extreme cam.

    The cam has the largest stroke and the longest rise of the campaign and stands at the angle zero, where
    the roller rests on the base circle. On a steep flank the roller touches the cam ahead of or behind the
    line of motion, so that the pitch curve is not just the perimeter moved outwards along the radius.
    """
    experiments = experiments_of(data, "trajectories")
    H, beta = float(levels(experiments, "H")[-1]), float(levels(experiments, "beta")[-1])
    cam = CamFollower().cam(H, beta)
    phi = np.linspace(0.0, TURN, 721)
    h_p = cam.pitch_curve(720)[0]
    radius = cam.prime_radius + np.append(h_p, h_p[0])
    figure = new_figure(5.2, 7.6)
    axes = figure.subplots()
    axes.fill(*_around(cam.base_radius + cycloid(phi, H, beta)[0], phi), facecolor="#dbe9f4")
    axes.plot(*_around(cam.base_radius + cycloid(phi, H, beta)[0], phi), color=BLACK, label="cam perimeter")
    axes.plot(*_around(radius, phi), color=GREEN, linestyle="--", label="pitch curve")
    for r, name in ((cam.base_radius, "base circle $r_b$"), (cam.prime_radius, "prime circle $r_p$")):
        x, y = _around(np.full(721, r), phi)
        line = ":" if r == cam.base_radius else "-."
        axes.plot(x, y, color="0.45", linestyle=line, linewidth=1.0, label=name)
    for k in range(0, 720, 60):
        x, y = _around(radius[k : k + 1], phi[k : k + 1])
        axes.add_patch(_roller(cam, float(x[0]), float(y[0]), k == 0))
        axes.plot(x, y, ".", color=PURPLE, markersize=5 if k == 0 else 2)
    axes.plot([], [], "o", fillstyle="none", color=PURPLE, markersize=9, label="roller (at θ = 0: thick)")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(title=f"{level('H', H)}, {level('beta', beta)}, θ = 0", xlabel="x (mm)", ylabel="y (mm)")
    figure.legend(loc="outside right center")
    return figure


def _roller(cam: Cam, x: float, y: float, first: bool) -> Circle:
    return Circle(
        (x, y),
        MM * cam.roller_radius,
        fill=False,
        edgecolor=PURPLE,
        linewidth=1.8 if first else 0.7,
        alpha=1.0 if first else 0.6,
    )


def pitch_curve_against_measurement(data: Path) -> Figure:
    """Measured position of a follower in contact against the theoretical displacement and the pitch curve.

    All full revolutions of one run lie on top of each other; it turns the tallest cam that has a run in
    contact. The residuals below show that only the pitch curve, which knows the roller, describes the motion.
    """
    campaign = read(data, "trajectories", "theta", "y")
    figure = new_figure(5.6, 8.0)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    contacts = campaign.experiments[campaign.experiments["label"] == "contact"]
    tallest = contacts[contacts["H"] == contacts["H"].max()]
    row = median_row(tallest[tallest["beta"] == tallest["beta"].max()], "V")
    if row is None:
        for axes in (upper, lower):
            absent(axes, "no run of this campaign keeps contact")
        return figure
    run = campaign.experiments.loc[row]
    cam = CamFollower().cam(float(run["H"]), float(run["beta"]))
    _against_curves(upper, lower, cam, campaign[row])
    upper.set_title(setting(run))
    upper.legend(loc="upper left")
    lower.legend(loc="upper left", ncols=2)
    return figure


def _against_curves(upper: Axes, lower: Axes, cam: Cam, log: dict[str, Array]) -> None:
    grid = np.arange(3600) * TURN / 3600
    curves = (
        ("$h_c$, knife edge", cam.theoretical_curve(), PURPLE, "-."),
        ("$h_p$, pitch curve", cam.pitch_curve(), GREEN, "-"),
    )
    turns = full_revolutions(log["theta"])
    points = 1500 // max(len(turns), 1)
    for turn in turns:
        theta, y = thin(folded(log["theta"][turn]), log["y"][turn], points=points)
        first = turn is turns[0]
        upper.plot(theta, MM * y, color=SKY, linewidth=4.0, label="y, measured" if first else None)
        for name, curve, colour, _ in curves:
            residual = MM * (y - np.interp(theta, grid, curve[0], period=TURN))
            short = f"y − {name.split(',')[0]}"
            lower.plot(theta, residual, color=colour, linewidth=0.9, label=short if first else None)
    for name, curve, colour, line in curves:
        upper.plot(grid[::5], MM * curve[0][::5], color=colour, linestyle=line, label=name)
    lower.axhline(0.0, color=GREY, linewidth=0.8, zorder=0)
    angle_axis(lower)
    upper.set_ylabel("position (mm)")
    lower.set(xlabel="θ (rad)", ylabel="residual (mm)")
