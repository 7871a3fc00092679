"""Draw the loss of contact: predicted contact forces and boundaries beyond the training settings."""

from pathlib import Path
from textwrap import fill

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pipeline.figures.examples import levels
from pipeline.figures.palette import by_share, handle, look, present, shares, smallest_share, table
from pipeline.figures.panels import STALL, edges, strokes_beside
from pipeline.figures.settings import LABELS, in_pi, level
from unmodelled.base.arrays import Array
from unmodelled.report.figures.style import BLACK, WIDTH, halo, new_figure

SETTING = ["H", "beta", "m"]


def _line(boundary: pd.DataFrame, rises: Array) -> Array:
    """Q at every rise, V; NaN where there is none, so that a line breaks there."""
    Q = boundary.groupby("beta")["Q"].median().reindex(rises)
    return np.asarray(Q.to_numpy(), np.float64)


def _measured(axes: Axes, boundary: pd.DataFrame, rises: Array) -> None:
    """A broad line, on which the thin ones of good predictions still show."""
    truth = boundary[boundary["model"] == "measured"]
    axes.plot(rises, _line(truth, rises), color=BLACK, marker=".", markersize=10.0, linewidth=3.0)


def _small_panel(axes: Axes, rises: Array) -> None:
    """Every other tick has a label, all of them would overlap."""
    axes.set_xticks(rises, [in_pi(rise) if k % 2 == 0 else "" for k, rise in enumerate(rises)])
    axes.grid(axis="y", linewidth=0.5)


def direct_extrapolation(data: Path) -> Figure:
    """Minimal contact force, measured and extrapolated over the settings without a model of the dynamics.

    Left: measurement. The other panels: a polynomial of the settings, fitted to the minimal contact force of
    the most stable runs, whose share is in the title; dots are those runs in this slice. The slice has the
    stroke and mass with the most measured boundary points among those in the smallest share. The polynomial
    is zero on the dashed line, which stops at the border of the tested voltages; it should lie on the solid
    line, the measured boundary (section 6.3.3).
    """
    experiments, force, boundary = (table(data, name) for name in ("experiments", "force", "boundary"))
    force, (H, m) = shares(force[force["model"] == "direct"]), _slice(experiments, boundary)
    here = experiments[(experiments["H"] == H) & (experiments["m"] == m)]
    maps = {"": here.assign(f_min=here["f_min"].where(here["label"] != "stall"))}
    ordered = force.sort_values("share", kind="stable")["fold"]
    for fold in dict.fromkeys([ordered.iloc[0], ordered.iloc[-1]]):
        maps[fold] = here.drop(columns="f_min").merge(force[force["fold"] == fold], on="exp")
    limit = max(1.0, *(float(shown["f_min"].max()) for shown in maps.values()))
    figure = new_figure(4.4)
    panels = figure.subplots(1, len(maps), sharex=True, sharey=True, squeeze=False)[0]
    for axes, (fold, shown) in zip(panels, maps.items(), strict=True):
        _force_map(axes, shown, limit)
        subsets = int(fold.rstrip("%") or 0) // 10
        train = here[(here["subset"] >= 1) & (here["subset"] <= subsets)]
        axes.plot(train["beta"], train["V"], "o", color="white", markeredgecolor=BLACK, markersize=4.5)
        _slice_lines(axes, boundary[(boundary["H"] == H) & (boundary["m"] == m)], fold, levels(here, "beta"))
        title = f"extrapolated from {fold.replace('%', ' %')} of the runs" if fold else "measured"
        axes.set(title=title, xlabel="angle of rise β (rad)")
    panels[0].set_ylabel("voltage V (V)")
    colours = ScalarMappable(Normalize(-limit, limit), "RdBu")
    figure.colorbar(colours, ax=list(panels), extend="both", label="$F_{min}^{†}$ (N)", aspect=30, pad=0.01)
    title = f"slice {level('H', H)}, {level('m', m)}"
    figure.legend(handles=_map_handles(), loc="outside upper center", ncols=4, title=title)
    return figure


def _map_handles() -> list[Line2D | Patch]:
    solid = Line2D([], [], color=BLACK, marker=".", linewidth=1.8, label="measured Q")
    dashed = Line2D([], [], color=BLACK, linestyle="--", linewidth=1.8, label="extrapolated Q")
    dots = Line2D([], [], color="white", marker="o", markeredgecolor=BLACK, markersize=5, label="fitted runs")
    return [solid, dashed, dots, STALL]


def _slice(experiments: pd.DataFrame, boundary: pd.DataFrame) -> tuple[float, float]:
    """Stroke and mass with runs in I1 and the most measured boundary points, then the most runs in I1."""
    known = experiments[experiments["subset"] == 1].groupby(["H", "m"]).size().rename("runs")
    truth = boundary[boundary["model"] == "measured"].groupby(["H", "m"]).size().rename("points")
    both = pd.concat([known, truth.reindex(known.index).fillna(0)], axis=1)
    H, m = both.sort_values(["points", "runs"], kind="stable").index[-1]
    return float(H), float(m)


def _force_map(axes: Axes, points: pd.DataFrame, limit: float) -> None:
    field = points.pivot_table(index="V", columns="beta", values="f_min", dropna=False)
    borders = edges(field.columns.to_numpy()), edges(field.index.to_numpy())
    axes.pcolormesh(*borders, np.ma.masked_invalid(field), cmap="RdBu", norm=Normalize(-limit, limit))
    axes.set_facecolor(LABELS["stall"])
    axes.set_xticks(field.columns, [in_pi(rise) for rise in field.columns])


def _slice_lines(axes: Axes, lines: pd.DataFrame, fold: str, rises: Array) -> None:
    for model, style in (("measured", ".-"), ("direct", "--")):
        chosen = lines[(lines["model"] == model) & lines["fold"].isin(["", fold])]
        if len(chosen):
            axes.plot(rises, _line(chosen, rises), style, color=BLACK, linewidth=1.8, path_effects=halo(3.6))


def predicted_contact_force(data: Path) -> Figure:
    """Predicted against measured minimal contact force of the contact runs I2 to I10, trained on I1 alone.

    I1 is the most stable tenth of the contact runs, shaded; towards the left the boundary comes closer. Every
    run is simulated from standstill; a point is the median over the repeats, its bar holds the inner half of
    them, and both axes are clipped at zero, where contact is lost (eq. 6.12). On the line the prediction is
    right; a point on the floor is a run wrongly predicted to jump, a triangle at the top one beyond the axis.
    """
    experiments = table(data, "experiments")
    tested = experiments.loc[experiments["subset"] >= 2, ["exp", "f_min"]].rename(columns={"f_min": "truth"})
    points = smallest_share(table(data, "force")).merge(tested, on="exp")
    points[["f_min", "truth"]] = points[["f_min", "truth"]].clip(lower=0.0)
    models = present(points)
    known = experiments.loc[experiments["subset"] == 1, "f_min"]
    high = 1.05 * float(max(known.max(), points["truth"].max()))
    rows = -(-len(models) // 4)
    columns = -(-len(models) // rows)
    figure = new_figure(0.4 + 2.7 * rows, min(WIDTH, 0.6 + 3.0 * columns))
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for axes, model in zip(panels, models, strict=False):
        mine = points[points["model"] == model]
        _scatter(axes, mine, look(model).colour, high)
        axes.axvspan(known.min(), known.max(), color="0.9", zorder=0, linewidth=0)
        axes.plot([0.0, high], [0.0, high], color="0.35", linewidth=0.9, zorder=3)
        mae = (mine["f_min"] - mine["truth"]).abs().groupby(mine["repeat"]).mean().median()
        axes.set_title(f"{look(model).label}\nMAE {mae:.2f} N")
        axes.tick_params(labelbottom=True)
    for axes in panels[len(models) :]:
        axes.set_axis_off()
    panels[0].set(xlim=(-0.03 * high, high), ylim=(-0.03 * high, high))
    figure.supxlabel("measured $F_{min}$ (N)", fontsize=10)
    figure.supylabel("predicted $F_{min}$ (N)", fontsize=10)
    return figure


def _scatter(axes: Axes, points: pd.DataFrame, colour: str, high: float) -> None:
    quartiles = points.groupby("exp")["f_min"].quantile([0.25, 0.5, 0.75]).unstack().to_numpy()
    x = points.groupby("exp")["truth"].first().to_numpy()
    # bars hidden by their point are left out, the others are one broken line: a tenth of the file's size
    wide = quartiles[:, 2] - quartiles[:, 0] > 0.01 * high
    bars = np.where([True, False, True], quartiles[wide], np.nan)[:, [0, 2, 1]]
    axes.plot(np.repeat(x[wide], 3), bars.ravel(), color=colour, linewidth=0.7, alpha=0.45)
    axes.plot(x, quartiles[:, 1], ".", color=colour, markersize=3.5)
    above = x[quartiles[:, 1] > high]
    axes.plot(above, np.full(len(above), 0.98 * high), "^", color=colour, markersize=3.5)


def boundary_repeats(data: Path) -> Figure:
    """Measured boundary Q against the boundary predicted by every repeat of the models trained on I1 alone.

    Below Q the follower keeps contact, above it jumps. I1 is the most stable tenth of the contact runs; every
    repeat starts from other random weights, so that the closer the thin lines lie together, the less the
    prediction depends on chance. Shown is the middle mass, a row per stroke. The measured line breaks where
    the bench does not change from contact to jump; a prediction stops at the border of the tried voltages.
    """
    experiments, boundary = table(data, "experiments"), table(data, "boundary")
    masses, strokes, rises = (levels(experiments, factor) for factor in ("m", "H", "beta"))
    m = masses[len(masses) // 2]
    here = boundary[boundary["m"] == m]
    first = smallest_share(here)
    models = present(first)
    figure = new_figure(0.9 + 1.5 * len(strokes))
    grid = figure.subplots(len(strokes), len(models), sharex=True, sharey=True, squeeze=False)
    for i, H in enumerate(strokes):
        for axes, model in zip(grid[i], models, strict=True):
            mine, colour = first[(first["H"] == H) & (first["model"] == model)], look(model).colour
            _measured(axes, here[here["H"] == H], rises)
            for _, repeat in mine.groupby("repeat"):
                axes.plot(rises, _line(repeat, rises), color=colour, linewidth=0.9)
            _small_panel(axes, rises)
    for axes, model in zip(grid[0], models, strict=True):
        axes.set_title(fill(look(model).label, 14))
    repeats = Line2D([], [], color="0.5", linewidth=0.9, label="predicted Q, a line per repeat")
    _finish(figure, grid[:, -1], strokes, [handle("measured"), repeats], level("m", float(m)))
    return figure


def _finish(figure: Figure, column: Array, strokes: Array, handles: list[Line2D], title: str = "") -> None:
    """Strokes beside the last `column` of panels, shared labels and a legend."""
    strokes_beside(column, strokes)
    figure.supxlabel("angle of rise β (rad)", fontsize=10)
    figure.supylabel("boundary voltage Q (V)", fontsize=10)
    figure.legend(handles=handles, loc="outside upper center", ncols=min(4, len(handles)), title=title)


def boundary_grid(data: Path) -> Figure:
    """Measured boundary Q of all cams and masses against the median prediction of models trained on I1 alone.

    Below Q the follower keeps contact, above it jumps; the median is over the repeats. I1 is the most stable
    tenth of the contact runs: few of the cams and masses are in it at all. The measured line breaks where the
    bench does not change from contact to jump; a prediction stops at the border of the tried voltages.
    """
    experiments, boundary = table(data, "experiments"), table(data, "boundary")
    masses, strokes, rises = (levels(experiments, factor) for factor in ("m", "H", "beta"))
    first = smallest_share(boundary)
    models = present(first)
    figure = new_figure(1.1 + 1.75 * len(strokes))
    grid = figure.subplots(len(strokes), len(masses), sharex=True, sharey=True, squeeze=False)
    for (i, j), axes in np.ndenumerate(grid):
        _measured(axes, boundary[(boundary["H"] == strokes[i]) & (boundary["m"] == masses[j])], rises)
        here = (first["H"] == strokes[i]) & (first["m"] == masses[j])
        for model in models:
            style = look(model)
            Q = _line(first[here & (first["model"] == model)], rises)
            axes.plot(rises, Q, style.line, color=style.colour, marker=style.marker, markersize=3.5)
        _small_panel(axes, rises)
    for axes, m in zip(grid[0], masses, strict=True):
        axes.set_title(level("m", float(m)))
    _finish(figure, grid[:, -1], strokes, [handle("measured"), *map(handle, models)])
    return figure


def boundary_errors(data: Path) -> Figure:
    """Mean absolute error (MAE, V) of the predicted boundary Q, over the share of stable runs in the training
    data.

    The mean is over all cams and masses with a measured Q; a line is the median over the repeats, its band
    the inner half of them. Direct extrapolation fits the contact force over the settings without a model of
    the dynamics. A model with a low error on the left predicts the boundary from runs far away from it.
    """
    boundary = table(data, "boundary")
    truth = boundary.loc[boundary["model"] == "measured", [*SETTING, "Q"]]
    joined = shares(boundary).merge(truth, on=SETTING, suffixes=("", "_measured"))
    joined["mae"] = (joined["Q"] - joined["Q_measured"]).abs()
    errors = joined.groupby(["model", "share", "repeat"])["mae"].mean().reset_index()
    return by_share(errors, "mae", "MAE of Q (V)")
