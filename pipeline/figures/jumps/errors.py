"""Draw errors of the predicted detachment over models and training data."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from pipeline.chapters.summary import leaf, share
from pipeline.figures.jumps.folds import Score, draw_scores, sides
from pipeline.figures.jumps.tables import LOOKS, experiments, handle, models, nothing, table
from pipeline.figures.palette import plain_log
from unmodelled.report.figures.style import Look, new_figure, styled

#: A negative F-dagger of the measured run says jump; it stands beside the models.
FORCE = "f_dagger"
FORCE_LOOK = Look("sign of $F^†$", "#777777", "*")


@styled
def error_quartiles(data: Path) -> Figure:
    """Mean squared error (MSE) of the predicted detachment for every model, over the training data.

    Marker: median over the runs outside the training data; bar: the inner half of those runs, contact and
    jump together. The error is that of the median prediction of the repeats over the first 2 s, at 100 Hz.
    Left: trained on a random share of the runs. Right: trained on every other level of one factor and tested
    on the levels between. The difference between τ[1] and τ[2] to τ[4] is the benefit of physics features.
    Errors of contact and jump runs differ by decades, with few runs near the median; Fig. 5.16.1 shows both
    labels separately.
    """
    return _score_figure(table(data, "runs"), {"MSE of a run (mm²)": _quartiles}, LOOKS, 4.8)


@styled
def errors_by_label(data: Path) -> Figure:
    """Error of jump runs and of contact runs, and share of the runs whose label is predicted correctly.

    Marker: median over the runs outside the training data, or a share of them; bar: 95 % interval over runs
    (bootstrap; Wilson for shares). Predictions are the median of the repeats over the first 2 s, at 100 Hz. A
    prediction counts as a jump where its mean largest detachment, as a share of the stroke, exceeds a level
    chosen on the training runs. The star needs neither a prediction nor training: a negative smallest F† of
    the measured run, at 2 kHz, is called a jump.
    """
    rows = table(data, "runs")
    scores = {
        "jump runs,\nmedian MSE (mm²)": lambda runs: _median(runs, "jump"),
        "contact runs,\nmedian MSE (mm²)": lambda runs: _median(runs, "contact"),
        "jump told from\ncontact (% of runs)": _accuracy,
    }
    force = _by_force(rows, experiments(data))
    looks = {**LOOKS, FORCE: FORCE_LOOK}
    return _score_figure(pd.concat([rows, force], ignore_index=True), scores, looks, 8.4)


def _score_figure(
    rows: pd.DataFrame, scores: Mapping[str, Score], looks: Mapping[str, Look], height: float
) -> Figure:
    """A row of panels for every score, a column for every split."""
    columns, present = sides(rows), {name: looks[name] for name in models(rows, looks)}
    if not columns or not present:
        return nothing("there is no prediction to judge")
    figure = new_figure(height)
    widths = [len(side.folds) for side in columns]
    cells = figure.add_gridspec(len(scores), len(columns), width_ratios=widths)
    grid = cells.subplots(sharex="col", sharey="row", squeeze=False)
    for line, (label, score) in zip(grid, scores.items(), strict=True):
        for axes, side in zip(line, columns, strict=True):
            draw_scores(axes, rows, side, present, score)
            axes.grid(axis="y", linewidth=0.5)
            if "MSE" in label:
                axes.set_yscale("log")
        for axes in line if "MSE" in label else ():
            plain_log(axes)
        line[0].set_ylabel(label)
    for top, bottom, side in zip(grid[0], grid[-1], columns, strict=True):
        top.set_title(side.title)
        bottom.set_xlabel(side.xlabel)
    figure.align_ylabels(grid[:, 0])
    figure.legend(handles=[handle(look) for look in present.values()], loc="outside lower center", ncols=4)
    return figure


def _quartiles(runs: pd.DataFrame) -> dict[str, Any]:
    if runs.empty:
        return {}
    low, middle, high = runs["mse"].quantile([0.25, 0.5, 0.75])
    return {"value": middle, "interval": (low, high)}


def _median(runs: pd.DataFrame, label: str) -> dict[str, Any]:
    errors = runs.loc[runs["label"] == label, "mse"].dropna().to_numpy(np.float64)
    return leaf(errors, "mm^2") if len(errors) else {}


def _accuracy(runs: pd.DataFrame) -> dict[str, Any]:
    if runs.empty:
        return {}
    content = share(int(((runs["label"] == "jump") == runs["jumps"]).sum()), len(runs))
    return {"value": 100.0 * content["value"], "interval": [100.0 * end for end in content["interval"]]}


def _by_force(rows: pd.DataFrame, campaign: pd.DataFrame) -> pd.DataFrame:
    """What the smallest F-dagger says of the runs of every fold; without an error, as it predicts no path."""
    tested = rows[["split", "fold", "exp", "label"]].drop_duplicates()
    force = campaign.set_index("exp")["f_min"]
    return tested.assign(model=FORCE, jumps=tested["exp"].map(force) < 0.0)
