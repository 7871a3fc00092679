"""The next experiment: its inputs, and the outputs that every model predicts for it."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from unmodelled.report.figures.style import BLACK, NEUTRAL, new_figure, styled, thin
from unmodelled.report.figures.tables import printed


@styled
def next_experiment(rows: pd.DataFrame) -> Figure:
    """Inputs of the next experiment, and predicted outputs of the named model and of every alternative.

    Args:
        rows: kind (input or output), signal, unit, label of the model, t (s) and value, a row per sample.
    """
    signals = list(rows[["kind", "signal", "unit"]].drop_duplicates().itertuples(index=False, name=None))
    labels = [label for label in rows["label"].drop_duplicates() if label]
    looks = {label: (NEUTRAL[1:] + NEUTRAL[:1])[k % len(NEUTRAL)] for k, label in enumerate(labels)}
    figure = new_figure(0.9 + 0.3 * len(labels) + 1.7 * len(signals))
    panels = figure.subplots(len(signals), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (kind, signal, unit) in zip(panels, signals, strict=True):
        own = rows[(rows["kind"] == kind) & (rows["signal"] == signal)]
        for k, (label, part) in enumerate(own.groupby("label", sort=False)):
            t, value = thin(part["t"].to_numpy(np.float64), part["value"].to_numpy(np.float64))
            colour, line = looks.get(str(label), BLACK), "--" if k else "-"
            axes.plot(t, value, color=colour, linestyle=line, label=str(label) or None)
        axes.set_ylabel(f"{signal} ({printed(unit)})")
        axes.grid(linewidth=0.5)
    panels[-1].set_xlabel("t (s)")
    figure.legend(*panels[-1].get_legend_handles_labels(), loc="outside upper center", ncols=1)
    return figure
