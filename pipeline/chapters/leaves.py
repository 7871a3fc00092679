"""Numbers with their uncertainty, as metrics files contain them."""

from typing import Any

import numpy as np

from unmodelled.base.arrays import Array

#: Draws of the bootstrap.
SAMPLES = 2000


def median_interval(values: Array) -> tuple[float, float]:
    """Return the 95 % bootstrap interval of the median. Takes values (samples,)."""
    rng = np.random.default_rng(0)
    medians = np.median(values[rng.integers(0, len(values), (SAMPLES, len(values)))], axis=1)
    low, high = np.quantile(medians, [0.025, 0.975])
    return float(low), float(high)


def mean_leaf(values: Array, unit: str) -> dict[str, Any]:
    """Return the mean of samples with its 95 % bootstrap interval. Takes values (n,)."""
    values = np.asarray(values, np.float64)
    rng = np.random.default_rng(0)
    means = values[rng.integers(0, len(values), (SAMPLES, len(values)))].mean(axis=1)
    low, high = np.quantile(means, [0.025, 0.975])
    return {
        "value": float(values.mean()),
        "unit": unit,
        "interval": [float(low), float(high)],
        "n": len(values),
    }


def spread_leaf(values: Array, unit: str) -> dict[str, Any]:
    """Return the median of samples, and the range of the inner 95 % of them. Takes values (n,)."""
    low, middle, high = np.quantile(values, [0.025, 0.5, 0.975])
    return {"value": float(middle), "unit": unit, "interval": [float(low), float(high)], "n": len(values)}
