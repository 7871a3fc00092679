"""Tables, looks of the models and bands of repeats, shared by figures of models."""

from collections.abc import Callable
from pathlib import Path

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FormatStrFormatter, LogLocator, NullFormatter, NullLocator

from unmodelled.base.arrays import Array
from unmodelled.base.parquet import read_parquet
from unmodelled.report.figures.style import BLACK, GREEN, ORANGE, PURPLE, SKY, WIDTH, Look, absent, new_figure

INDIGO, WINE = "#332288", "#882255"  # of Tol's palette, beside that of Okabe and Ito
#: In the order of legends. Blue and vermilion belong to the labels, so Tol's indigo and wine stand in.
LOOKS = {
    "lls": Look("linear least squares", PURPLE, "v"),
    "f_bb": Look("$f_{BB}$ black box", ORANGE, "s"),
    "f_h1": Look("$f_{H1}$ soft hybrid", SKY, "o"),
    "f_h2": Look("$f_{H2}$ hybrid", INDIGO, "^"),
    "motor": Look("DC motor", GREEN, "D"),
    "best": Look("DC motor + network", WINE, "P"),
    "narx": Look("NARX", "#999933", "<"),
    "rnn": Look("recurrent network", "#cc6677", ">"),
    "gp": Look("Gaussian process", "#44aa99", "h"),
    "direct": Look("direct extrapolation", "#777777", "X", "--"),
    "measured": Look("measured", BLACK, ".", width=3.0),
}


def look(model: str) -> Look:
    """Return the look of a model; an unknown model is labelled with its own name."""
    return LOOKS.get(model, Look(model, "#8c6d31", "*"))


def tables_of(topic: str) -> Callable[[Path, str], pd.DataFrame]:
    """Return the function that reads a table of a topic: data folder, name -> table."""
    return lambda data, name: read_parquet(data / "tables" / topic / f"{name}.parquet")


table = tables_of("cam_follower")


def shares(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of models of a share of the most stable runs, with the column share (%)."""
    kept = rows[rows["fold"].str.endswith("%")]
    return kept.assign(share=kept["fold"].str.rstrip("%").astype(float))


def smallest_share(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of models that were trained on the smallest share, I1."""
    kept = shares(rows)
    return kept[kept["share"] == kept["share"].min()]


def present(rows: pd.DataFrame) -> list[str]:
    """Return the models of a table in the order of legends, without the measurement."""
    order = [*LOOKS, *sorted(set(rows["model"]) - set(LOOKS))]
    return [name for name in order if name != "measured" and (rows["model"] == name).any()]


def nothing(text: str, height: float = 2.0, width: float = WIDTH) -> Figure:
    """Return an empty figure with a reason."""
    figure = new_figure(height, width)
    absent(figure.subplots(), text)
    return figure


def handle(model: str) -> Line2D:
    """Return the legend entry of a model."""
    style = look(model)
    line = Line2D([], [], color=style.colour, marker=style.marker, label=style.label)
    line.set(linestyle=style.line, linewidth=style.width)
    return line


def band(axes: Axes, model: str, points: pd.DataFrame, x: str, y: str) -> None:
    """Draw the median over the repeats as a line, and the inner half of the repeats as a band."""
    style = look(model)
    quartiles = points.groupby(x)[y].quantile([0.25, 0.5, 0.75]).unstack()
    at = quartiles.index.to_numpy()
    axes.fill_between(at, quartiles[0.25], quartiles[0.75], color=style.colour, alpha=0.22, linewidth=0)
    axes.plot(
        at,
        quartiles[0.5],
        color=style.colour,
        marker=style.marker,
        linestyle=style.line,
        markersize=5.5,
        markeredgecolor="white",
        markeredgewidth=0.6,
        label=style.label,
    )


def plain_log(axes: Axes) -> None:
    """Write round numbers instead of powers of ten beside a logarithmic axis of few decades."""
    low, high = axes.get_ylim()
    steps = (1.0, 2.0, 5.0) if high / low > 8.0 else tuple(range(1, 10))
    axes.yaxis.set_major_locator(LogLocator(subs=steps))
    axes.yaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.grid(axis="y", linewidth=0.5)


def listed_x(axes: Axes, values: Array) -> None:
    """Make the horizontal axis logarithmic, with ticks at `values` (n,) as plain numbers."""
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(FixedLocator(values.tolist()))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.xaxis.set_minor_formatter(NullFormatter())


def by_share(errors: pd.DataFrame, column: str, ylabel: str) -> Figure:
    """Draw a band of repeats for every model over the share of the contact runs that it was trained on."""
    figure = new_figure(4.4, 8.5)
    axes = figure.subplots()
    for model in present(errors):
        band(axes, model, errors[errors["model"] == model], "share", column)
    axes.set(yscale="log", xlabel="share of the contact runs trained on (%)", ylabel=ylabel)
    axes.set_xticks(sorted(errors["share"].unique()))
    plain_log(axes)
    figure.legend(loc="outside right upper")
    return figure
