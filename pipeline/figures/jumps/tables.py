"""Tables, folds, and looks of models and inputs, shared by the figures of follower jumps."""

from collections.abc import Iterable
from dataclasses import dataclass

import pandas as pd
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pipeline.figures.palette import INDIGO, WINE, tables_of
from pipeline.figures.settings import setting
from unmodelled.report.figures.style import BLACK, GREEN, ORANGE, SKY, Look

#: Splits, the fold of Fig. 5.15 and 5.18, and that of the models that are explained.
UNIFORM, FACTORS, WITHOUT = "uniform", "factors", "scarce"
SCARCE, EXPLAINED = "5%", "30%"
#: What the name of a model without the settings q_s ends in.
BLIND = "_blind"

FEATURE_SETS = {
    "tau1": Look(r"$\tau^{[1]}$ encoder", ORANGE, "s"),
    "tau2": Look(r"$\tau^{[2]}$ encoder, $F^†$", SKY, "o"),
    "tau3": Look(r"$\tau^{[3]}$ encoder, $F^†$, cam", GREEN, "^"),
    "tau4": Look(r"$\tau^{[4]}$ $F^†$, linear", INDIGO, "D"),
}
SIMULATED = {
    "bounce": Look("bounce simulation", "#8C6D31", "X", "--"),
    "tau4_bounce": Look(r"$\tau^{[4]}$ on bounce simulation", WINE, "P"),
}
#: In the order of legends. The inputs of every feature set are in Fig. 5.23.
LOOKS = FEATURE_SETS | SIMULATED
SHORT = {f"tau{k}": rf"$\tau^{{[{k}]}}$" for k in (1, 2, 3, 4)}
SHORT |= {"bounce": "bounce", "tau4_bounce": r"$\tau^{[4]}$ on bounce"}

MEASURED = Line2D([], [], color=BLACK, linewidth=2.4, label="measured")


@dataclass(frozen=True)
class Input:
    """Look of an input of the networks; inputs of one kind have a common hue."""

    label: str  # on axes and in legends
    unit: str
    colour: str  # of lines and areas
    hatch: str = ""  # of areas, which distinguishes similar greys and greens
    marker: str = "o"  # one per kind, for readers who cannot distinguish the hues


INPUTS = {
    "theta": Input("θ", "rad", "#7A4B00"),
    "sin(theta)": Input("sin θ", "-", "#7A4B00"),
    "cos(theta)": Input("cos θ", "-", "#B8860B"),
    "omega": Input("ω", "rad/s", ORANGE),
    "alpha": Input("dω/dt", "rad/s²", "#F0C75E"),
    "F_dagger": Input("$F^†$", "N", INDIGO, marker="D"),
    "h": Input("h", "m", "#007A58", marker="^"),
    "dh": Input("dh/dθ", "m/rad", "#2FB088", marker="^"),
    "d2h": Input("d²h/dθ²", "m/rad²", "#96DCC3", marker="^"),
    "h_dot": Input("dh/dt", "m/s", "#AA4499", marker="v"),
    "h_ddot": Input("d²h/dt²", "m/s²", "#D79BCB", marker="v"),
    "m": Input("m", "kg", "#444444", "////", "s"),
    "H": Input("H", "m", "#888888", "////", "s"),
    "beta": Input("β", "rad", "#BDBDBD", "////", "s"),
}
#: The angle enters by its sine and cosine.
ANGLE = ("sin(theta)", "cos(theta)")


table = tables_of("jumps")


def of_fold(rows: pd.DataFrame, split: str, fold: str) -> pd.DataFrame:
    """Return the rows of one fold of a split."""
    return rows[(rows["split"] == split) & (rows["fold"] == fold)]


def models(rows: pd.DataFrame, among: Iterable[str] = LOOKS) -> list[str]:
    """Return the models of a table in the order of legends."""
    found = set(rows["model"])
    return [name for name in among if name in found]


def handle(look: Look) -> Line2D:
    """Return the legend entry of a model that is drawn with markers."""
    return Line2D([], [], color=look.colour, marker=look.marker, linestyle="", label=look.label)


def line_handle(look: Look) -> Line2D:
    """Return the legend entry of a model that is drawn as a line."""
    return Line2D([], [], color=look.colour, linestyle=look.line, linewidth=2.0, label=look.label)


def run_title(runs: pd.DataFrame, exp: int) -> str:
    """Return label and settings of a run as text."""
    run = runs.loc[runs["exp"] == exp].iloc[0]
    return f"{run['label']}: {setting(run)}"


def patch(name: str) -> Patch:
    """Return the legend entry of an input that is drawn as an area."""
    look = INPUTS[name]
    return Patch(facecolor=look.colour, hatch=look.hatch, edgecolor="white", linewidth=0, label=look.label)


def with_angle(phi: pd.DataFrame, columns: list[str]) -> pd.DataFrame:
    """Add the attributions of sin(theta) and cos(theta) as theta."""
    feature = phi["feature"].where(~phi["feature"].isin(ANGLE), "theta")
    return phi.assign(feature=feature).groupby([*columns, "feature"], as_index=False)["phi"].sum()
