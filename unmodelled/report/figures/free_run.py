"""Free runs of one experiment beside what was measured."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from unmodelled.report.figures.style import new_figure, styled, thin
from unmodelled.report.figures.tables import LOOKS, printed

#: Letters of a name that fit beside a panel together with its unit.
LONG = 12


@styled
def measured_and_simulated(rows: pd.DataFrame, units: Mapping[str, tuple[str, str]], title: str) -> Figure:
    """Measured and simulated outputs of one experiment, a row of panels per output.

    Left, the outputs; a free run starts at the measured state and sees the inputs only, a new one every
    horizon. Right, the simulated minus the measured output.
    """
    figure = new_figure(0.9 + 1.9 * len(units))
    grid = figure.subplots(len(units), 2, sharex=True, squeeze=False)
    for (left, right), (name, (unit, of_errors)) in zip(grid, units.items(), strict=True):
        columns = [rows[c].to_numpy(np.float64) for c in ("t", f"{name}_measured", f"{name}_simulated")]
        t, measured, simulated = thin(*columns)
        left.plot(t, measured, color=LOOKS["measured"].colour, linewidth=3.0, label="measured")
        left.plot(t, simulated, color=LOOKS["known"].colour, linewidth=1.6, label="simulated")
        between = "\n" if len(name) > LONG else " "
        left.set_ylabel(f"{name}{between}({printed(unit)})")
        right.plot(t, simulated - measured, color=LOOKS["known"].colour, linewidth=1.0)
        right.set_ylabel(f"error of{between}{name}{between}({printed(of_errors)})")
        for axes in (left, right):
            axes.grid(linewidth=0.5)
    for axes in grid[-1]:
        axes.set_xlabel("t (s)")
    grid[0, 0].set_title(title)
    grid[0, 1].set_title("simulated − measured")
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure
