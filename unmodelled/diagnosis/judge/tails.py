"""Windows are not equally predictable: their residuals are of a t distribution.

A window that starts near an unstable equilibrium leaves a hundred times what others leave, with the true law,
too. As squares, a few of them decide; with heavy tails (Lange, Little and Taylor 1989) every window counts.
"""

from __future__ import annotations

import numpy as np

from unmodelled.base.arrays import Array

#: Degrees of freedom, as Lange, Little and Taylor recommend where data are too few to say.
FREEDOM = 4.0
#: Iterations by which the scale is found: of 200 random sets within 7 % after five, 2e-5 after these.
ITERATIONS = 20


def scale(squares: Array, samples: Array) -> Array:
    """Return the likeliest scales, squared, (outputs,) of squares (windows, outputs) of so many samples.

    Iterations of PX-EM (Liu, Rubin and Wu 1998) from the median.
    """
    known = (samples > 0.0) & np.isfinite(squares)
    none = np.where(known.any(axis=0), np.nan, 0.0)  # 0: an output of no window, or of a fit that diverged
    each = np.where(known, squares / np.maximum(samples, 1e-300), none)
    found = np.maximum(np.nanmedian(each, axis=0), 1e-300)
    for _ in range(ITERATIONS):
        w = shares(squares, samples, found)
        found = np.maximum((w * squares).sum(axis=0) / np.maximum((w * samples).sum(axis=0), 1e-300), 1e-300)
    return np.asarray(found)


def shares(squares: Array, samples: Array, scale: Array) -> Array:
    """Return how much every window counts, (windows, outputs), about one where it leaves what is usual."""
    return np.asarray((FREEDOM + samples) / (FREEDOM + squares / scale))


def log_densities(squares: Array, samples: Array, scale: Array) -> Array:
    """Return log densities (windows, outputs), nats, up to a constant of the samples."""
    beyond = (FREEDOM + samples) * np.log1p(squares / (FREEDOM * scale))
    return np.asarray(-0.5 * np.where(samples > 0.0, beyond + samples * np.log(scale), 0.0))
