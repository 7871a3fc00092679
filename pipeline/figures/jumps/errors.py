"""Draw errors of the predicted detachment over models and training data."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

from pipeline.chapters.summary import leaf, share
from pipeline.figures.examples import experiments_of
from pipeline.figures.jumps.tables import (
    FACTORS,
    LOOKS,
    SHORT,
    UNIFORM,
    handle,
    models,
    of_fold,
    table,
)
from pipeline.figures.palette import nothing, plain_log
from pipeline.figures.settings import LABELS, MM
from unmodelled.report.figures.style import BLACK, GREY, Look, new_figure

#: A negative F-dagger of the measured run says jump; it stands beside the models.
FORCE = "f_dagger"
FORCE_LOOK = Look("sign of $F^†$", "#777777", "*")


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
    force = _by_force(rows, experiments_of(data, "features"))
    looks = {**LOOKS, FORCE: FORCE_LOOK}
    return _score_figure(pd.concat([rows, force], ignore_index=True), scores, looks, 8.4)


def _score_figure(
    rows: pd.DataFrame, scores: Mapping[str, "Score"], looks: Mapping[str, Look], height: float
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


FACTOR_NAMES = {"H": "stroke H", "beta": "rise β", "m": "mass m"}
#: Of markers that look small, pt.
MARKER_SIZES = {"X": 8.5, "P": 8.5, "*": 12.0}
#: From the rows of one model on one fold to a value and its interval; nothing where there is none.
Score = Callable[[pd.DataFrame], Mapping[str, Any]]


@dataclass(frozen=True)
class Side:
    """A panel with the folds of one split."""

    split: str
    folds: list[str]  # from left to right
    xlabel: str
    title: str

    def name(self, axes: Axes) -> None:
        """Label the folds with ticks, and separate them by bands."""
        for k in range(1, len(self.folds), 2):
            axes.axvspan(k - 0.5, k + 0.5, color="0.95", linewidth=0, zorder=-2)
        names = [FACTOR_NAMES.get(fold, fold.removesuffix("%")) for fold in self.folds]
        axes.set_xticks(range(len(names)), names)
        axes.tick_params(axis="x", length=0)
        axes.set(xlim=(-0.5, len(names) - 0.5))


def sides(rows: pd.DataFrame) -> list[Side]:
    """Return the panels that a table has folds for: uniform shares in increasing order, and factors."""
    folds = {split: set(group["fold"]) for split, group in rows.groupby("split")}
    shares = sorted(folds.get(UNIFORM, ()), key=lambda fold: float(fold.removesuffix("%")))
    factors = [name for name in FACTOR_NAMES if name in folds.get(FACTORS, ())]
    both = [
        Side(UNIFORM, shares, "runs trained on (%)", "trained on random runs"),
        Side(FACTORS, factors, "factor (-)", "trained on every other level of a factor"),
    ]
    return [side for side in both if side.folds]


def draw_scores(axes: Axes, rows: pd.DataFrame, side: Side, looks: Mapping[str, Look], score: Score) -> None:
    """Draw the scores of models on every fold of a panel: a marker for the value, a bar for the interval."""
    offsets = (np.arange(len(looks)) - (len(looks) - 1) / 2.0) * 0.8 / len(looks)
    own = rows[rows["split"] == side.split]
    for (model, look), offset in zip(looks.items(), offsets, strict=True):
        for k, fold in enumerate(side.folds):
            found = score(own[(own["model"] == model) & (own["fold"] == fold)])
            if found:
                draw_score(axes, k + float(offset), found, look)
    side.name(axes)


def draw_score(axes: Axes, x: float, found: Mapping[str, Any], look: Look) -> None:
    """Draw one value with its interval."""
    value = found["value"]
    ends = found.get("interval", (value, value))
    axes.plot([x, x], ends, color=look.colour, linewidth=3.4, alpha=0.55, solid_capstyle="butt")
    size = MARKER_SIZES.get(look.marker, 7.0)
    axes.plot(x, value, look.marker, color=look.colour, markersize=size, mec="white", mew=0.7, zorder=3)


#: Lowest detachment shown, mm; smaller ones are drawn here, as a logarithmic axis has no zero.
LOWEST = 0.01
#: Runs whose label the prediction mistakes: measured label -> name and marker.
MISTAKEN = {"contact": ("false alarm", "^"), "jump": ("missed jump", "v")}


def mean_maxima(data: Path) -> Figure:
    """Predicted against measured mean largest detachment (mm) of runs with an unseen stroke H or rise β.

    Trained on every other level of the factor, tested on the other levels; median prediction of the repeats.
    Dots on the line are exact. Triangles mark runs with a wrong label: false alarms (contact runs) and missed
    jumps; their numbers stand above. A prediction is called a jump where it exceeds a share of the stroke
    that was chosen on the training runs. Values below 0.01 mm are drawn at 0.01 mm.
    """
    rows = table(data, "runs")
    folds = {name: of_fold(rows, FACTORS, name) for name in ("H", "beta")}
    folds = {name: own for name, own in folds.items() if len(own)}
    if not folds:
        return nothing("no model was tested on levels of H or β")
    names = models(pd.concat([*folds.values()]), LOOKS)
    largest = MM * max(float(own[["measured", "predicted"]].max().max()) for own in folds.values())
    limits = (0.7 * LOWEST, 1.5 * max(largest, LOWEST))
    figure = new_figure(1.1 + 1.75 * len(folds))
    grid = figure.subplots(len(folds), len(names), sharex=True, sharey=True, squeeze=False)
    for line, (fold, own) in zip(grid, folds.items(), strict=True):
        for axes, name in zip(line, names, strict=True):
            mine = own[own["model"] == name]
            axes.axline((LOWEST, LOWEST), (1.0, 1.0), color=GREY, linewidth=1.2, zorder=1)
            counts = _compare(axes, mine, LOOKS[name])
            axes.set_title(f"{SHORT[name]}\n{counts[0]} false, {counts[1]} missed", fontsize=9)
            _equal_log(axes, limits)
        line[0].annotate(
            f"{FACTOR_NAMES[fold]} unseen,\n{own['exp'].nunique()} runs",
            (-0.44, 0.5),
            xycoords="axes fraction",
            rotation=90,
            ha="right",
            va="center",
            multialignment="center",
        )
    figure.supxlabel("measured mean largest ε (mm)", fontsize=10)
    figure.supylabel("predicted mean largest ε (mm)", fontsize=10)
    marks = [
        Line2D([], [], color=LABELS[label], marker=marker, mec=BLACK, markersize=7, linestyle="", label=name)
        for label, (name, marker) in MISTAKEN.items()
    ]
    figure.legend(handles=marks, loc="outside upper center", ncols=2)
    return figure


def _equal_log(axes: Axes, limits: tuple[float, float]) -> None:
    """The same logarithmic scale on both axes, with plain numbers."""
    axes.set(xscale="log", yscale="log", xlim=limits, ylim=limits, aspect="equal")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(numticks=9))
        axis.set_major_formatter(FormatStrFormatter("%g"))
        axis.set_minor_locator(NullLocator())


def _compare(axes: Axes, runs: pd.DataFrame, look: Look) -> list[int]:
    """Draw the runs of one model; how many contact and jump runs it mistakes."""
    x, y = (np.maximum(MM * runs[name].to_numpy(np.float64), LOWEST) for name in ("measured", "predicted"))
    wrong = ((runs["label"] == "jump") != runs["jumps"]).to_numpy()
    axes.scatter(x[~wrong], y[~wrong], s=12, color=look.colour, alpha=0.6, linewidth=0, rasterized=True)
    counts = []
    for label, (_, marker) in MISTAKEN.items():
        shown = wrong & (runs["label"] == label).to_numpy()
        axes.scatter(x[shown], y[shown], s=34, c=LABELS[label], marker=marker, ec=BLACK, lw=0.7, zorder=3)
        counts.append(int(shown.sum()))
    return counts
