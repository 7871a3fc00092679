"""Draw the effort that the models lack at a channel, window by window."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from unmodelled.base.wording import place_name
from unmodelled.report.figures.style import BLACK, GREY, YELLOW, absent, halo, new_figure, styled, thin
from unmodelled.report.figures.tables import Channel, about, number, table

CORRECTIONS = "RdBu_r"
#: Cells across the map, bins of the side view.
CELLS, BINS = 26, 28
#: Channels that are shown, at most.
MOST = 3
#: Share of its range by which a law may spread and still be a line.
WIDE = 0.1
#: Ranges of a signal beyond which a missing part of it is none: the states are read from this very signal.
FAR = 10.0
INDIGO = "#332288"  # of Tol's palette, beside that of Okabe and Ito


@styled
def lacking(data: Path) -> Figure:
    """Missing effort of the known physics, at the channels where the gap enters.

    The effort is estimated in short windows of all experiments, without differentiation, with the parameters
    of the augmented model. A positive effort takes power out of the system. Left, where a channel has two
    coordinates: mean over each cell of the visited states. Right: over the coordinate with the largest
    influence; grey dots are windows, dark dots their medians, bars hold the middle half of the windows. The
    black line is the diagnosed law. It was fitted to free runs, not to these dots. Yellow marks regions with
    more than their share of the gap.
    """
    return _residual(data, "lacking")


@styled
def left_over(data: Path) -> Figure:
    """Missing effort of the augmented model, at the channels where the gap enters.

    Axes and colours are those of the figure of the missing effort of the known physics. Left: mean over each
    cell of the visited states. Right: over the coordinate with the largest influence; grey dots are windows,
    dark dots their medians, bars hold the middle half. A white map and flat dots mean that the diagnosed
    effects explain the whole effort. If a shape remains, it shows an effect that the library of laws does not
    contain.
    """
    return _residual(data, "left")


def _residual(data: Path, stage: str) -> Figure:
    content, windows, laws = about(data), table(data, "windows"), table(data, "laws")
    shown = content["shown"][:MOST]
    found = {name: windows[windows["channel"] == name] for name, _ in shown}
    reasons = {name: _unknown(content, name, every, stage) for name, every in found.items()}
    heights = [0.8 if reasons[name] else 4.1 for name, _ in shown]
    figure = new_figure(sum(heights) + 0.2)
    parts = figure.subfigures(len(shown), 1, height_ratios=heights, squeeze=False)[:, 0]
    for part, (name, coordinate) in zip(parts, shown, strict=True):
        if reasons[name]:
            absent(part.subplots(), reasons[name])
            continue
        channel, every = Channel.of(content, name), found[name]
        rows, before = (every[every["stage"] == kind] for kind in (stage, "lacking"))
        limit = max(float(np.quantile(np.abs(before["value"]), 0.97)), 1e-12)
        first, columns = stage == "lacking", _coordinates(rows)
        right = part.subplots(1, len(columns), squeeze=False)[0, -1]
        if len(columns) > 1:
            _map(part, part.axes[0], rows, columns, channel, Normalize(-limit, limit))
        law, regions = laws[first & (laws["channel"] == name)], content["regions"] if first else []
        _side(right, rows, channel, coordinate, law, regions)
        low, high = np.quantile(before["value"], [0.005, 0.995])
        room = 0.15 * max(high - low, 1e-12)
        right.set_ylim(low - room, high + room)
    return figure


def _unknown(content: dict[str, Any], name: str, every: pd.DataFrame, stage: str) -> str:
    """Why nothing is shown at a channel; empty where something is."""
    if not {stage, "lacking"} <= set(every["stage"]):
        return f"nothing is known of {place_name(name)}"
    if is_undetermined(content, name, every):
        return f"no window tells what is missing at {place_name(name)}: the states are read from it"
    return ""


def is_undetermined(content: dict[str, Any], name: str, every: pd.DataFrame) -> bool:
    """Return whether windows do not determine what is missing at a channel: far more than its signal."""
    if content["channels"][name]["kind"] == "port" or not every["level"].notna().any():
        return False
    return float(every["value"].abs().median()) > FAR * float(np.ptp(every["level"].dropna()))


def _coordinates(rows: pd.DataFrame) -> list[str]:
    """Coordinates of the map, at most two; a single one needs no map."""
    return [c for c in ("level", "rate", "acceleration") if rows[c].notna().any()][:2] or ["level"]


def _map(
    figure: SubFigure, axes: Axes, rows: pd.DataFrame, columns: list[str], channel: Channel, norm: Normalize
) -> None:
    x, y = (rows[c].to_numpy(np.float64) for c in columns)
    cells = axes.hexbin(
        *(x, y, rows["value"].to_numpy(np.float64)),
        gridsize=(CELLS, round(0.6 * CELLS)),
        reduce_C_function=np.mean,
        cmap=CORRECTIONS,
        norm=norm,
        linewidths=0.2,
    )
    axes.set(xlabel=channel.axes[columns[0]], ylabel=channel.axes[columns[1]], facecolor="0.88")
    label = f"{channel.quantity} lacking at {channel.name} ({channel.unit})"
    figure.colorbar(cells, ax=axes, label=label, pad=0.01, extend="both")


def _side(
    axes: Axes,
    rows: pd.DataFrame,
    channel: Channel,
    coordinate: str,
    law: pd.DataFrame,
    regions: list[dict[str, Any]],
) -> None:
    x, y = rows[coordinate].to_numpy(np.float64), rows["value"].to_numpy(np.float64)
    dots = thin(x, y, points=1500)
    axes.plot(*dots, ".", color=GREY, markersize=3.0, alpha=0.35, markeredgewidth=0, rasterized=True)
    bins = pd.qcut(pd.Series(x).rank(method="first"), min(BINS, len(x)), labels=False).to_numpy()
    groups = pd.DataFrame({"x": x, "y": y}).groupby(bins)
    at, quartiles = groups["x"].median(), groups["y"].quantile([0.25, 0.5, 0.75]).unstack()
    axes.vlines(at, quartiles[0.25], quartiles[0.75], color=INDIGO, linewidth=2.2, alpha=0.45)
    axes.plot(at, quartiles[0.5], "o", color=INDIGO, markersize=4.5, markeredgecolor="white")
    median = Line2D([], [], color=INDIGO, marker="o", linestyle="", label="median of windows")
    handles: list[Artist] = [median, *_law(axes, law)]
    own = [r for r in regions if r["signal"] == channel.signals.get(coordinate)]
    for region in own:
        axes.axvspan(region["low"], region["high"], color=YELLOW, alpha=0.35, linewidth=0, zorder=0)
    if own:
        share = sum(r["share"] for r in own)
        handles.append(Patch(color=YELLOW, alpha=0.35, label=f"{100.0 * share:.0f} % of the squared value"))
    axes.axhline(0.0, color=BLACK, linewidth=0.7)
    axes.set_xlabel(channel.axes.get(coordinate, "t (s)"))
    axes.set_ylabel(f"{channel.quantity} lacking ({channel.unit})")
    chance = number(float(rows["error"].median()))
    axes.set_title(f"standard error of a window {chance} {channel.unit}", loc="right")
    axes.grid(linewidth=0.5)
    axes.legend(handles=handles, loc="best", frameon=True, framealpha=0.85, edgecolor="none")


def _law(axes: Axes, law: pd.DataFrame) -> list[Artist]:
    """Draw the law where there is one; entries for the legend."""
    if not len(law):
        return []
    # a law of something else besides has no line along this coordinate but a band
    if float((law["high"] - law["low"]).mean()) > WIDE * float(np.ptp(law["law"])):
        axes.fill_between(law["x"], law["low"], law["high"], color=BLACK, alpha=0.22, linewidth=0, zorder=3)
    axes.plot(law["x"], law["law"], color=BLACK, linewidth=2.0, path_effects=halo(4.0), zorder=4)
    return [Line2D([], [], color=BLACK, linewidth=2.0, label="law that was found")]
