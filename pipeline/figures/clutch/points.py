"""Arrange all operating points: one panel per motor speed, one group of points per current profile."""

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from pipeline.figures.clutch.tables import dot
from unmodelled.base.arrays import Array
from unmodelled.report.figures.style import BLACK

PANEL = 2.0  # in, height of a panel
#: Width of all points of one profile, and of what is drawn of one point; profiles are 1 apart.
GROUP = 0.86
#: Points of a drawn density, and the share of its height below which it is not drawn.
CURVE, INVISIBLE = 70, 0.004


@dataclass(frozen=True)
class Place:
    """Place of an operating point in a figure."""

    axes: Axes  # panel of the motor speed
    x: float
    width: float
    brake: int  # rank of the brake torque, from 0


def places(figure: Figure | SubFigure, experiments: pd.DataFrame) -> dict[str, Place]:
    """Make one panel per motor speed, and return the place of every operating point by its id."""
    speeds, brakes = sorted(experiments["rpm"].unique()), sorted(experiments["T_b0"].unique())
    profiles = sorted(experiments["profile"].unique())
    column = figure.subplots(len(speeds), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axes, rpm in zip(column, speeds, strict=True):
        for k in range(1, len(profiles), 2):
            axes.axvspan(k - 0.5, k + 0.5, color="0.95", linewidth=0, zorder=-2)
        axes.set_ylabel(f"{rpm:.0f} rpm\nshifting time (s)")
        axes.grid(axis="y", linewidth=0.5)
        axes.set_axisbelow(True)
    column[-1].set_xticks(range(len(profiles)), [f"{p:.0f}" for p in profiles])
    column[-1].xaxis.set_minor_locator(NullLocator())
    sides = f"within one, from left to right: brake torque {', '.join(f'{b:g}' for b in brakes)} N m"
    column[-1].set(xlim=(-0.5, len(profiles) - 0.5), xlabel=f"current profile (-); {sides}")
    width = GROUP / len(brakes)
    return {
        str(row.id): Place(
            column[speeds.index(row.rpm)],
            profiles.index(row.profile) + (brakes.index(row.T_b0) - (len(brakes) - 1) / 2.0) * width,
            width,
            brakes.index(row.T_b0),
        )
        for row in experiments.itertuples(index=False)
    }


def measured(where: Mapping[str, Place], points: pd.DataFrame) -> None:
    """Draw the measured shifting times, with hollow markers for the lowest brake torque."""
    for row in points.itertuples(index=False):
        place = where[str(row.id)]
        face, rim = ("white", BLACK) if place.brake == 0 else (BLACK, "white")
        place.axes.plot(place.x, row.y, "o", mfc=face, mec=rim, markersize=4.8, markeredgewidth=0.9, zorder=5)


def measured_handles(where: Mapping[str, Place]) -> list[Line2D]:
    """Return the legend entries of `measured`."""
    several = len({place.brake for place in where.values()}) > 1
    names = [("measured, low brake torque", False), ("high", True)] if several else [("measured", False)]
    return [dot(label, filled) for label, filled in names]


def area(
    place: Place, y: Array, density: Array, scale: float, sides: tuple[float, float], colour: str
) -> None:
    """Draw a density as an area at an operating point. Takes y (P,) in s, density (P,)."""
    step = max(1, len(y) // CURVE)
    y, share = y[::step], density[::step] / scale
    seen = share > INVISIBLE
    left, right = (place.x + side * 0.48 * place.width * share for side in sides)
    place.axes.fill_betweenx(y, left, right, where=seen, color=colour, alpha=0.75, linewidth=0, zorder=2)
