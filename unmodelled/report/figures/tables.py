"""Tables, looks of the models and names with units, shared by the figures of a diagnosis."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from unmodelled.base.files import read_json
from unmodelled.base.tables import read_table
from unmodelled.report.figures.style import BLACK, GREEN, GREY, ORANGE, PURPLE, SKY, Look
from unmodelled.report.numbers import unit_text

#: In the order of legends.
LOOKS = {
    "measured": Look("measured", BLACK, ".", width=3.0),
    "known": Look("as given", ORANGE, "o"),
    "reidentified": Look("re-identified", SKY, "s"),
    "augmented": Look("with the effects found", GREEN, "D"),
    "neural": Look("with networks", PURPLE, "P", "--"),
    "floor": Look("noise of the sensors", GREY, "|", "--"),
}
#: What an effort is called, by its unit.
EFFORTS = {"N": "force", "N m": "torque", "Pa": "pressure", "V": "voltage"}
#: Columns of the tables that hold texts.
TEXTS = ("channel", "experiment", "id", "kind", "label", "output", "over", "row", "column", "stage")
GAP = "gap (standard deviations of the outputs)"


def table(data: Path, name: str) -> pd.DataFrame:
    """Read a table of the diagnosis."""
    return read_table(data / "tables" / name, TEXTS)


def exists(data: Path, name: str) -> bool:
    """Return whether the diagnosis has a table."""
    return any((data / "tables").glob(f"{name}.*"))


def about(data: Path) -> dict[str, Any]:
    """Read names, units and shown experiments."""
    content: dict[str, Any] = read_json(data / "tables" / "about.json")
    return content


@dataclass(frozen=True)
class Channel:
    """Names of a channel in figures."""

    name: str  # in diagnosis.json
    quantity: str  # of a correction at this place, force for instance
    unit: str  # of that quantity, as printed
    axes: dict[str, str]  # labels of coordinates, by column
    signals: dict[str, str]  # names of coordinates in diagnosis.json, by column

    @classmethod
    def of(cls, content: dict[str, Any], name: str) -> Channel:
        """Read an entry of about.json."""
        entry = content["channels"][name]
        kind, unit = entry["kind"], entry["unit"]
        quantity = EFFORTS.get(unit, "effort") if kind == "port" else entry["name"]
        coordinates = {k: entry[k] for k in ("level", "rate", "acceleration") if k in entry}
        axes = {k: f"{c['name']} ({printed(c['unit'])})" for k, c in coordinates.items()}
        signals = {k: c["name"] for k, c in coordinates.items()}
        return cls(name, quantity, printed(unit), axes, signals)


def printed(unit: str) -> str:
    """Format a unit with raised exponents."""
    return unit_text(unit).replace(" ", "\u2009") or "–"


def number(value: float) -> str:
    """Format a number with three significant digits and a minus sign."""
    return f"{value:.3g}".replace("-", "−") if math.isfinite(value) else "–"


def handle(name: str) -> Line2D:
    """Return the legend entry of a model that is drawn with markers."""
    look = LOOKS[name]
    return Line2D([], [], color=look.colour, marker=look.marker, linestyle="", label=look.label)


def line_handle(name: str) -> Line2D:
    """Return the legend entry of a model that is drawn as a line."""
    look, width = LOOKS[name], max(LOOKS[name].width, 1.6)
    return Line2D([], [], color=look.colour, linestyle=look.line, linewidth=width, label=look.label)


def log_gaps(axes: Axes, low: float, high: float) -> None:
    """Make the horizontal axis logarithmic, with round numbers, for gaps (standard deviations)."""
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    steps = (1.0, 2.0, 5.0) if high / low < 300.0 else (1.0,)
    axes.xaxis.set_major_locator(LogLocator(subs=steps))
    axes.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(axis="x", linewidth=0.5)
    axes.set_axisbelow(True)
