"""Draw the densities of the shifting time that follow from uncertain parameters."""

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import truncnorm

from pipeline.figures.clutch.points import PANEL, Place, area, measured, measured_handles, places
from pipeline.figures.clutch.tables import (
    DEMO,
    GAUSSIAN,
    LOOKS,
    MAXIMUM_ENTROPY,
    MONTE_CARLO,
    OPTIMA,
    about,
    alpha_text,
    area_of,
    demo_alpha,
    optima,
    table,
)
from pipeline.figures.palette import WINE
from unmodelled.base.arrays import Array
from unmodelled.report.figures.style import absent, new_figure

#: Share of the width of the bounds that is shown around them.
MARGIN = 0.04
COLUMNS = ["mu_1", "mu_2", "sigma_1", "sigma_2"]


def propagated_uncertainty(data: Path) -> Figure:
    """Shifting time over the uncertain parameters, their joint density, and the resulting densities.

    Top left: simulated shifting time of one operating point over multiples of the nominal threshold p_hc0 and
    contact position z_p; the frame is the clipping domain. Top right: a clipped joint distribution of the two
    multiples, chosen by hand. Bottom: densities of the shifting time of all operating points that follow from
    it by Monte Carlo (areas), with the measurements. The log-likelihood of all measurements says how well
    this distribution explains them.
    """
    experiments, curves = table(data, "experiments"), _curves(data, DEMO)
    experiments = experiments[experiments["id"].isin(curves["id"])]
    speeds = max(1, experiments["rpm"].nunique())
    figure = new_figure(4.4 + 0.6 + PANEL * speeds)
    ratios = [4.2, 0.6 + PANEL * speeds]
    upper, lower = figure.subfigures(2, 1, squeeze=False, height_ratios=ratios)[:, 0]
    response, shown = table(data, "response"), str(about(data).get("shown", ""))
    left, right = upper.subplots(1, 2, sharex=True, sharey=True)
    _surface(left, response)
    left.set_title(f"shifting time of operating point {shown}")
    alpha = demo_alpha(data)
    if alpha:
        _joint(right, response, alpha)
    else:
        absent(right, "no distribution was chosen to be shown")
    for axes in (left, right):
        axes.set(xlabel=r"$\vartheta_1$, threshold $p_{hc0}$ (multiples)")
    left.set_ylabel(r"$\vartheta_2$, contact $z_p$ (multiples)")
    if curves.empty:
        absent(lower.subplots(), "no distribution of this name was propagated")
        return figure
    where = places(lower, experiments)
    _areas(where, curves, {MONTE_CARLO: (-1.0, 1.0)})
    measured(where, table(data, "points"))
    lower.suptitle(f"α = {alpha_text(alpha)}: {_likelihood_text(data, DEMO, None)}")
    handles = [area_of(MONTE_CARLO), *measured_handles(where)]
    lower.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def _curves(data: Path, of: str) -> pd.DataFrame:
    rows = table(data, "densities")
    return rows[rows["alpha_of"] == of]


def _surface(axes: Axes, response: pd.DataFrame) -> None:
    field = response.pivot_table(index="z_p", columns="p_hc0", values="y")
    x, y, values = field.columns.to_numpy(float), field.index.to_numpy(float), field.to_numpy(float)
    axes.contourf(x, y, values, levels=16, cmap="viridis")
    lines = axes.contour(x, y, values, levels=8, colors="white", linewidths=0.9)
    axes.clabel(lines, fmt="%.2f s", fontsize=8)
    _box(axes, x, y)


def _box(axes: Axes, x: Array, y: Array) -> None:
    """The clipping domain, with some room around it."""
    (a, b), (c, d) = (x.min(), x.max()), (y.min(), y.max())
    axes.plot([a, b, b, a, a], [c, c, d, d, c], color=WINE, linewidth=2.4, clip_on=False)
    u, v = MARGIN * (b - a), MARGIN * (d - c)
    axes.set(xlim=(a - u, b + u), ylim=(c - v, d + v))


def _joint(axes: Axes, response: pd.DataFrame, alpha: tuple[float, ...]) -> None:
    """Product of the two clipped normal densities inside the bounds."""
    spans = [np.linspace(response[n].min(), response[n].max(), 161) for n in ("p_hc0", "z_p")]
    margins = []
    for span, mean, std in zip(spans, alpha[:2], alpha[2:], strict=True):
        low, high = (np.array([span[0], span[-1]]) - mean) / std
        margins.append(truncnorm.pdf(span, low, high, loc=mean, scale=std))
    density = np.outer(margins[1], margins[0])
    mesh = axes.contourf(*spans, density, levels=12, cmap="Blues")
    axes.figure.colorbar(mesh, ax=axes, label="joint density (-)", aspect=30, pad=0.02)
    axes.set_title(f"joint density, α = {alpha_text(alpha)}")
    _box(axes, *spans)


def _areas(where: dict[str, Place], curves: pd.DataFrame, sides: dict[str, tuple[float, float]]) -> None:
    """Densities by the methods of `sides` at every operating point, to one scale each; see `area`."""
    for name, own in curves.groupby("id"):
        scale = float(own[list(sides)].to_numpy().max())
        for method, reach in sides.items():
            y, density = own["y"].to_numpy(), own[method].to_numpy()
            area(where[str(name)], y, density, scale, reach, LOOKS[method].colour)


def _likelihood_text(data: Path, of: str, method: str | None) -> str:
    """Log-likelihoods of all points at the distribution `of`: by `method`, and by Monte Carlo."""
    rows = table(data, "monte_carlo")
    rows = rows[(rows["alpha_of"] == of) & (rows["method"] == (method or GAUSSIAN))]
    true, count = rows["reference"].sum(), f"{int(about(data).get('samples', 0)):,}".replace(",", " ")
    text = rf"$\log\mathcal{{L}}$ = {true:.1f} by Monte Carlo ({count} simulations a point)"
    if method is not None:
        estimated = true + rows["error"].sum()
        text = rf"estimated $\log\hat{{\mathcal{{L}}}}$ = {estimated:.1f}, {text}"
    return text.replace("= -", "= −")


def gaussian_optimum(data: Path) -> Figure:
    """Densities of the shifting time of all operating points at the optimum of the Gaussian method.

    Coloured, to the left: the densities that the method estimates. Grey, to the right: the true densities by
    Monte Carlo, to the same scale. Dots: measurements. Where the true density is skewed, the Gaussian density
    gives weight to shifting times that do not occur.
    """
    return _at_optimum(data, GAUSSIAN)


def maximum_entropy_optimum(data: Path) -> Figure:
    """Densities of the shifting time of all operating points at the optimum of the maximum entropy method
    with four moments.

    Coloured, to the left: the densities that the method estimates. Grey, to the right: the true densities by
    Monte Carlo, to the same scale. Dots: measurements. Densities with four moments are skewed like the true
    ones, so that estimated and true log-likelihood are close.
    """
    return _at_optimum(data, MAXIMUM_ENTROPY)


def _at_optimum(data: Path, method: str) -> Figure:
    curves, experiments = _curves(data, method), table(data, "experiments")
    experiments = experiments[experiments["id"].isin(curves["id"])]
    figure = new_figure(1.0 + PANEL * max(1, experiments["rpm"].nunique()))
    if curves.empty:
        absent(figure.subplots(), "no distribution was identified by this method")
        return figure
    where = places(figure, experiments)
    _areas(where, curves, {method: (-1.0, 0.0), MONTE_CARLO: (0.0, 1.0)})
    measured(where, table(data, "points"))
    alpha = optima(data).loc[method, COLUMNS]
    figure.suptitle(f"{OPTIMA[method]} = {alpha_text(alpha)}: {_likelihood_text(data, method, method)}")
    handles = [area_of(method), area_of(MONTE_CARLO), *measured_handles(where)]
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure
