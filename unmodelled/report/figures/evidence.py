"""Draw the evidence of laws by the length of the windows."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from unmodelled.report.figures.style import GREEN, new_figure, styled
from unmodelled.report.figures.tables import about, number, table

TABLE = "evidence"
#: Laws that are shown, those that rank highest at any length.
MOST = 10
#: Characters of a line of a name.
WRAP = 38


@styled
def evidence(data: Path) -> Figure:
    """Evidence of laws, by length of the windows.

    Every law stands beside the known physics and the measurement chain, all refitted. Nats are the log
    evidence over the same fit without the law, after the price of its numbers. In brackets: share of
    the squared residual that the law removes. Where the answer names a law, it is green. Compare nats
    within one length only: longer windows hold fewer independent samples. A law that leads at both
    lengths is surer than one that leads at one.
    """
    rows, named = table(data, TABLE), set(about(data)["effects"])
    # by rank, because nats of different lengths do not compare; of equal ranks, longer windows come first
    order = rows.assign(rank=rows.groupby("horizon")["nats"].rank(ascending=False))
    order = order.sort_values(["rank", "horizon"], ascending=[True, False], kind="stable")
    labels = list(dict.fromkeys(order["label"]))[:MOST]
    lengths = sorted(rows["horizon"].unique())
    figure = new_figure(1.3 + 0.42 * len(labels))
    panels = figure.subplots(1, len(lengths), sharey=True, squeeze=False)[0]
    for axes, length in zip(panels, lengths, strict=True):
        own = rows[rows["horizon"] == length].drop_duplicates("label").set_index("label").reindex(labels)
        _bars(axes, own, [GREEN if label in named else "0.6" for label in labels])
        axes.set_title(f"windows of {number(length)} s", loc="left")
        axes.set_xlabel("evidence (nats)")
    panels[0].set_yticks(range(len(labels)), [fill(label, WRAP) for label in labels])
    panels[0].set_ylim(len(labels) - 0.4, -0.6)
    return figure


def _bars(axes: Axes, laws: pd.DataFrame, colours: list[str]) -> None:
    """A bar for each law, with its nats and share beside; a law that was not fitted has none."""
    nats = laws["nats"].to_numpy(np.float64)
    axes.barh(range(len(laws)), np.nan_to_num(nats), color=colours, height=0.62)
    axes.axvline(0.0, color="0.4", linewidth=0.8)
    for place, (value, removed) in enumerate(zip(nats, laws["removed"], strict=True)):
        text = f"{number(value)} ({100.0 * removed:.0f} %)" if np.isfinite(value) else "no fit"
        start = max(0.0, float(np.nan_to_num(value)))
        axes.annotate(
            text, (start, place), (5, 0), textcoords="offset points", va="center", fontsize=8.5, color="0.2"
        )
    low, high = min(0.0, float(np.nanmin(nats, initial=0.0))), float(np.nanmax(nats, initial=1.0))
    axes.set_xlim(low - 0.02 * (high - low), high + 0.32 * (high - low))
    axes.grid(axis="x", linewidth=0.5)
    axes.set_axisbelow(True)
