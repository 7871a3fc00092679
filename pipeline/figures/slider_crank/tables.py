"""Tables, names, accuracies and colours, shared by the figures of the slider-crank."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from pipeline.figures.palette import INDIGO, tables_of
from unmodelled.base.arrays import Array, Mask
from unmodelled.report.figures.style import BLACK, ORANGE

RMSE = "RMSE of ω (rad/s)"
#: Share of the test signals that an interval covers, the most accurate ones.
COVERED = 0.9
#: The test signal that the dissertation shows.
EXAMPLE = "T9a"

CAMPAIGNS = {"spring": "with spring", "no_spring": "without spring"}
#: Network inputs q of the hybrid models, from those that determine the load to those that do not.
INPUTS = {
    "nnap": r"$\{d, v\}$",
    "nnap_theta_omega": r"$\{\theta, \omega\}$",
    "nnap_d_v_t": r"$\{d, v, T\}$",
    "nnap_d": r"$\{d\}$",
    "nnap_v": r"$\{v\}$",
    "nnap_theta": r"$\{\theta\}$",
    "nnap_omega": r"$\{\omega\}$",
    "nnap_t": r"$\{T\}$",
}
BASELINES = {"physics": "no network", "black_box": "black box"}
#: The slider moves away from the shaft, or back to it.
DIRECTIONS = {"v > 0": INDIGO, "v < 0": ORANGE}
#: The measured speed in legends; broad, so that the thin lines of good predictions show on it.
MEASURED = Line2D([], [], color=BLACK, linewidth=2.4, label="measured")


table = tables_of("slider_crank")


def plain(rows: pd.DataFrame, split: str = "leave_one_out") -> pd.DataFrame:
    """Return the rows of models without the additional epochs of the study of the horizon."""
    return rows[~rows["extra"].astype(bool) & (rows["split"] == split)]


def horizons(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the study of the horizon N; the feedforward model has N = 1."""
    chosen = rows["extra"].astype(bool) & (rows["split"] == "leave_one_out") & (rows["model"] == "nnap")
    return rows[chosen]


def natural(name: str) -> tuple[int, str]:
    """Return a key that sorts T2a before T10b."""
    digits = "".join(filter(str.isdigit, name))
    return int(digits or 0), name


def example(ids: Iterable[str]) -> str:
    """Return the example of the dissertation if it exists, otherwise the first id.

    Args:
        ids: ids of the experiments.

    Returns:
        Id; empty if there are no experiments.
    """
    known = sorted(set(ids), key=natural)
    return EXAMPLE if EXAMPLE in known else next(iter(known), "")


def signal_name(name: str) -> str:
    """Return the name of a signal for titles, with an index."""
    return f"$T_{{{name.removeprefix('T')}}}$"


@dataclass(frozen=True)
class Accuracy:
    """Errors of free runs over test signals and repeats."""

    rmse: Array  # (runs,), rad/s, of the runs that did not diverge, in increasing order
    mean: float  # rad/s; nan if all runs diverged
    best: float  # rad/s
    limit: float  # error below which 90 % of the runs lie, rad/s; infinite if more than 10 % diverged
    diverged: int  # number of runs


def accuracy(errors: pd.DataFrame) -> Accuracy:
    """Summarise errors; a run with an error that is not finite has diverged."""
    values = errors["rmse"].mask(errors["diverged"].astype(bool)).to_numpy(np.float64)
    everything = np.sort(np.where(np.isfinite(values), values, np.inf))
    finite = everything[np.isfinite(everything)]
    limit = float(everything[math.ceil(COVERED * len(everything) - 1e-9) - 1])
    mean = float(finite.mean()) if len(finite) else math.nan
    return Accuracy(finite, mean, float(everything[0]), limit, len(everything) - len(finite))


def number(value: float) -> str:
    """Format a number with three significant digits and a minus sign, without powers of ten."""
    if not math.isfinite(value):
        return "–"
    return (f"{value:.3g}" if abs(value) < 1e3 else f"{value:.0f}").replace("-", "−")


def plain_log_x(axes: Axes) -> None:
    """Make the horizontal axis logarithmic with round numbers instead of powers of ten."""
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(axis="x", linewidth=0.5)


def by_direction(v: Array) -> list[tuple[str, str, Mask]]:
    """Return name, colour and samples of both directions of the slider. Takes v (n,) in m/s; gives (n,)."""
    masks = (v > 0.0, v < 0.0)
    return [(name, colour, mask) for (name, colour), mask in zip(DIRECTIONS.items(), masks, strict=True)]


def framed(axes: Axes, measured: Array, margin: float = 0.25) -> None:
    """Fit the vertical axis to a measurement (n,), so that diverging predictions leave the axes."""
    low, high = float(measured.min()), float(measured.max())
    room = margin * max(high - low, 1.0)
    axes.set_ylim(low - room, high + room)
