"""Draw the duration of a diagnosis."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from pipeline.figures.palette import plain_log
from pipeline.figures.withheld.tables import KINDS, MACHINES, table
from unmodelled.report.figures.style import BLACK, new_figure, styled


@styled
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
