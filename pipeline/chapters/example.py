"""The univariate example of section 3.2.8: polynomial chaos, moments and densities beside the exact ones."""

from typing import Any

import numpy as np
import pandas as pd

from pipeline.uncertainty.moments import standardised
from pipeline.uncertainty.references import earth_mover_distance, monotone_density
from unmodelled.base.arrays import Array
from unmodelled.uncertainty.chaos import Chaos, Expansion
from unmodelled.uncertainty.density import Density, GaussianDensity
from unmodelled.uncertainty.families import ClippedNormal
from unmodelled.uncertainty.maximum_entropy import MaximumEntropy

FAMILY = ClippedNormal(-2.0, 5.0)
ALPHA = np.array([[0.0, 2.0]])
#: Quadrature orders and degrees of figures 3.4 and 3.5, and the setting of the text's numbers.
ORDERS = (2, 3, 4, 5, 6, 8, 10, 15)
DEGREES = (2, 3, 4, 5)
TEXT = (4, 5)
#: Order from which nothing changes any more; coefficients shown; moments that are matched.
FINE, SHOWN, MOMENTS = 120, 6, 4
#: Of Fig. 3.3, and of the samples of the polynomials in Fig. 3.4.
DRAWS, SAMPLES = 50, 10_000
CURVE = 401


def response(theta: Array) -> Array:
    """Return the response y(x = 1; theta). Takes theta (any shape); gives (shape of `theta`)."""
    value: Array = np.tan(theta / 8.0) + np.exp(theta / 6.0 - 1.0) + np.tanh(theta / 2.0)
    return value


def expansion(degree: int, order: int) -> Expansion:
    """Return the Hermite chaos of the clipped normal distribution."""
    chaos = Chaos((FAMILY,), degree, order)
    return chaos.expand(ALPHA, response(chaos.nodes(ALPHA)))


def exact_moments() -> Array:
    """Return the raw moments of Y under the density of theta; gives (MOMENTS,)."""
    nodes, weights = np.polynomial.legendre.leggauss(FINE)
    half = (FAMILY.high - FAMILY.low) / 2.0
    theta = FAMILY.low + half * (nodes + 1.0)
    mass = half * weights * FAMILY.density(theta, ALPHA[0])
    return np.array([mass @ response(theta) ** m for m in range(1, MOMENTS + 1)])


def from_raw(raw: Array, support: Array | None = None) -> tuple[GaussianDensity, MaximumEntropy]:
    """Return the Gaussian and maximum-entropy density of raw moments (MOMENTS,), on a support (1, 2)."""
    mean, std, moments = standardised(np.concatenate([[1.0], raw])[:, None])
    return GaussianDensity(mean, std), MaximumEntropy.fit(mean, std, moments, support)


def tables() -> dict[str, pd.DataFrame]:
    """Return the tables of figures 3.3 to 3.5, by name."""
    exact = monotone_density(response, FAMILY, ALPHA)
    fits, curves = _fits(exact)
    return {
        "example_densities": _densities(exact),
        "example_draws": _draws(),
        "example_coefficients": _coefficients(),
        "example_moments": _moments(),
        "example_fits": fits,
        "example_curves": curves,
    }


def _densities(exact: Density) -> pd.DataFrame:
    """quantity (theta, y), value, density; and y at every theta."""
    theta = np.linspace(FAMILY.low, FAMILY.high, CURVE)
    low, high = exact.window()[0]
    y = np.linspace(low, high, CURVE)
    return pd.DataFrame(
        {
            "theta": theta,
            "response": response(theta),
            "density_of_theta": FAMILY.density(theta, ALPHA[0]),
            "y": y,
            "density_of_y": exact.density(y[:, None])[:, 0],
        }
    )


def _draws() -> pd.DataFrame:
    theta = FAMILY.quantile(np.random.default_rng(0).random(DRAWS), ALPHA[0])
    return pd.DataFrame({"theta": theta, "y": response(theta)})


def _coefficients() -> pd.DataFrame:
    """order, index, value, truth: all coefficients that a quadrature order tells apart."""
    truth = expansion(SHOWN - 1, FINE).coefficients[:, 0]
    rows = [
        (order, i, float(value), float(truth[i]))
        for order in ORDERS
        for i, value in enumerate(expansion(min(order, SHOWN) - 1, order).coefficients[:, 0])
    ]
    return pd.DataFrame(rows, columns=["order", "index", "value", "truth"])


def _moments() -> pd.DataFrame:
    """degree, order, moment, source (coefficients, sampled polynomial), value, truth."""
    truth, phi = exact_moments(), np.random.default_rng(1).standard_normal((SAMPLES, 1))
    rows: list[tuple[Any, ...]] = []
    for degree in DEGREES:
        for order in (q for q in ORDERS if q > degree):
            found = expansion(degree, order)
            drawn = found(phi)[:, 0]
            for m, own in enumerate(found.moments(MOMENTS)[:, 0], start=1):
                rows.append((degree, order, m, "coefficients", own, truth[m - 1]))
                rows.append((degree, order, m, "sampled", float(np.mean(drawn**m)), truth[m - 1]))
    return pd.DataFrame(rows, columns=["degree", "order", "moment", "source", "value", "truth"])


def _fits(exact: Density) -> tuple[pd.DataFrame, pd.DataFrame]:
    """degree, order (0, 0: exact moments), density, emd, fallback; and the curves of the best ones."""
    rows: list[tuple[Any, ...]] = []
    low, high = exact.window()[0]
    y = np.linspace(low, high, CURVE)[:, None]
    best: dict[str, tuple[float, Density]] = {}
    reference = from_raw(exact_moments())
    settings = [(d, q) for d in DEGREES for q in ORDERS if q > d]
    for degree, order in [(0, 0), *settings]:
        made = reference if degree == 0 else from_raw(expansion(degree, order).moments(MOMENTS)[:, 0])
        for name, density in zip(("gaussian", "maximum_entropy"), made, strict=True):
            emd = float(earth_mover_distance(density, exact)[0])
            failed = bool(isinstance(density, MaximumEntropy) and density.fallback[0])
            rows.append((degree, order, name, emd, failed))
            if degree and (name not in best or emd < best[name][0]):
                best[name] = emd, density
    curves = {"y": y[:, 0], "exact": exact.density(y)[:, 0]}
    curves |= {name: density.density(y)[:, 0] for name, (_, density) in best.items()}
    for name, density in zip(("gaussian", "maximum_entropy"), reference, strict=True):
        curves[f"{name}_reference"] = density.density(y)[:, 0]
    columns = ["degree", "order", "density", "emd", "fallback"]
    return pd.DataFrame(rows, columns=columns), pd.DataFrame(curves)


def leaves() -> dict[str, Any]:
    """Return the leaves example.coefficients, example.moments, example.emd."""
    exact, degree, order = monotone_density(response, FAMILY, ALPHA), *TEXT
    raw, support = exact_moments(), exact.window()
    wide, narrow = from_raw(raw)[1], from_raw(raw, support)[1]
    chaos = expansion(degree, order)

    def numbers(values: Array) -> dict[str, Any]:
        return {str(i): {"value": float(v), "unit": "-"} for i, v in enumerate(values)}

    return {
        "coefficients": {
            "exact": numbers(expansion(SHOWN - 1, FINE).coefficients[:, 0]),
            f"d{degree}_q{order}": numbers(chaos.coefficients[:, 0]),
        },
        "moments": {
            "exact": numbers(np.concatenate([[1.0], raw])),
            f"d{degree}_q{order}": numbers(np.concatenate([[1.0], chaos.moments(MOMENTS)[:, 0]])),
        },
        "emd": {
            name: {"value": float(earth_mover_distance(density, exact)[0]), "unit": "-"}
            for name, density in {
                "gaussian": from_raw(raw)[0],
                "maximum_entropy": wide,
                "maximum_entropy_on_support": narrow,
            }.items()
        },
    }
