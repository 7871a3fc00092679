"""Draw free runs of a pendulum within and beyond the explored states."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pipeline.figures.tutorial.tables import LOOKS, line, table
from unmodelled.base.arrays import Array
from unmodelled.report.figures.style import BLACK, GREY, absent, new_figure, thin

ANGLE, SPEED, TIME = "angle θ (rad)", "angular velocity ω (rad/s)", "time t (s)"


def physics_forecast(data: Path) -> Figure:
    """Free runs of the pendulum by known physics alone: never exact, but robust beyond the explored states.

    Left: states of the training runs (grey), and a measured run that leaves them (black) with its prediction.
    Right: angle over time of two runs, simulated from the measured first state: one that stays among the
    training states, and one that leaves them; grey while the run is among them. The physics has no dry
    friction, so that the predicted swing decays at the wrong rate everywhere. Gravity acts beyond the
    training states as it does among them.
    """
    return _forecast(data, "physics")


def black_box_forecast(data: Path) -> Figure:
    """Free runs of the pendulum by a black-box network: accurate in explored states, wrong beyond them.

    A network replaces all physics except kinematics; one line per training. Left: states of the training runs
    (grey), and a measured run that leaves them (black) with its predictions. Right: angle over time of two
    runs, simulated from the measured first state; grey while the run is among the training states. The
    network has learned the friction and predicts the run among the training states better than the physics
    does. Beyond them nothing constrains the network, and every error enters the next step.
    """
    return _forecast(data, "black_box")


def hybrid_forecast(data: Path) -> Figure:
    """Free runs of the pendulum by a hybrid model: known physics, and a network for the torque that it omits.

    One line per training. Left: states of the training runs (grey), and a measured run that leaves them
    (black) with its predictions. Right: angle over time of two runs, simulated from the measured first state;
    grey while the run is among the training states. Gravity and inertia are known and stay valid beyond the
    training states; the network adds only the friction. At speeds that were not in the training data the
    friction is extrapolated, and trainings differ.
    """
    return _forecast(data, "hybrid")


def _forecast(data: Path, model: str) -> Figure:
    forecasts, errors, region = (table(data, n) for n in ("forecasts", "swing_errors", "region"))
    figure = new_figure(4.8)
    left, right = figure.subfigures(1, 2, squeeze=False, width_ratios=[1.0, 1.45])[0]
    plane, panels = left.subplots(), right.subplots(2, 1, sharex=True)
    colour = LOOKS[model].colour
    mine = forecasts[forecasts["model"] == model]
    if mine.empty:
        absent(plane, f"no model {model} was trained")
        for axes in panels:
            axes.set_axis_off()
        return figure
    for axes, group in zip(panels, ("explored", "unseen"), strict=True):
        chosen = _middle(errors[errors["group"] == group])
        rmse = errors[(errors["model"] == model) & (errors["id"] == chosen)]["rmse"]
        _over_time(axes, mine[mine["id"] == chosen], colour)
        ends = sorted({f"{rmse.min():.2g}", f"{rmse.max():.2g}"}, key=float)
        name = "stays in" if group == "explored" else "leaves"
        axes.set_title(f"a run that {name} the explored region: RMSE {' to '.join(ends)} rad")
    panels[-1].set_xlabel(TIME)
    plane.fill(region["theta"], region["omega"], color=GREY, alpha=0.3, linewidth=0)
    shown = mine[mine["id"] == chosen]
    for k, (_, run) in enumerate(shown.groupby("fold")):
        if not k:
            plane.plot(*_states(run, "_measured"), color=BLACK, linewidth=2.6)
        plane.plot(*_states(run, ""), color=colour, linewidth=1.2)
    _framed(plane, shown)
    handles = [
        Patch(color=GREY, alpha=0.3, linewidth=0, label="explored in training"),
        Line2D([], [], color=BLACK, linewidth=3.0, label="measured"),
        line(LOOKS[model].label, colour),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def _middle(errors: pd.DataFrame) -> str:
    """The run on which the physics has its middle error."""
    runs = errors[errors["model"] == "physics"].groupby("id")["rmse"].median().sort_values(kind="stable")
    return str(runs.index[(len(runs) - 1) // 2])


def _states(run: pd.DataFrame, suffix: str) -> list[Array]:
    return thin(*(run[f"{name}{suffix}"].to_numpy() for name in ("theta", "omega")), points=600)


def _over_time(axes: Axes, runs: pd.DataFrame, colour: str) -> None:
    for k, (_, run) in enumerate(runs.groupby("fold")):
        columns = (run[name].to_numpy(np.float64) for name in ("t", "theta_measured", "theta", "explored"))
        t, measured, predicted, explored = thin(*columns, points=600)
        if not k:
            where: dict[str, Any] = {"where": explored > 0.5, "transform": axes.get_xaxis_transform()}
            axes.fill_between(t, 0, 1, **where, color=GREY, alpha=0.3, linewidth=0)
            axes.plot(t, measured, color=BLACK, linewidth=3.0)
        axes.plot(t, predicted, color=colour, linewidth=1.2)
    low, high = measured.min(), measured.max()
    axes.set(ylim=(low - 0.5 * (high - low), high + 0.5 * (high - low)), xlim=(t[0], t[-1]), ylabel=ANGLE)


def _framed(axes: Axes, run: pd.DataFrame) -> None:
    """Half as much again as the measurement needs, so that a prediction that is lost leaves the frame."""
    for name, setter in (("theta", axes.set_xlim), ("omega", axes.set_ylim)):
        largest = 1.5 * float(run[f"{name}_measured"].abs().max())
        setter(-largest, largest)
    axes.set(xlabel=ANGLE, ylabel=SPEED)
    axes.grid(linewidth=0.5)
