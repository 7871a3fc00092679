"""Draw the learned load and its closed-form expression."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.arrays import Array
from pipeline.figures.slider_crank.tables import INDIGO, number, table
from unmodelled.report.figures.style import BLACK, MM, ORANGE, new_figure, styled, thin


@styled
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
