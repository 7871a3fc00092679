"""Draw physical parameters: their sensitivities, and their identification together with the network."""

from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pipeline.figures.palette import INDIGO, WINE, nothing
from pipeline.figures.slider_crank.tables import number, plain_log_x, table
from unmodelled.base.arrays import Array
from unmodelled.report.figures.style import (
    BLACK,
    GREEN,
    GREY,
    ORANGE,
    halo,
    new_figure,
    signed,
)

#: Sets of parameters that are identified together, and the one with two that depend on each other.
SETS = {"m3_J1_Bm": ("m3", "J1", "B_m"), "l1_J1_Bm": ("l1", "J1", "B_m")}
AMBIGUOUS, PAIR = "l1_m3_J1_Bm", ("l1", "m3")


def convergence(data: Path) -> Figure:
    """Physical parameters during the training of network and parameters together, for two sets of parameters.

    A thin line is one run: a fold of the leave-one-out and a repeat, from its own random network and a start
    within ±50 % of the known value; the parameters outside the set are held at values up to 10 % wrong. The
    thick line is the median of the runs. The closer the runs end to each other, the better the parameter is
    determined; the wrong values that are held can pull the median off the value of the bench.
    """
    history, known = table(data, "history"), table(data, "parameters").set_index("parameter")
    shown = {name: members for name, members in SETS.items() if (history["set"] == name).any()}
    if not shown:
        return nothing("no run was recorded for these sets")
    figure = new_figure(6.6, 10.0 if len(shown) > 1 else 6.0)
    grid = figure.subplots(3, len(shown), sharex="col", sharey=False, squeeze=False)
    for column, (name, members) in zip(grid.T, shown.items(), strict=True):
        mine = history[history["set"] == name]
        for axes, parameter in zip(column, members, strict=True):
            _history(axes, mine[mine["parameter"] == parameter], known.loc[parameter])
        symbols = ", ".join(known.loc[parameter, "symbol"] for parameter in members)
        count = len(mine[["fold", "repeat"]].drop_duplicates())
        column[0].set_title(f"set {{{symbols}}}, {count} runs")
        column[-1].set_xlabel("epoch (-)")
    figure.legend(handles=_handles(), loc="outside lower center", ncols=5)
    return figure


def ambiguous_pair(data: Path) -> Figure:
    """Crank length and slider mass during the training, when both are identified together with the network.

    Both scale the slider's inertia as the motor feels it. Left and centre, a thin line is a run (fold and
    repeat), the thick one the median; right, where the runs end. Ends that scatter along a falling curve mean
    that only a combination of the two is determined, although each can be identified without the other.
    """
    history, known = table(data, "history"), table(data, "parameters").set_index("parameter")
    mine = history[history["set"] == AMBIGUOUS]
    if not len(mine):
        return nothing("no run was recorded for this set")
    figure = new_figure(3.8)
    panels = figure.subplots(1, 3)
    for axes, parameter in zip(panels, PAIR, strict=False):
        _history(axes, mine[mine["parameter"] == parameter], known.loc[parameter])
        axes.set_xlabel("epoch (-)")
    _ends(panels[2], mine, known)
    ends = Line2D([], [], color=WINE, marker="D", linestyle="", markersize=5, label="end of a run")
    figure.legend(handles=[*_handles(), ends], loc="outside lower center", ncols=6)
    return figure


def _history(axes: Axes, rows: pd.DataFrame, about: pd.Series) -> None:
    """Runs as one broken line, which keeps the file small."""
    runs = rows.pivot_table(index="epoch", columns=["fold", "repeat"], values="value")
    runs = runs.iloc[np.unique(np.linspace(0, len(runs) - 1, 80).round().astype(int))]
    epochs, values = runs.index.to_numpy(np.float64), runs.to_numpy(np.float64)
    gap = np.full((1, values.shape[1]), np.nan)
    x = np.tile(np.append(epochs, np.nan), values.shape[1])
    strength = float(np.clip(12.0 / values.shape[1], 0.2, 0.8))
    axes.plot(x, np.vstack([values, gap]).T.ravel(), color=INDIGO, linewidth=0.7, alpha=strength)
    axes.axhline(about["truth"], color=GREEN, linewidth=2.2)
    axes.plot(epochs, np.nanmedian(values, axis=1), color=ORANGE, linewidth=2.4, path_effects=halo(4.0))
    for bound in (about["low"], about["high"]):
        axes.axhline(bound, color=BLACK, linestyle=":", linewidth=1.4)
    axes.set_ylabel(f"{about['symbol']} ({about['unit']})")


def _ends(axes: Axes, rows: pd.DataFrame, known: pd.DataFrame) -> None:
    last = rows[rows["epoch"] == rows["epoch"].max()]
    ends = last.pivot_table(index=["fold", "repeat"], columns="parameter", values="value")
    axes.plot(ends[PAIR[0]], ends[PAIR[1]], "D", color=WINE, markersize=5, alpha=0.6, markeredgewidth=0)
    about = [known.loc[name] for name in PAIR]
    axes.axvline(about[0]["truth"], color=GREEN, linewidth=2.2, zorder=1)
    axes.axhline(about[1]["truth"], color=GREEN, linewidth=2.2, zorder=1)
    axes.set(
        xlabel=f"{about[0]['symbol']} ({about[0]['unit']})",
        ylabel=f"{about[1]['symbol']} ({about[1]['unit']})",
    )


def _handles() -> list[Line2D]:
    looks: list[tuple[str, float, Literal["-", ":"], str]] = [
        (INDIGO, 0.8, "-", "a run"),
        (ORANGE, 2.4, "-", "median"),
        (GREEN, 2.2, "-", "value of the bench"),
        (BLACK, 1.4, ":", "bounds"),
    ]
    return [Line2D([], [], color=c, linewidth=w, linestyle=s, label=label) for c, w, s, label in looks]


#: A set that is exactly collinear, or absorbed by the network, is drawn here.
LARGEST = 100.0
KINDS = {"unknown load": ORANGE, "identified in some set": INDIGO, "taken as known": GREY}


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
