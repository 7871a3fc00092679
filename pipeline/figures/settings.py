"""Colours of the labels, settings and angles of the machines, in figures."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, MultipleLocator

from unmodelled.report.figures.style import BLUE, GREY, VERMILION

#: The three labels keep their colours in every figure; no other quantity takes blue or vermilion lines.
LABELS = {"contact": BLUE, "jump": VERMILION, "stall": GREY}
MM = 1e3  # mm per m


def in_pi(angle: float) -> str:
    """Format an angle (rad) as a multiple of pi."""
    multiple = f"{angle / np.pi:.3g}"
    return {"0": "0", "1": "π", "-1": "−π"}.get(multiple, f"{multiple}π")


def level(factor: str, value: float) -> str:
    """Format a factor with its value and unit."""
    return {
        "V": f"V = {value:.3g} V",
        "m": f"m = {value:.2f} kg",
        "H": f"H = {MM * value:.3g} mm",
        "beta": f"β = {in_pi(value)}",
    }[factor]


def setting(run: pd.Series, factors: tuple[str, ...] = ("V", "m", "H", "beta")) -> str:
    """Format the settings of an experiment."""
    return ", ".join(level(factor, float(run[factor])) for factor in factors)


def angle_axis(axes: Axes) -> None:
    """Set the horizontal axis to one revolution, with ticks at multiples of pi/2."""
    axes.set_xlim(0.0, 2.0 * np.pi)
    axes.xaxis.set_major_locator(MultipleLocator(np.pi / 2.0))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: in_pi(x)))
