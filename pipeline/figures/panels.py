"""Draw maps of a whole campaign: one panel per cam, one cell per voltage and mass."""

from collections.abc import Iterable

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Colormap, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from pipeline.figures.examples import levels
from pipeline.figures.settings import LABELS, level
from unmodelled.base.arrays import Array
from unmodelled.report.figures.style import BLACK, halo, new_figure

Panels = dict[tuple[float, float], Axes]

STALL = Patch(color=LABELS["stall"], label="stall")


def cam_grid(experiments: pd.DataFrame, panel_height: float) -> tuple[Figure, Panels]:
    """Make one panel per cam: strokes H from bottom to top, rises beta from left to right, shared axes."""
    strokes, rises = levels(experiments, "H")[::-1], levels(experiments, "beta")
    figure = new_figure(height=0.9 + panel_height * len(strokes))
    grid = figure.subplots(len(strokes), len(rises), sharex=True, sharey=True, squeeze=False)
    for axes, beta in zip(grid[0], rises, strict=True):
        axes.set_title(level("beta", beta))
    strokes_beside(grid[:, -1], strokes)
    return figure, {(H, b): grid[i, j] for i, H in enumerate(strokes) for j, b in enumerate(rises)}


def strokes_beside(column: Iterable[Axes], strokes: Array) -> None:
    """Write every stroke (rows,), m, beside the last panel of its row."""
    for axes, H in zip(column, strokes, strict=True):
        axes.annotate(
            level("H", float(H)), (1.03, 0.5), xycoords="axes fraction", rotation=270, ha="left", va="center"
        )


def map_grid(experiments: pd.DataFrame) -> tuple[Figure, Panels]:
    """Make a `cam_grid` with axes for `cells`."""
    figure, panels = cam_grid(experiments, panel_height=1.25)
    masses = levels(experiments, "m")
    for axes in panels.values():
        axes.xaxis.set_major_locator(MaxNLocator(4))
        axes.set_yticks(masses, [f"{m:.2f}" for m in masses])
        axes.tick_params(length=2.0)
    figure.supxlabel("voltage V (V)", fontsize=10)
    figure.supylabel("follower mass m (kg)", fontsize=10)
    return figure, panels


def edges(centres: Array) -> Array:
    """Return the borders between cells in increasing order. Takes centres (n,); gives (n + 1,)."""
    if len(centres) == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    inner = (centres[:-1] + centres[1:]) / 2.0
    return np.concatenate([[2.0 * centres[0] - inner[0]], inner, [2.0 * centres[-1] - inner[-1]]])


def cells(
    panels: Panels, experiments: pd.DataFrame, values: Array, colours: Colormap, norm: Normalize
) -> QuadMesh:
    """Draw values as cells of a map, and grey cells where the bench stalls. Takes values (experiments,)."""
    V, m = levels(experiments, "V"), levels(experiments, "m")
    table = experiments[["H", "beta", "m", "V"]].assign(
        value=values, stall=np.where(experiments["label"] == "stall", 1.0, np.nan)
    )
    grey = ListedColormap([LABELS["stall"]])
    for cam, group in table.groupby(["H", "beta"]):
        axes = panels[cam]
        mean = group.groupby(["m", "V"])[["stall", "value"]].mean()
        for column, palette, scale in (("stall", grey, Normalize(0, 2)), ("value", colours, norm)):
            field = mean[column].unstack().reindex(index=m, columns=V).to_numpy(np.float64)
            mesh = axes.pcolormesh(
                edges(V),
                edges(m),
                np.ma.masked_invalid(field),
                cmap=palette,
                norm=scale,
                edgecolor="white",
                linewidth=0.4,
                rasterized=True,
            )
    return mesh


def boundary_line(panels: Panels, boundary: pd.DataFrame, masses: Array, name: str) -> Line2D:
    """Draw a voltage for every cam and mass as a line through the maps. Takes masses (rows,) in kg."""
    borders = edges(masses)
    heights = np.stack([borders[:-1], borders[1:]], axis=1).ravel()
    for cam, group in boundary.groupby(["H", "beta"]):
        Q = group.set_index("m")["Q"].reindex(masses).to_numpy(np.float64)
        panels[cam].plot(
            np.repeat(Q, 2), heights, color=BLACK, linewidth=1.8, path_effects=halo(3.6), clip_on=True
        )
    return Line2D([], [], color=BLACK, linewidth=1.8, label=name)


def finish_map(
    figure: Figure, panels: Panels, mesh: QuadMesh, line: Line2D, label: str, extend: str = "neither"
) -> Colorbar:
    """Add the bar of the colours of `cells`, and a legend of the line and of stalls."""
    bar = figure.colorbar(mesh, ax=list(panels.values()), label=label, pad=0.03, aspect=35, extend=extend)
    figure.legend(handles=[line, STALL], loc="outside upper center", ncols=2)
    return bar
