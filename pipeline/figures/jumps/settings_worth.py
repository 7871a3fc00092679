"""Draw what the settings of the machine are worth to the networks."""

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from pipeline.figures.jumps.tables import BLIND, FEATURE_SETS, SCARCE, UNIFORM, WITHOUT, of_fold, table
from pipeline.figures.palette import nothing
from unmodelled.base.arrays import Array
from unmodelled.report.figures.style import BLACK, Look, new_figure

#: Of a histogram.
BARS = 31


def without_settings(data: Path) -> Figure:
    """Change of the MSE of jump runs when the networks are not given the settings m, H and β.

    All jump runs outside the training data, which holds 5 % of the runs; median prediction of the repeats. To
    the right of zero the network without settings has the larger error. Black lines: quartiles, the median
    solid. Physics features are computed from the settings, so that networks with them should lose little, and
    networks with raw measurements much. The axis is linear close to zero and logarithmic beyond; bars have
    equal width on it.
    """
    rows = table(data, "runs")
    blind, informed = of_fold(rows, WITHOUT, SCARCE), of_fold(rows, UNIFORM, SCARCE)
    changes = {name: _change(informed, blind, name) for name in FEATURE_SETS}
    changes = {name: change for name, change in changes.items() if len(change)}
    if not changes:
        return nothing("no model was trained with and without the settings, or no run jumps")
    every = np.concatenate([change["change"] for change in changes.values()])
    # linear about zero as far as half of the changes reach
    width = max(float(np.median(np.abs(every))), 1e-9)
    low, high = np.arcsinh(every.min() / width), np.arcsinh(every.max() / width)
    edges = width * np.sinh(np.linspace(low, high, BARS + 1))
    figure = new_figure(1.0 + 1.35 * len(changes))
    panels = figure.subplots(len(changes), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axes, (name, change) in zip(panels, changes.items(), strict=True):
        _histogram(axes, change, edges, FEATURE_SETS[name])
        _stretched(axes, width)
        axes.set_xlim(edges[0], edges[-1])
    panels[-1].set_xlabel("MSE without settings − MSE with settings (mm²)")
    return figure


def _change(informed: pd.DataFrame, blind: pd.DataFrame, name: str) -> pd.DataFrame:
    """MSE of every jump run with and without settings, mm^2, and the change."""
    first = informed[(informed["model"] == name) & (informed["label"] == "jump")]
    second = blind[blind["model"] == name + BLIND]
    both = first.merge(second, on="exp", suffixes=("", BLIND))
    return both.assign(change=both["mse" + BLIND] - both["mse"])


def _histogram(axes: Axes, change: pd.DataFrame, edges: Array, look: Look) -> None:
    axes.hist(change["change"], edges.tolist(), color=look.colour)
    quartiles = change["change"].quantile([0.25, 0.5, 0.75])
    for quartile, line in zip(quartiles, ("--", "-", "--"), strict=True):
        axes.axvline(quartile, color=BLACK, linewidth=2.0, linestyle=line)
    told, blind = (_number(change[name].median()) for name in ("mse", "mse" + BLIND))
    change_text = f"median change {_number(quartiles[0.5], sign='+')} mm²"
    axes.set_title(f"{look.label}: {change_text}; median MSE {told} mm², without settings {blind} mm²")
    axes.set_ylabel("jump runs (-)")


def _number(value: float, sign: str = "") -> str:
    return f"{value:{sign}.2g}".replace("-", "−")


def _stretched(axes: Axes, width: float) -> None:
    """A horizontal axis that is linear within `width` of zero and logarithmic beyond, with round numbers."""
    axes.set_xscale("asinh", linear_width=width)
    decades = 10.0 ** np.arange(np.ceil(np.log10(width)), 9.0)
    axes.xaxis.set_major_locator(FixedLocator([*-decades[::-1], 0.0, *decades]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}".replace("-", "−")))
