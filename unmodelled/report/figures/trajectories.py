"""Draw free runs before and after a diagnosis, on the experiment with the largest gap."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from unmodelled.base.wording import clock
from unmodelled.report.figures.style import GREY, new_figure, styled, thin
from unmodelled.report.figures.tables import LOOKS, about, line_handle, printed, table

#: Windows of the stretch that is shown enlarged.
STRETCH = 4


@styled
def before_and_after(data: Path) -> Figure:
    """Held-out experiment with the largest gap, before and after the diagnosis.

    "After" is the model with the diagnosed effects, or with refitted parameters if no effect was found. Left:
    windows around the largest error. Every free run starts at a measured state and uses only the inputs; a
    new free run starts after every horizon, which causes the jumps. Right: errors over the whole experiment.
    The grey band is two standard deviations of the sensor noise.
    """
    return _drawn(data, "augmented" if about(data)["effects"] else "reidentified")


@styled
def worst_as_given(data: Path) -> Figure:
    """The experiment with the largest error of the system as given.

    Left: some windows around the largest error; a free run starts at the measured state at the beginning of
    every window (one horizon), which causes the jumps. Right: errors over the whole experiment.
    """
    return _drawn(data, "known")


def _drawn(data: Path, after: str) -> Figure:
    content, rows = about(data), table(data, "trajectory")
    size, time = clock(float(rows["t"].max()))
    rows = rows.assign(t=rows["t"] / size)
    outputs = content["outputs"]
    figure = new_figure(0.9 + 1.9 * len(outputs))
    grid = figure.subplots(len(outputs), 2, sharex="col", squeeze=False)
    first, last = _stretch(rows, content["horizon"] / size)
    for (left, right), output in zip(grid, outputs, strict=True):
        name, unit, noise = output["name"], output["unit"], 2.0 * output["noise"]
        own = rows[rows["output"] == name]
        part = own[(own["t"] >= first) & (own["t"] <= last)]
        _trajectories(left, part, after)
        left.set_ylabel(f"{name} ({printed(unit)})")
        right.axhspan(-noise, noise, color=GREY, alpha=0.35, linewidth=0)
        _errors(right, own, after)
        right.axvspan(first, last, facecolor="none", edgecolor="0.5", linestyle=":", linewidth=1.0)
        right.set_ylabel(f"error of {name} ({printed(output.get('error_unit', unit))})")
    for axes in grid[-1]:
        axes.set_xlabel(f"t ({time})")
    grid[0, 0].set_title(f"{content['worst']}, enlarged")
    grid[0, 1].set_title(f"{content['worst']}, simulated − measured")
    handles = [line_handle(name) for name in dict.fromkeys(("measured", "known", after))]
    figure.legend(handles=handles, loc="outside upper center", ncols=3)
    return figure


def _stretch(rows: pd.DataFrame, horizon: float) -> tuple[float, float]:
    """Some windows around the largest error of the given model, in standard deviations of the outputs."""
    error = (rows["known"] - rows["measured"]).abs() / rows.groupby("output")["measured"].transform("std")
    if not error.notna().any():
        return float(rows["t"].min()), float(rows["t"].max())
    number = int(np.floor(float(rows.loc[error.idxmax(), "t"]) / horizon - 1e-6))
    most = int(np.floor(float(rows["t"].max()) / horizon))
    first = max(min(number - STRETCH // 2, most - STRETCH), 0)
    return first * horizon, (first + STRETCH) * horizon


def _trajectories(axes: Axes, part: pd.DataFrame, after: str) -> None:
    columns = [part[c].to_numpy(np.float64) for c in ("t", "measured", "known", "augmented")]
    t, measured, known, augmented = thin(*columns, points=700)
    axes.plot(t, measured, color=LOOKS["measured"].colour, linewidth=3.0)
    axes.plot(t, known, color=LOOKS["known"].colour, linewidth=1.6)
    axes.plot(t, augmented, color=LOOKS[after].colour, linewidth=1.4)
    axes.grid(linewidth=0.5)


def _errors(axes: Axes, own: pd.DataFrame, after: str) -> None:
    columns = [own[c].to_numpy(np.float64) for c in ("t", "measured", "known", "augmented")]
    t, measured, known, augmented = thin(*columns, points=1200)
    axes.plot(t, known - measured, color=LOOKS["known"].colour, linewidth=1.0)
    axes.plot(t, augmented - measured, color=LOOKS[after].colour, linewidth=1.0)
    axes.grid(linewidth=0.5)
