"""Draw the spectrum of the errors of free runs, before and after a diagnosis."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from scipy.signal import welch

from unmodelled.base.arrays import Array
from unmodelled.report.figures.style import absent, new_figure, styled
from unmodelled.report.figures.tables import LOOKS, about, line_handle, printed, table

#: Outputs that are shown, and panels beside each other, at most.
MOST, ACROSS = 6, 3
#: Fewest samples of a spectrum, samples of its overlapping parts, and points per decade.
FEWEST, PART, POINTS = 16, 1024, 12


@styled
def spectrum(data: Path) -> Figure:
    """Spectrum of the errors of free runs, in the experiment with the largest gap.

    Root of the power spectral density (Welch 1967). The dashed line is white noise of the sensor. The
    last model of the legend at that line means that nothing but noise remains. A peak shows a vibration
    or a disturbance of this frequency, a rise to low frequencies a slow effect. Below the dotted line,
    one over the horizon, errors are small because a new free run starts after every horizon.
    """
    content, rows = about(data), table(data, "trajectory")
    outputs = content["outputs"][:MOST]
    after = "augmented" if content["effects"] else "reidentified"
    down = -(-len(outputs) // ACROSS)
    figure = new_figure(0.7 + 2.6 * down)
    panels = figure.subplots(down, min(len(outputs), ACROSS), squeeze=False).ravel()
    for axes, output in zip(panels, outputs, strict=False):
        own = rows[rows["output"] == output["name"]]
        period = float(own["t"].diff().median())
        models = {"known": "known", after: "augmented"}
        _draw(axes, {look: _errors(own, column) for look, column in models.items()}, period)
        noise = output["noise"] * np.sqrt(2.0 * period)
        if noise > 0.0 and axes.lines:
            axes.axhline(noise, color=LOOKS["floor"].colour, linestyle="--", linewidth=1.8)
            axes.axvline(1.0 / content["horizon"], color="0.5", linestyle=":", linewidth=1.0)
        axes.set_xlabel("frequency (Hz)")
        unit = printed(output.get("error_unit", output["unit"]))
        axes.set_ylabel(f"error of {output['name']} ({unit}/√Hz)")
    for axes in panels[len(outputs) :]:
        axes.set_axis_off()
    handles = [line_handle(name) for name in ("known", after, "floor")]
    figure.legend(handles=handles, loc="outside upper center", ncols=3)
    return figure


def _errors(own: pd.DataFrame, column: str) -> Array:
    """Errors (samples,) of a model; the few samples that no run reaches are left out."""
    error = np.asarray(own[column] - own["measured"], dtype=np.float64)
    return np.asarray(error[np.isfinite(error)])


def _draw(axes: Axes, errors: dict[str, Array], period: float) -> None:
    if min(map(len, errors.values())) < FEWEST or not all(map(np.any, errors.values())):
        absent(axes, "too few samples for a spectrum")
        return
    for name, error in errors.items():
        frequency, power = welch(error, 1.0 / period, nperseg=min(PART, len(error)))
        # means, for the starts of free runs leave a line at every multiple of one over the horizon
        place = np.round(POINTS * np.log10(frequency[1:]))
        means = pd.DataFrame({"f": frequency[1:], "power": power[1:]}).groupby(place).mean()
        axes.loglog(means["f"], np.sqrt(means["power"]), color=LOOKS[name].colour, linewidth=1.8)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(lambda x, _: f"{x:g}")
        axis.set_minor_formatter(NullFormatter())
    axes.grid(linewidth=0.5)
