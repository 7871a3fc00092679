"""Filter of Savitzky and Golay (1964): least squares by a cubic over a window that moves along the samples.

SciPy has it too, in a package that takes half a second to load, and fits the cubic anew at each call.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

#: Of the fitted polynomial; order 4 has the same derivative in the middle and is noisier at the ends.
ORDER = 3


def kernel(width: int, derivative: int, position: int) -> Array:
    """Return the coefficients (width,) that a window of samples is convolved with."""
    return np.array((_powers(width, derivative, position)[0] @ _fit(width))[::-1])


def filtered(y: Array, width: int, derivative: int, period: float) -> Array:
    """Return smoothed samples (samples,) or their slopes; half a window at either end lies on one cubic."""
    half, positions = width // 2, np.arange(width)
    first, last = (_fit(width) @ y[:width], _fit(width) @ y[-width:])
    parts = (
        _powers(width, derivative, positions[:half]) @ first,
        np.convolve(y, kernel(width, derivative, half), "valid"),
        _powers(width, derivative, positions[half + 1 :]) @ last,
    )
    return np.asarray(np.concatenate(parts) / period**derivative)


@cache
def _fit(width: int) -> Array:
    """Coefficients of the cubic by the samples (ORDER + 1, width); the window reaches from -1 to 1."""
    return np.asarray(np.linalg.pinv(_powers(width, 0, np.arange(width))))


def _powers(width: int, derivative: int, positions: ArrayLike) -> Array:
    """Derivatives of the powers (positions, ORDER + 1) at samples of a window."""
    half = width // 2
    slopes = np.polynomial.polynomial.polyder(np.eye(ORDER + 1), derivative) / half**derivative
    at = (np.atleast_1d(positions) - half) / half
    return np.asarray(np.vander(at, len(slopes), increasing=True) @ slopes)
