"""What the figures of the slider-crank share: tables, names of models and signals, accuracies, colours."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray

from unmodelled.base.parquet import read_parquet
from unmodelled.report.figures.style import BLACK, ORANGE

Array = NDArray[np.float64]

INDIGO, WINE = "#332288", "#882255"  # of Tol's palette, beside that of Okabe and Ito
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


def table(data: Path, name: str) -> pd.DataFrame:
    """Read a table of the slider-crank from the data folder."""
    return read_parquet(data / "tables" / "slider_crank" / f"{name}.parquet")


def plain(rows: pd.DataFrame, split: str = "leave_one_out") -> pd.DataFrame:
    """Return the rows of the models as first trained, before the additional epochs of the study of the
    horizon.
    """
    return rows[~rows["extra"].astype(bool) & (rows["split"] == split)]


def horizons(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the study of the horizon N; the feedforward model is N = 1."""
    chosen = rows["extra"].astype(bool) & (rows["split"] == "leave_one_out") & (rows["model"] == "nnap")
    return rows[chosen]


def natural(name: str) -> tuple[int, str]:
    """Return a key that sorts T2a before T10b."""
    digits = "".join(filter(str.isdigit, name))
    return int(digits or 0), name


def example(ids: Iterable[str]) -> str:
    """Return the dissertation's example if `ids` has it, else the first id; empty without ids."""
    known = sorted(set(ids), key=natural)
    return EXAMPLE if EXAMPLE in known else next(iter(known), "")


def signal_name(name: str) -> str:
    """Return the name of a signal for titles, "T9a" with an index."""
    return f"$T_{{{name.removeprefix('T')}}}$"


@dataclass(frozen=True)
class Accuracy:
    """Errors of free runs over test signals and repeats, rad/s.

    Attributes:
        rmse: errors of the runs that did not diverge, increasing.
        mean: mean of `rmse`; NaN where all runs diverged.
        best, limit: the most accurate 90 % lie between; the limit is infinite where more than 10 % diverged.
        diverged: number of runs that did.
    """

    rmse: Array
    mean: float
    best: float
    limit: float
    diverged: int


def accuracy(errors: pd.DataFrame) -> Accuracy:
    """Summarise `errors`, columns rmse and diverged; a run that is not finite has diverged."""
    values = errors["rmse"].mask(errors["diverged"].astype(bool)).to_numpy(np.float64)
    everything = np.sort(np.where(np.isfinite(values), values, np.inf))
    finite = everything[np.isfinite(everything)]
    limit = float(everything[math.ceil(COVERED * len(everything) - 1e-9) - 1])
    mean = float(finite.mean()) if len(finite) else math.nan
    return Accuracy(finite, mean, float(everything[0]), limit, len(everything) - len(finite))


def number(value: float) -> str:
    """Return three significant digits, never in powers of ten, with a proper minus sign; a dash for NaN."""
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


def by_direction(v: Array) -> list[tuple[str, str, NDArray[np.bool_]]]:
    """Name, colour and samples of either direction of the slider."""
    masks = (v > 0.0, v < 0.0)
    return [(name, colour, mask) for (name, colour), mask in zip(DIRECTIONS.items(), masks, strict=True)]


def framed(axes: Axes, measured: Array, margin: float = 0.25) -> None:
    """Fit the vertical axis to the measurement: predictions that diverge leave it."""
    low, high = float(measured.min()), float(measured.max())
    room = margin * max(high - low, 1.0)
    axes.set_ylim(low - room, high + room)
