"""Draw physical parameters during their identification together with the network."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pipeline.figures.slider_crank.tables import INDIGO, WINE, table
from unmodelled.report.figures.style import BLACK, GREEN, ORANGE, absent, halo, new_figure, styled

#: Sets of parameters that are identified together, and the one with two that depend on each other.
SETS = {"m3_J1_Bm": ("m3", "J1", "B_m"), "l1_J1_Bm": ("l1", "J1", "B_m")}
AMBIGUOUS, PAIR = "l1_m3_J1_Bm", ("l1", "m3")


@styled
def convergence(data: Path) -> Figure:
    """Physical parameters during the training of network and parameters together, for two sets of parameters.

    A thin line is one run: a fold of the leave-one-out and a repeat, from its own random network and a start
    within ±50 % of the known value; the parameters outside the set are held at values up to 10 % wrong. The
    thick line is the median of the runs. The closer the runs end to each other, the better the parameter is
    determined; the wrong values that are held can pull the median off the value of the bench.
    """
    history, known = table(data, "history"), table(data, "parameters").set_index("parameter")
    shown = {name: members for name, members in SETS.items() if (history["set"] == name).any()}
    figure = new_figure(6.6 if shown else 2.0, 10.0 if len(shown) != 1 else 6.0)
    if not shown:
        absent(figure.subplots(), "no run was recorded for these sets")
        return figure
    grid = figure.subplots(3, len(shown), sharex="col", sharey=False, squeeze=False)
    for column, (name, members) in zip(grid.T, shown.items(), strict=True):
        mine = history[history["set"] == name]
        for axes, parameter in zip(column, members, strict=True):
            _history(axes, mine[mine["parameter"] == parameter], known.loc[parameter])
        column[0].set_title(f"set {_set_name(known, members)}, {_count(mine)} runs")
        column[-1].set_xlabel("epoch (-)")
    figure.legend(handles=_handles(), loc="outside lower center", ncols=5)
    return figure


@styled
def ambiguous_pair(data: Path) -> Figure:
    """Crank length and slider mass during the training, when both are identified together with the network.

    Both scale the slider's inertia as the motor feels it. Left and centre, a thin line is a run (fold and
    repeat), the thick one the median; right, where the runs end. Ends that scatter along a falling curve mean
    that only a combination of the two is determined, although each can be identified without the other.
    """
    history, known = table(data, "history"), table(data, "parameters").set_index("parameter")
    mine = history[history["set"] == AMBIGUOUS]
    figure = new_figure(3.8 if len(mine) else 2.0)
    if not len(mine):
        absent(figure.subplots(), "no run was recorded for this set")
        return figure
    panels = figure.subplots(1, 3)
    for axes, parameter in zip(panels, PAIR, strict=False):
        _history(axes, mine[mine["parameter"] == parameter], known.loc[parameter])
        axes.set_xlabel("epoch (-)")
    _ends(panels[2], mine, known)
    figure.legend(
        handles=[*_handles(), _marker("D", WINE, "end of a run")], loc="outside lower center", ncols=6
    )
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


def _set_name(known: pd.DataFrame, members: tuple[str, ...]) -> str:
    return "{" + ", ".join(known.loc[name, "symbol"] for name in members) + "}"


def _count(rows: pd.DataFrame) -> int:
    return len(rows[["fold", "repeat"]].drop_duplicates())


def _marker(marker: str, colour: str, label: str) -> Line2D:
    return Line2D([], [], color=colour, marker=marker, linestyle="", markersize=5, label=label)


def _handles() -> list[Line2D]:
    looks: list[tuple[str, float, Literal["-", ":"], str]] = [
        (INDIGO, 0.8, "-", "a run"),
        (ORANGE, 2.4, "-", "median"),
        (GREEN, 2.2, "-", "value of the bench"),
        (BLACK, 1.4, ":", "bounds"),
    ]
    return [Line2D([], [], color=c, linewidth=w, linestyle=s, label=label) for c, w, s, label in looks]
