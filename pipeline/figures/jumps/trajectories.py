"""Draw predicted detachment over time."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.figures.jumps.tables import (
    FEATURE_SETS,
    LOOKS,
    MEASURED,
    SCARCE,
    SIMULATED,
    UNIFORM,
    experiments,
    line_handle,
    models,
    nothing,
    of_fold,
    run_title,
    table,
)
from unmodelled.report.figures.style import BLACK, MM, new_figure, styled

#: Title of a column -> its models.
COLUMNS = {"networks": FEATURE_SETS, "with a simulation of impacts": SIMULATED}


@styled
def predicted_detachment(data: Path) -> Figure:
    """Measured and predicted detachment (mm) over time, of runs outside the training data, one row per run.

    Jumps of small to large detachment, then contact; every row has its own scale. Trained on 5 % of the runs;
    thin lines are the median of the repeats. Left: networks with the settings m, H, β and the inputs in the
    legend: signals of the encoder (angle, speed, acceleration), the force F† that would keep contact, the
    shape of the cam, or speed and acceleration along the cam instead of the encoder's. Right: a simulation of
    impacts, and a network on top of it.
    """
    rows = of_fold(table(data, "examples"), UNIFORM, SCARCE)
    if rows.empty:
        return nothing("there is no run to show")
    columns = {title: models(rows, among) for title, among in COLUMNS.items()}
    columns = {title: names for title, names in columns.items() if names}
    exps, runs = list(dict.fromkeys(rows["exp"])), experiments(data)
    figure = new_figure(1.0 + 1.75 * len(exps))
    grid = figure.subplots(len(exps), len(columns), sharex=True, sharey="row", squeeze=False)
    for line, exp in zip(grid, exps, strict=True):
        for axes, names in zip(line, columns.values(), strict=True):
            draw_predictions(axes, rows[rows["exp"] == exp], names)
        line[0].set(ylabel="ε (mm)")
        line[0].set_title(run_title(runs, exp), loc="left")
    for top, bottom, title in zip(grid[0], grid[-1], columns, strict=True):
        top.set_title(title, y=1.18, fontweight="bold")  # above that of the run
        bottom.set_xlabel("time (s)")
    figure.align_ylabels(grid[:, 0])
    handles = [MEASURED, *(line_handle(LOOKS[name]) for names in columns.values() for name in names)]
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def draw_predictions(axes: Axes, rows: pd.DataFrame, names: list[str]) -> None:
    """Draw the measured detachment of a run as a broad line, with the median predictions of models."""
    first = rows[rows["model"] == rows["model"].iloc[0]]
    axes.axhline(0.0, color="0.7", linewidth=0.8, zorder=0)
    axes.plot(first["t"], MM * first["measured"], color=BLACK, linewidth=2.6)
    for name in names:
        own, look = rows[rows["model"] == name], LOOKS[name]
        # a dashed line shows on a solid one that it coincides with, not below it
        order = 3 if look.line == "--" else 2
        axes.plot(own["t"], MM * own["predicted"], look.line, color=look.colour, lw=1.4, zorder=order)
