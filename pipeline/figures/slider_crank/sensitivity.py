"""Draw sensitivities of the model to its parameters, and their correlations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pipeline.arrays import Array
from pipeline.figures.slider_crank.tables import INDIGO, WINE, number, plain_log_x, table
from unmodelled.report.figures.style import GREY, ORANGE, new_figure, signed, styled

#: A set that is exactly collinear, or absorbed by the network, is drawn here.
LARGEST = 100.0
KINDS = {"unknown load": ORANGE, "identified in some set": INDIGO, "taken as known": GREY}


@styled
def sensitivities(data: Path) -> Figure:
    """Local sensitivity of the crank's acceleration to the unknown load F and to the physical parameters.

    Norm of the sensitivity over the samples of all trajectories, with every quantity scaled by its own size;
    the axis is logarithmic. A parameter of low sensitivity need not be known well, and cannot be identified.
    """
    found = table(data, "sensitivity").sort_values("norm")
    about = table(data, "parameters").set_index("parameter")
    kinds = [_kind(name, about) for name in found["name"]]
    figure = new_figure(1.0 + 0.36 * len(found), 7.5)
    axes = figure.subplots()
    rows = np.arange(len(found))
    axes.barh(rows, found["norm"], color=[KINDS[kind] for kind in kinds], height=0.7)
    for row, value in zip(rows, found["norm"], strict=True):
        axes.annotate(number(value), (value, row), (4, 0), textcoords="offset points", va="center")
    axes.set_yticks(rows, [_symbol(name, about) for name in found["name"]], fontsize=12)
    positive = found.loc[found["norm"] > 0.0, "norm"]
    axes.set(xscale="log", xlabel=r"norm of the scaled sensitivity $\Vert s_j \Vert$ (-)")
    if len(positive):
        axes.set_xlim(10.0 ** np.floor(np.log10(positive.min()) - 0.3), 3.0 * positive.max())
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="x", linewidth=0.5)
    axes.set_axisbelow(True)
    patches = [Patch(color=colour, label=kind) for kind, colour in KINDS.items() if kind in kinds]
    figure.legend(handles=patches, loc="outside lower center", ncols=3)
    return figure


def _kind(name: str, about: pd.DataFrame) -> str:
    if name not in about.index:
        return "unknown load"
    return "taken as known" if pd.isna(about.loc[name, "low"]) else "identified in some set"


def _symbol(name: str, about: pd.DataFrame) -> str:
    return str(about.loc[name, "symbol"]) if name in about.index else f"${name}$"


@styled
def correlations(data: Path) -> Figure:
    """Correlation of the sensitivities of load and parameters, and how collinear sets of them are.

    Left, ±1 means that two quantities act on the motion in proportion: only a combination of them can be
    identified. Right, the collinearity of whole sets, identified alone (hollow) and beside the network
    (filled); it is 1 for independent sensitivities and grows without limit. Colour and marker tell which sets
    count as identifiable.
    """
    matrix = table(data, "correlation").pivot_table(index="row", columns="column", values="correlation")
    about, advice = table(data, "parameters").set_index("parameter"), table(data, "advice")
    names = [name for name in ("F", *about.index) if name in matrix.index]
    figure = new_figure(4.8)
    left, right = figure.subplots(1, 2, width_ratios=[1.15, 1.0])
    _matrix(left, matrix.loc[names, names].to_numpy(np.float64), [_symbol(name, about) for name in names])
    _collinearity(right, advice, about)
    return figure


def _matrix(axes: Axes, values: Array, symbols: list[str]) -> None:
    image = axes.imshow(values, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    for (i, j), value in np.ndenumerate(values):
        text = signed(round(float(value), 2) + 0.0)  # no minus before a rounded zero
        axes.text(j, i, text, ha="center", va="center", fontsize=8.5, color="w" if abs(value) > 0.6 else "k")
    axes.set_xticks(range(len(symbols)), symbols)
    axes.set_yticks(range(len(symbols)), symbols)
    axes.tick_params(length=0, labelsize=11)
    axes.spines[:].set_visible(False)
    axes.figure.colorbar(image, ax=axes, label="correlation Q (-)", aspect=30, pad=0.02)


def _collinearity(axes: Axes, advice: pd.DataFrame, about: pd.DataFrame) -> None:
    """Sets of at least two of the parameters that have bounds, that is, that are identified somewhere."""
    candidates = set(about.index[about["low"].notna()])
    members = advice["set"].str.split(", ")
    mine = advice[[len(m) > 1 and set(m) <= candidates for m in members]]
    mine = mine.sort_values("collinearity", ascending=False, kind="stable").reset_index(drop=True)
    for row, entry in enumerate(mine.itertuples(index=False)):
        values = np.minimum([entry.collinearity, entry.collinearity_with_network], LARGEST)
        axes.plot(values, [row, row], color="0.75", linewidth=1.2, zorder=1)
        for value, good, filled in zip(values, (entry.identifiable, entry.with_network), (0, 1), strict=True):
            colour = INDIGO if good else WINE
            face = colour if filled else "white"
            axes.plot(value, row, "o" if good else "X", color=colour, mfc=face, markersize=8)
    labels = [", ".join(_symbol(part, about) for part in name.split(", ")) for name in mine["set"]]
    axes.set_yticks(range(len(mine)), labels)
    plain_log_x(axes)
    axes.set(xlabel="collinearity of the set (-)", ylim=(-0.6, len(mine) - 0.4))
    kinds = [("o", INDIGO, "identifiable"), ("X", WINE, "not identifiable")]
    marks = [
        Line2D([], [], color=c, marker=m, linestyle="", markersize=8, label=label) for m, c, label in kinds
    ]
    alone = Line2D([], [], color="0.4", marker="o", mfc="white", linestyle="", markersize=8)
    alone.set_label("hollow: without network")
    axes.figure.legend(handles=[*marks, alone], loc="outside lower right", ncols=3)
