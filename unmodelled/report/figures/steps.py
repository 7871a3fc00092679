"""Draw how far the gap falls, model by model."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from unmodelled.report.figures.style import new_figure, styled
from unmodelled.report.figures.tables import GAP, LOOKS, line_handle, log_gaps, number, table

LOOK = {"known": "known", "reidentified": "reidentified", "effect": "augmented"}


@styled
def gap_steps(data: Path) -> Figure:
    """Gap of experiments left out: system file as given, refitted parameters, effects, and noise floor.

    First the uncertain parameters are refitted, then each effect is added and all parameters are refitted.
    The percentage is the change of the squared gap above the noise floor. The axis is logarithmic. If the
    line of a network in every port is well left of the last dot, a flexible model could still explain a part
    of the gap. The line of the noise of the sensors is the noise floor, the gap that noise alone causes.
    """
    steps = table(data, "steps")
    models = steps[steps["kind"].isin(LOOK)].reset_index(drop=True)
    lines = {row.kind: row.gap for row in steps.itertuples() if row.kind not in LOOK}
    low, high = 0.6 * min(steps["gap"].min(), lines["floor"]), 2.2 * float(steps["gap"].max())
    figure = new_figure(1.5 + 0.55 * len(models), 8.5)
    axes = figure.subplots()
    axes.plot(models["gap"], models.index, color="0.75", lw=1.0)
    for place, row in models.iterrows():
        colour = LOOKS[LOOK[row["kind"]]].colour
        axes.plot(row["gap"], place, "o", color=colour, markeredgecolor="black", markersize=9)
    _numbers(axes, models, lines["floor"])
    for name in ("neural", "floor"):
        axes.axvline(lines[name], color=LOOKS[name].colour, linestyle="--", linewidth=1.8)
    log_gaps(axes, low, high)
    labels = [f"+ {row.label}" if row.kind == "effect" else str(row.label) for row in models.itertuples()]
    axes.set_yticks(models.index, [fill(label, 32) for label in labels])
    axes.set_ylim(len(models) - 0.4, -0.6)
    axes.set_xlabel(GAP)
    figure.legend(handles=[line_handle("neural"), line_handle("floor")], loc="outside upper right", ncols=2)
    return figure


def _numbers(axes: Axes, models: pd.DataFrame, floor: float) -> None:
    """The gap beside its dot, and by how much its square above the floor fell."""
    before: float | None = None
    for place, gap in enumerate(models["gap"]):
        square = max(gap**2 - floor**2, 0.0)
        text = number(gap)
        if before:
            text += f"   (squared: {100.0 * (square - before) / before:+.3g} %)".replace("-", "−")
        # on white, so that the dashed lines do not cross the text
        on_white = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
        axes.annotate(
            text, (gap, place), (9, 0), textcoords="offset points", va="center", fontsize=9, bbox=on_white
        )
        before = square
