"""Draw the contribution of every input over all jump runs, and the agreement of two methods."""

from __future__ import annotations

import importlib
import warnings
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pipeline.figures.jumps.tables import ANGLE, FEATURE_SETS, INPUTS, LOOKS, SHORT, models, table
from pipeline.figures.palette import nothing
from pipeline.figures.settings import MM
from unmodelled.report.figures.style import BLACK, GREY, halo, new_figure

#: Methods on the same few runs.
METHODS: dict[str, dict[str, Any]] = {
    "deep_shap": {"marker": "o", "mfc": "white"},
    "exact": {"marker": "D", "mfc": BLACK},
}
#: Rank correlations of the two.
KINDS = {"shares": "of the shares", "trajectories": "over time"}
MARK: dict[str, Any] = {"color": BLACK, "mec": BLACK, "linestyle": "", "markersize": 5.5, "zorder": 4}


def relative_contributions(data: Path) -> Figure:
    """Share of every input in all contributions to predicted jumps (%), by DeepSHAP and by exact Shapley
    values.

    Networks trained on 30 % of the runs; jump runs outside the training data are explained against contact
    runs inside it. Bars: share of the sum of |Φ| over all steps and runs, mean over the repeats, with their
    range as a line; sine and cosine of the angle add up to one bar. Markers: some of the runs and one
    network, by DeepSHAP and by exact Shapley values with the angle as one input. The title gives the share of
    the settings m, H and β (hatched).
    """
    overall, exact = table(data, "overall"), table(data, "exact")
    names = models(overall, FEATURE_SETS)
    if not names:
        return nothing("no model was explained")
    figure = new_figure(6.4)
    panels = figure.subplots(1, len(names), sharex=True, sharey=True, squeeze=False)[0]
    used = set(overall["feature"])
    rows = [name for name in INPUTS if name in used - set(ANGLE) or (name == "theta" and used & set(ANGLE))]
    for axes, name in zip(panels, names, strict=True):
        shares = overall[overall["model"] == name].pivot(index="repeat", columns="feature", values="share")
        _bars(axes, shares, rows)
        _marks(axes, exact[exact["model"] == name], rows)
        own = [setting for setting in ("m", "H", "beta") if setting in shares]
        told = f"settings {100.0 * float(shares[own].sum(axis=1).mean()):.0f} %"
        axes.set_title(f"{SHORT[name]}: {told}")
        axes.set_xlabel("share of Σ|Φ| (%)")
        axes.grid(axis="x", linewidth=0.5)
        axes.set_axisbelow(True)
    panels[0].set_yticks(range(len(rows)), [INPUTS[name].label for name in rows])
    panels[0].invert_yaxis()
    panels[0].set_ylabel("input (-)")
    count = exact["exp"].nunique()
    labels = (f"DeepSHAP, one network, {count} runs", "exact Shapley values of the same")
    marks = zip(labels, METHODS.values(), strict=True)
    handles = [
        Patch(color=GREY, label=f"DeepSHAP, {overall['repeat'].nunique()} networks"),
        *(Line2D([], [], **MARK, **look, label=label) for label, look in marks),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def _bars(axes: Axes, shares: pd.DataFrame, rows: list[str]) -> None:
    """Mean and range of `shares` (repeats, inputs), %, a bar an input."""
    for row, name in enumerate(rows):
        parts = [part for part in (ANGLE if name == "theta" else (name,)) if part in shares]
        if not parts:
            continue
        start = 0.0
        for part in parts:
            width = 100.0 * float(shares[part].mean())
            look = INPUTS[part]
            axes.barh(row, width, 0.72, start, color=look.colour, hatch=look.hatch, ec="white", lw=0)
            start += width
        total = 100.0 * shares[parts].sum(axis=1)
        axes.plot([total.min(), total.max()], [row, row], color=BLACK, linewidth=1.6, path_effects=halo(3.2))


def _marks(axes: Axes, exact: pd.DataFrame, rows: list[str]) -> None:
    """Shares of all contributions to some runs, %, a marker a method and input."""
    for method, style in METHODS.items():
        sizes = exact[exact["method"] == method].groupby("feature")["magnitude"].sum()
        for name, size in sizes.items():
            axes.plot(100.0 * size / max(sizes.sum(), 1e-300), rows.index(str(name)), **MARK, **style)


def agreement_with_exact(data: Path) -> Figure:
    """Contributions by DeepSHAP against exact Shapley values, by run and by input.

    Top: share of every input in the contributions to a run, one dot per run and input; on the line both
    methods agree. Bottom: rank correlation (Spearman) of the two methods, one dot per run, with the mean as a
    bar: of the shares of the inputs, and of the contributions over all inputs and steps. One network of each
    feature set, the same references for both methods. A correlation close to one means that DeepSHAP ranks
    the inputs as exact values do.
    """
    exact, agreement = table(data, "exact"), table(data, "agreement")
    names = models(agreement, FEATURE_SETS)
    if not names:
        return nothing("no run was explained in both ways")
    figure = new_figure(6.2)
    grid = figure.add_gridspec(2, len(names), height_ratios=[1.25, 1.0])
    end = 105.0 * float(exact["share"].max())
    for k, name in enumerate(names):
        axes = figure.add_subplot(grid[0, k])
        _compare(axes, exact[exact["model"] == name])
        axes.set(title=SHORT[name], xlabel="exact share (%)", xlim=(0.0, end), ylim=(0.0, end))
        if k == 0:
            axes.set_ylabel("share by DeepSHAP (%)")
        axes.tick_params(labelleft=k == 0)
    _correlations(figure.add_subplot(grid[1, :]), agreement, names)
    used = set(exact["feature"])
    handles = [
        Line2D([], [], color=look.colour, marker=look.marker, linestyle="", label=look.label)
        for name, look in INPUTS.items()
        if name in used
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=6)
    return figure


def _compare(axes: Axes, exact: pd.DataFrame) -> None:
    wide = exact.pivot(index=["exp", "feature"], columns="method", values="share").reset_index()
    axes.axline((0.0, 0.0), slope=1.0, color=GREY, linewidth=1.2, zorder=1)
    for name, own in wide.groupby("feature"):
        look, x, y = INPUTS[str(name)], 100.0 * own["exact"], 100.0 * own["deep_shap"]
        axes.scatter(x, y, s=30, color=look.colour, marker=look.marker, ec="white", lw=0.4)
    axes.grid(linewidth=0.5)
    axes.set_axisbelow(True)


def _correlations(axes: Axes, agreement: pd.DataFrame, names: list[str]) -> None:
    """Rank correlations, a strip a model and kind; runs where either is constant have none."""
    places = []
    for k, name in enumerate(names):
        look = LOOKS[name]
        for side, kind in zip((-0.2, 0.2), KINDS, strict=True):
            values = agreement.loc[agreement["model"] == name, kind].dropna().to_numpy(np.float64)
            places.append((k + side, f"{SHORT[name]}\n{KINDS[kind]}"))
            if not len(values):
                continue
            spread = np.linspace(-0.1, 0.1, len(values)) if len(values) > 1 else np.zeros(1)
            axes.plot(k + side + spread, values, look.marker, color=look.colour, alpha=0.75, markersize=5)
            axes.plot(
                [k + side - 0.15, k + side + 0.15], [values.mean()] * 2, color=BLACK, linewidth=2.4, zorder=4
            )
    axes.axhline(1.0, color=GREY, linewidth=1.2, zorder=1)
    axes.set_xticks([x for x, _ in places], [text for _, text in places])
    axes.tick_params(axis="x", length=0)
    axes.set(ylabel="rank correlation (-)", xlabel="network and what is compared (-)")
    axes.set_xlim(-0.5, len(names) - 0.5)
    axes.grid(axis="y", linewidth=0.5)


def contributions_by_value(data: Path) -> Figure:
    """Contribution Φ of every input to the predicted detachment, mm, coloured by the value of the input.

    A dot for every tenth of a second of the jump runs that were explained, by one network of each feature set
    trained on 30 % of the runs; DeepSHAP against contact runs, drawn by shap. Inputs with the largest mean of
    |Φ| stand on top. Φ > 0: the input raises the predicted detachment above its mean over the contact runs.
    Red: the largest values of the input, blue: the smallest (5th and 95th percentile). Where colours are
    mixed, the contribution depends on earlier values of the input, or on the other inputs.
    """
    points = table(data, "points")
    names = models(points, FEATURE_SETS)
    if not names:
        return nothing("no model was explained")
    figure = new_figure(5.6)
    panels = figure.subplots(1, len(names), squeeze=False)[0]
    for axes, name in zip(panels, names, strict=True):
        _beeswarm(axes, points[points["model"] == name])
        axes.set_title(SHORT[name])
    figure.supylabel("input (-)", fontsize=10)
    colours = ScalarMappable(cmap=shap_library().plots.colors.red_blue)
    bar = figure.colorbar(
        colours, ax=list(panels), location="bottom", aspect=60, shrink=0.6, ticks=[0.0, 1.0]
    )
    bar.ax.set_xticklabels(["small", "large"])
    bar.set_label("value of the input (-)")
    bar.outline.set_visible(False)
    return figure


def _beeswarm(axes: Axes, points: pd.DataFrame) -> None:
    """The plot of shap with the fonts and units of all figures."""
    shown = explanation(points, MM)
    shown.feature_names = [INPUTS[name].label for name in shown.feature_names]
    np.random.seed(0)  # noqa: NPY002 (shap draws the order of equal dots from it)
    rows = len(shown.feature_names)
    shap_library().plots.beeswarm(
        shown, max_display=rows, show=False, ax=axes, plot_size=None, color_bar=False, s=9
    )
    axes.set_xlabel("Φ (mm)", fontsize=10)
    axes.tick_params(labelsize=9)


if TYPE_CHECKING:
    from shap import Explanation


@cache
def shap_library() -> ModuleType:
    """Return the package shap, which takes seconds to import and warns while it does."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return importlib.import_module("shap")


def explanation(points: pd.DataFrame, scale: float = 1.0) -> Explanation:
    """Return attributions of one network as a `shap.Explanation` with a row for every run and step."""
    names = list(dict.fromkeys(points["feature"]))
    wide = points.pivot(index=["exp", "step"], columns="feature", values=["phi", "value"])
    base = points.groupby(["exp", "step"])["base"].first()
    found: Explanation = shap_library().Explanation(
        scale * wide["phi"][names].to_numpy(),
        base_values=scale * base.to_numpy(),
        data=wide["value"][names].to_numpy(),
        feature_names=names,
    )
    return found
