"""Tables, looks of the methods and axes, shared by the figures of the wet clutch."""

from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pipeline.figures.palette import INDIGO
from unmodelled.base.files import read_json
from unmodelled.base.parquet import read_parquet
from unmodelled.report.figures.style import BLACK, GREEN, GREY, ORANGE, Look

#: The campaign of all figures that do not compare campaigns.
CAMPAIGN = "clutch"
GAUSSIAN, MAXIMUM_ENTROPY, PUSH_FORWARD = "gaussian", "maximum_entropy", "push_forward"
MONTE_CARLO, SAMPLED = "monte_carlo", "_sampled"
#: The methods of the dissertation, in the order of legends.
CHAOS = (GAUSSIAN, MAXIMUM_ENTROPY)
#: Collocation points of polynomial chaos of two parameters, five along each.
COLLOCATION = 25
#: The distribution (mu_1, mu_2, sigma_1, sigma_2) that section 3.4.1 propagates, `demo` in the tables.
DEMO = "demo"
MS = 1e3  # ms per s

LOOKS = {
    MONTE_CARLO: Look("Monte Carlo", GREY, "."),
    GAUSSIAN: Look("Gaussian", ORANGE, "s"),
    MAXIMUM_ENTROPY: Look("maximum entropy", INDIGO, "^"),
    PUSH_FORWARD: Look("exact push-forward", GREEN, "D"),
    GAUSSIAN + SAMPLED: Look("Gaussian, sampled moments", ORANGE, "s", "--"),
    MAXIMUM_ENTROPY + SAMPLED: Look("maximum entropy, sampled moments", INDIGO, "^", "--"),
}
#: Optima in titles, by the method that found them.
OPTIMA = {GAUSSIAN: r"$\alpha^*_G$", MAXIMUM_ENTROPY: r"$\alpha^*_{ME}$", PUSH_FORWARD: r"$\alpha^*$"}
PARAMETERS = {
    "mu_1": r"$\mu_1$ of $p_{hc0}$ (multiples)",
    "mu_2": r"$\mu_2$ of $z_p$ (multiples)",
    "sigma_1": r"$\sigma_1$ of $p_{hc0}$ (multiples)",
    "sigma_2": r"$\sigma_2$ of $z_p$ (multiples)",
}


def table(data: Path, name: str, campaign: str | None = CAMPAIGN) -> pd.DataFrame:
    """Read a table of the wet clutch."""
    rows = read_parquet(data / "tables" / "clutch" / f"{name}.parquet")
    if campaign is None or "campaign" not in rows:
        return rows
    return rows[rows["campaign"] == campaign].drop(columns="campaign").reset_index(drop=True)


def about(data: Path) -> dict[str, Any]:
    """Read the settings of the assessment: samples, planted, truth and shown."""
    content = read_json(data / "tables" / "clutch" / "about.json")
    own: dict[str, Any] = content.get(CAMPAIGN, {}) if isinstance(content, dict) else {}
    return own


def demo_alpha(data: Path) -> tuple[float, ...]:
    """Return the parameters mu_1, mu_2, sigma_1, sigma_2 that are shown beside the identified ones."""
    return tuple(about(data).get("demo") or ())


def optima(data: Path) -> pd.DataFrame:
    """Return the identified distribution parameters, one row per method and one column per parameter."""
    return table(data, "estimates").pivot(index="method", columns="name", values="value")


def methods(rows: pd.DataFrame) -> list[str]:
    """Return the methods of a table in the order of legends."""
    return [name for name in LOOKS if (rows["method"] == name).any()]


def parameter(name: str) -> str:
    """Return the axis label of a distribution parameter, with meaning and unit."""
    return PARAMETERS.get(name, f"{name} (multiples)")


def symbol(name: str) -> str:
    """Return the symbol of a distribution parameter, without meaning and unit."""
    return parameter(name).split(" ")[0]


def alpha_text(alpha: Any) -> str:
    """Format the distribution parameters (mu_1, mu_2, sigma_1, sigma_2)."""
    return "(" + ", ".join(f"{value:.2g}" if value < 0.1 else f"{value:.2f}" for value in alpha) + ")"


def line_of(method: str, label: str | None = None) -> Line2D:
    """Return the legend entry of a method that is drawn as a line."""
    look = LOOKS[method]
    return Line2D([], [], color=look.colour, linestyle=look.line, linewidth=1.8, label=label or look.label)


def area_of(method: str, label: str | None = None) -> Patch:
    """Return the legend entry of a method that is drawn as an area."""
    look = LOOKS[method]
    return Patch(facecolor=look.colour, alpha=0.75, label=label or look.label)


def dot(label: str, filled: bool = True) -> Line2D:
    """Return the legend entry of measured points."""
    face = BLACK if filled else "white"
    return Line2D([], [], color=BLACK, marker="o", mfc=face, markersize=4.5, linestyle="", label=label)
