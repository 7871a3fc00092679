"""Tables, looks and the range of the measured currents, shared by the figures of the tutorial."""

from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MultipleLocator

from pipeline.figures.palette import INDIGO, tables_of
from unmodelled.base.files import read_json
from unmodelled.report.figures.style import BLACK, GREEN, GREY, ORANGE, Look

LOOKS = {
    "physics": Look("physics", GREEN, "D"),
    "black_box": Look("black box", ORANGE, "s"),
    "hybrid": Look("physics + network", INDIGO, "^"),
}
CURRENT, EFFICIENCY = "armature current I (A)", "efficiency ζ (-)"
REGION = Patch(color=GREY, alpha=0.22, linewidth=0, label="measured range")
TRUTH = Line2D([], [], color=BLACK, linestyle=":", linewidth=1.4, label="true efficiency, withheld")
SAMPLES = Line2D([], [], color=BLACK, marker="o", markersize=4.5, linestyle="", label="training samples")


table = tables_of("tutorial")


def about(data: Path) -> dict[str, Any]:
    """Read the range of the measured currents (A), voltage (V), R_a (Ohm), B' (A/V) and lambda."""
    content: dict[str, Any] = read_json(data / "tables" / "tutorial" / "about.json")
    return content


def efficiencies(axes: Axes, data: Path, whole: bool) -> None:
    """Draw the measured samples over the current."""
    samples, facts = table(data, "training"), about(data)
    if whole:
        truth = table(data, "truth")
        axes.axvspan(facts["lowest"], facts["highest"], color=GREY, alpha=0.22, linewidth=0, zorder=0)
        axes.plot(truth["current"], truth["efficiency"], color=BLACK, linestyle=":", linewidth=1.4, zorder=3)
        axes.set(xlim=(truth["current"].min(), truth["current"].max()), ylim=(0.0, 1.0))
    axes.plot(samples["current"], samples["efficiency"], "o", color=BLACK, markersize=4.5, zorder=4)
    axes.xaxis.set_major_locator(MultipleLocator(5.0 if whole else 2.0))
    axes.set(xlabel=CURRENT)
    axes.grid(linewidth=0.5)


def line(label: str, colour: str) -> Line2D:
    """Return a legend entry."""
    return Line2D([], [], color=colour, linewidth=2.0, label=label)
