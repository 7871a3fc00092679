"""Draw the withheld check, diagnoses of machines with known faults; see `pipeline.figures`."""

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from pipeline.figures.palette import INDIGO, WINE, nothing, plain_log, tables_of
from unmodelled.report.figures.style import (
    BLACK,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    Look,
    absent,
    new_figure,
)

MACHINES = {
    "slider_crank": Look("slider-crank", ORANGE, "s"),
    "cam_drive": Look("cam drive", SKY, "o"),
    "hoist": Look("hoist", GREEN, "^"),
    "belt_axis": Look("belt axis", INDIGO, "D"),
    "pendulum": Look("pendulum", PURPLE, "v"),
}
#: Who finds an effect, see `scores.detection`.
FINDERS = {
    "oracle": Look("can be seen (oracle)", BLACK, "o", "--"),
    "in_set": Look("named, or said to be indistinguishable", WINE, "s"),
    "top1": Look("named first", INDIGO, "^"),
    "sparse_regression": Look("sparse regression", GREY, "X"),
}
KINDS = {
    "single": "one effect",
    "local": "one effect in some of the runs",
    "pair": "two effects",
    "null": "none",
    "outside": "an effect of no family",
}


table = tables_of("withheld")


def readable(name: str) -> str:
    """Format the name of a family or verdict as words."""
    return name.replace("_", " ")


def amplitude_detection(data: Path) -> Figure:
    """Share of single effects that are found, over their level.

    A level of one is an effect of typical size for its machine. Bars: 95 % intervals (Wilson). The oracle is
    given family and channel and only fits the parameters; an effect that it cannot detect on held-out
    experiments cannot be detected by any method. Sparse regression of accelerations is the baseline. All
    single cases count, detectable or not.
    """
    rows = table(data, "detection")
    if rows.empty:
        return nothing("there is no case with a single effect", 4.4)
    figure = new_figure(4.4)
    axes = figure.subplots()
    for k, (name, look) in enumerate(FINDERS.items()):
        mine = rows[rows["what"] == name]
        # side by side, so that no interval hides another one
        level = np.sqrt(mine["from"] * mine["to"]) * 1.02 ** (k - 1.5)
        share, ends = 100.0 * mine["share"], 100.0 * mine[["low", "high"]].to_numpy().T
        bars = np.abs(ends - share.to_numpy())
        axes.errorbar(level, share, yerr=bars, color=look.colour, linewidth=0.8, linestyle="none")
        axes.plot(level, share, look.marker, color=look.colour, linestyle=look.line, label=look.label)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes.set_xticks([0.3, 0.5, 1.0, 2.0, 3.0])
    axes.minorticks_off()
    axes.set(xlabel="level of the effect (typical sizes)", ylabel="found (% of cases)", ylim=(0.0, 103.0))
    axes.grid(linewidth=0.5)
    figure.legend(loc="outside lower center", ncols=len(FINDERS))
    return figure


#: Verdicts that name no effect, after the families; the rare one has a column only where it occurs.
NOTHING, RARE = ("unknown", "no_gap"), "check_logs"


def confusion_matrix(data: Path) -> Figure:
    """Family that the diagnosis names first, against the planted family.

    A cell gives the number of cases, its colour their share of the row. Single effects, in all or in some of
    the runs, that a fit with the known truth can detect. Cells beside the diagonal are wrong, unless the logs
    of the machine cannot distinguish the two families. The last columns are cases in which no effect is
    named.
    """
    counts = table(data, "confusion")
    if counts.empty:
        return nothing("no planted effect can be seen", 8.4)
    figure = new_figure(8.4)
    axes = figure.subplots()
    said = {*counts["family"], *counts["first_family"]}
    families = sorted(said - {*NOTHING, RARE})
    columns = [*families, *NOTHING, *({RARE} & said)]
    wide = counts.pivot(index="family", columns="first_family", values="cases")
    wide = wide.reindex(index=[f for f in families if f in wide.index], columns=columns).fillna(0.0)
    shares = wide.div(wide.sum(axis=1), axis=0)
    colours = LinearSegmentedColormap.from_list("wine", ["white", WINE])
    axes.pcolormesh(shares, cmap=colours, vmin=0.0, vmax=1.0, edgecolor="0.9", linewidth=0.5)
    _numbers(axes, wide, shares)
    axes.axvline(len(families), color="black", linewidth=1.0)
    names = [readable(name) for name in columns]
    axes.set_xticks(np.arange(len(columns)) + 0.5, names, rotation=60, ha="right", rotation_mode="anchor")
    axes.set_yticks(np.arange(len(wide)) + 0.5, [readable(str(name)) for name in wide.index])
    axes.invert_yaxis()
    axes.tick_params(length=0.0)
    axes.set(xlabel="named first (family)", ylabel="planted (family)")
    return figure


def _numbers(axes: Axes, wide: pd.DataFrame, shares: pd.DataFrame) -> None:
    for (i, j), count in np.ndenumerate(wide.to_numpy()):
        if count > 0:
            colour = "white" if shares.iat[i, j] > 0.5 else "black"
            axes.text(j + 0.5, i + 0.5, f"{count:.0f}", ha="center", va="center", color=colour, fontsize=8)


def calibration_curve(data: Path) -> Figure:
    """Share of right answers over the stated confidence of the diagnosis.

    Cases of all kinds in bins of width 0.1; the area of a marker is the number of cases, the bar the 95 %
    interval (Wilson). On the line, answers with a confidence of 90 % are right in 90 % of the cases. Below
    the line the diagnosis is overconfident.
    """
    rows = table(data, "calibration")
    if rows.empty:
        return nothing("there is no case", 4.6, 5.6)
    figure = new_figure(4.6, 5.6)
    axes = figure.subplots()
    axes.axline((0.0, 0.0), slope=1.0, color=GREY, linewidth=1.4, zorder=1)
    bars = np.abs(rows[["low", "high"]].to_numpy().T - rows["right"].to_numpy())
    axes.errorbar(rows["confidence"], rows["right"], yerr=bars, color=INDIGO, linewidth=1.0, linestyle="none")
    size = 20.0 + 280.0 * rows["cases"] / rows["cases"].sum()
    axes.scatter(rows["confidence"], rows["right"], size, color=INDIGO, zorder=3, edgecolor="white")
    for place in rows.itertuples():
        axes.annotate(f"{place.cases}", (place.confidence, place.right), (9, -9), textcoords="offset points")
    axes.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), aspect="equal")
    axes.set(xlabel="stated confidence (-)", ylabel="right answers (share of cases)")
    axes.grid(linewidth=0.5)
    return figure


WITH_EFFECTS = ("single", "local", "pair")


def shrink_against_oracle(data: Path) -> Figure:
    """Shrink of the gap by the diagnosed effects, and by a network, against that by the planted effects.

    A marker is a case with detectable effects: one, two, or one in some of the runs. At 100 % the gap of the
    re-identified physics is closed down to the noise of the sensors, on held-out experiments. On the line the
    diagnosis equals a fit that is given family and channel. Filled: the answer is right; open: it is wrong.
    Right: a network in every port instead of laws, which gives no explanation.
    """
    rows = table(data, "cases")
    rows = rows[rows["kind"].isin(WITH_EFFECTS) & rows["seen"]]
    figure = new_figure(4.9)
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    if rows.empty:
        for axes in panels:
            absent(axes, "no planted effect can be seen")
        return figure
    for axes, column, title in zip(
        panels, ("shrink", "network_shrink"), ("diagnosis", "network in every port"), strict=True
    ):
        axes.axline((0.0, 0.0), slope=1.0, color=GREY, linewidth=1.4, zorder=1)
        _cases(axes, rows, column)
        mean = 100.0 * (rows[column] / rows["oracle_shrink"].where(rows["oracle_shrink"] > 0.0)).clip(
            upper=1.0
        )
        axes.set_title(f"{title}: {mean.mean():.0f} % of the oracle's, on average")
        axes.set(xlabel="shrink with the planted effects (%)", aspect="equal")
        axes.set(xlim=(-4.0, 104.0), ylim=(-4.0, 104.0))
        axes.set_axisbelow(True)
        axes.grid(linewidth=0.5)
    panels[0].set_ylabel("shrink (%)")
    handles, labels = panels[1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(MACHINES))
    return figure


def _cases(axes: Axes, rows: pd.DataFrame, column: str) -> None:
    for name, look in MACHINES.items():
        mine = rows[rows["system"] == name]
        # a network names nothing that could be right
        filled = mine["right"] | (column != "shrink")
        for shown, face in ((filled, look.colour), (~filled, "none")):
            some = mine[shown]
            x, y = 100.0 * some["oracle_shrink"], 100.0 * some[column]
            label = look.label if face != "none" else None
            axes.scatter(
                x, y, 30, marker=look.marker, facecolor=face, edgecolor=look.colour, label=label, alpha=0.8
            )


def run_time(data: Path) -> Figure:
    """Time of a diagnosis on one core, by kind of planted effect.

    A marker is a case, from reading its logs to writing diagnosis.json; the bar is the median. A campaign has
    6 to 16 runs of about 2 s, 10 000 to 60 000 samples in all.
    """
    rows = table(data, "cases")
    kinds = [kind for kind in KINDS if (rows["kind"] == kind).any()]
    figure = new_figure(4.4)
    axes = figure.subplots()
    rng = np.random.default_rng(0)
    for name, look in MACHINES.items():
        mine = rows[rows["system"] == name]
        place = mine["kind"].map(kinds.index).to_numpy(np.float64) + rng.uniform(-0.3, 0.3, len(mine))
        axes.plot(place, mine["seconds"], look.marker, color=look.colour, label=look.label, alpha=0.75)
    for k, kind in enumerate(kinds):
        median = rows.loc[rows["kind"] == kind, "seconds"].median()
        axes.plot([k - 0.4, k + 0.4], [median, median], color=BLACK, linewidth=2.0, zorder=4)
    axes.set_yscale("log")
    plain_log(axes)
    axes.set_xticks(range(len(kinds)), [KINDS[kind] for kind in kinds])
    axes.set(xlabel="planted (kind of case)", ylabel="time of a diagnosis (s)")
    figure.legend(loc="outside lower center", ncols=len(MACHINES))
    return figure
