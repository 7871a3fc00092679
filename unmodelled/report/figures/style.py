"""Shared style of all figures: colours, sizes, formats of settings, and reproducible files."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from io import BytesIO, StringIO
from pathlib import Path
from typing import BinaryIO, Literal, ParamSpec

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.patheffects import Normal, Stroke

from unmodelled.base.arrays import Array

P = ParamSpec("P")

#: Palette of Okabe and Ito: told apart with every kind of colour vision.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILION, PURPLE, GREY = "#F0E442", "#0072B2", "#D55E00", "#CC79A7", "#999999"
NEUTRAL = (BLACK, GREEN, PURPLE, SKY, ORANGE)

#: Coordinates in a file, and digits beyond the second decimal.
_COORDINATES, _DIGITS = re.compile(r'(?<= )(?:d|x|y)="[^"]*"'), re.compile(r"(\.\d\d)\d+")

WIDTH = 10.0  # in, the text width of a page

#: Settings with which text stays unchanged.
_VERBATIM: dict[str, object] = {"text.parse_math": False, "svg.fonttype": "none"}
#: Matplotlib's own values of what a `matplotlibrc` sets, which it reads in the working folder, too.
_RESET: dict[str, object] = {
    name: value
    for name, value in mpl.rcParamsDefault.items()
    if name not in ("backend", *_VERBATIM) and mpl.rcParams[name] != value
}
_RC: dict[str, object] = _RESET | {
    "font.family": "DejaVu Sans",
    "font.size": 10.0,
    "axes.titlesize": 10.0,
    "axes.labelsize": 10.0,
    "xtick.labelsize": 9.0,
    "ytick.labelsize": 9.0,
    "legend.fontsize": 9.0,
    "legend.title_fontsize": 9.0,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": False,
    "grid.color": "#dddddd",
    "lines.linewidth": 1.3,
    "savefig.dpi": 150.0,
    "svg.hashsalt": "figures",
}


@dataclass(frozen=True)
class Look:
    """Look of a model in all figures; models differ in colour and marker."""

    label: str  # in legends and titles
    colour: str
    marker: str  # of matplotlib
    line: Literal["-", "--"] = "-"  # of matplotlib
    width: float = 1.3  # points


@contextmanager
def style() -> Iterator[None]:
    """Apply the settings of matplotlib with which every figure is drawn and saved."""
    with mpl.rc_context(_RC):  # type: ignore[arg-type]
        yield


@contextmanager
def verbatim() -> Iterator[None]:
    """Show all text unchanged, because names from users are not mathematics, even between dollar signs.

    Figures that are drawn and saved in this context cannot have formulas or the default labels of logarithmic
    axes. Their letters are text, which takes half the room of letters as outlines.
    """
    with mpl.rc_context(_VERBATIM):  # type: ignore[arg-type]
        yield


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Run a function that draws a figure inside `style`."""

    @wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with style():
            return draw(*args, **kwargs)

    return drawn


def save(figure: Figure, to: Path | BinaryIO) -> None:
    """Write a figure as SVG without a date; equal figures give equal files.

    Coordinates have two decimals, a hundredth of a point.
    """
    with style():  # ticks are made, with the settings of that moment, while the file is drawn
        FigureCanvasSVG(figure)  # by whose letters the layout is made
        if (layout := figure.get_layout_engine()) is not None:
            layout.execute(figure)
            figure.set_layout_engine(None)  # or savefig would draw all once more, to lay it out
        drawn = StringIO()
        figure.savefig(drawn, format="svg", metadata={"Date": None})
    text = _COORDINATES.sub(lambda found: _DIGITS.sub(r"\1", " ".join(found[0].split())), drawn.getvalue())
    text = re.sub(r"\n +", "\n", text)
    if isinstance(to, Path):
        to.write_text(text, encoding="utf-8")
    else:
        to.write(text.encode())


def svg(figure: Figure) -> bytes:
    """Return the SVG file of a figure, as `save` writes it."""
    file = BytesIO()
    save(figure, file)
    return file.getvalue()


class Drawing(Figure):
    """A figure that a notebook shows as `save` writes it."""

    def _repr_svg_(self) -> str:
        with verbatim():
            return svg(self).decode()


def new_figure(height: float, width: float = WIDTH) -> Figure:
    """Return an empty figure whose parts never overlap."""
    return Drawing(figsize=(width, height), layout="constrained")


def shades(n: int) -> list[tuple[float, float, float, float]]:
    """Return colours from dark to light for the levels of a factor."""
    return [tuple(mpl.colormaps["viridis"](x)) for x in np.linspace(0.0, 0.82, max(n, 2))[:n]]


def halo(width: float) -> list[Stroke | Normal]:
    """Return a white outline, which makes a black line visible on every background."""
    return [Stroke(linewidth=width, foreground="white"), Normal()]


def signed(value: float) -> str:
    """Format a number with two decimals and a minus sign."""
    return f"{value:.2f}".replace("-", "−")


def thin(*arrays: Array, points: int = 1500) -> list[Array]:
    """Return every k-th sample of arrays (n,), so that about `points` samples (n / k,) remain."""
    step = max(1, -(-len(arrays[0]) // points))
    return [array[::step] for array in arrays]


def absent(axes: Axes, text: str) -> None:
    """Write the reason for an empty panel into it."""
    axes.set_axis_off()
    axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes, color="0.4")
