"""Draw a metric of the runs of a sweep over the key that was swept."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, NullFormatter
from pandas.api.types import is_integer_dtype, is_numeric_dtype

from unmodelled.report.figures.style import NEUTRAL, new_figure, shades, styled

#: From this ratio of the largest to the smallest value on, an axis is logarithmic.
WIDE = 20.0
#: Differs between repeats of the same run.
SEED = "seed"
#: Ticks are the values themselves if they lie this far apart, as a share of the axis.
APART = 0.04


def horizontal_key(table: pd.DataFrame, swept: Sequence[str]) -> str:
    """Choose the key of the horizontal axis: numbers before names, many values before few, the seed last."""
    ranking = {key: (key != SEED, is_numeric_dtype(table[key]), table[key].nunique()) for key in swept}
    return max(ranking, key=lambda key: ranking[key], default="run")


@styled
def comparison(table: pd.DataFrame, swept: Sequence[str], metric: str, over: str) -> Figure:
    """Draw a metric of the runs of a sweep over one of the keys that were swept.

    A point is a run. A line joins the medians over the seeds of the runs that share all other swept keys; for
    names, bars mark the medians. An axis whose values span a factor of 20 or more is logarithmic.
    """
    kept = table[np.isfinite(table[metric])]
    others = [key for key in swept if key not in (over, SEED)]
    numeric = is_numeric_dtype(kept[over]) and bool(kept[over].notna().all())
    kept = kept.assign(at=_positions(kept[over], numeric), group=_groups(kept, others))
    line, marker = ("-", "") if numeric else ("", "_")
    names = list(dict.fromkeys(kept["group"]))
    colours = list(NEUTRAL) if len(names) <= len(NEUTRAL) else shades(len(names))
    figure = new_figure(4.4, 8.0)
    axes = figure.subplots()
    for name, colour in zip(names, colours, strict=False):
        mine = kept[kept["group"] == name]
        axes.plot(mine["at"], mine[metric], "o", color=colour, markersize=4.5, alpha=0.6)
        medians = mine.groupby("at")[metric].median()
        axes.plot(medians.index, medians, color=colour, linestyle=line, marker=marker, ms=18.0, label=name)
    _label(axes, kept, metric, over, numeric)
    if others:
        figure.legend(loc="outside right upper")
    return figure


def _positions(values: pd.Series, numeric: bool) -> pd.Series:
    """Numbers stand where they are, names and what has no value one after the other."""
    if numeric:
        return values.astype(float)
    return pd.Series(pd.factorize(_names(values))[0], index=values.index, dtype=float)


def _names(values: pd.Series) -> pd.Series:
    return values.astype("str").fillna("default")


def _groups(table: pd.DataFrame, keys: Sequence[str]) -> pd.Series:
    parts = [key + "=" + _names(table[key]) for key in keys]
    return parts[0].str.cat(parts[1:], sep=", ") if parts else pd.Series("", index=table.index)


def _label(axes: Axes, kept: pd.DataFrame, metric: str, over: str, numeric: bool) -> None:
    places = kept.drop_duplicates("at").sort_values("at")
    logarithmic = numeric and _wide(kept["at"])
    if logarithmic:
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
        axes.xaxis.set_minor_formatter(NullFormatter())
    if not numeric or (is_integer_dtype(kept[over]) and _apart(places["at"], logarithmic)):
        axes.set_xticks(places["at"], list(_names(places[over])))
        axes.set_xticks([], minor=True)
    if not numeric:
        axes.tick_params(axis="x", labelrotation=30)
    if _wide(kept[metric]):
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter(FormatStrFormatter("%g"))
        axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set(xlabel=over, ylabel=metric)
    axes.grid(axis="y", linewidth=0.5)


def _apart(values: pd.Series, logarithmic: bool) -> bool:
    gaps = np.diff(np.log(values) if logarithmic else values)
    return bool(len(gaps) == 0 or gaps.min() >= APART * gaps.sum())


def _wide(values: pd.Series) -> bool:
    low, high = np.min(values), np.max(values)
    return bool(low > 0.0 and high >= WIDE * low)
