"""Counts of a channel: the unit of which its values are whole multiples, as a converter writes them."""

from __future__ import annotations

import numpy as np

from unmodelled.base.arrays import Array

#: Largest deviation of a level from a whole number of counts, counts.
WHOLE = 0.1
#: Counts from the lowest level up to which the smallest gap is exact enough to number levels.
NEAR = 8.0


def count_of(values: Array) -> float:
    """Return the unit of which all values are whole multiples, apart from a constant; 0 if there is none.

    Values may be rounded, as in a text file: the unit is fitted to levels near the lowest one, then to levels
    twice as far away and so on, so that the number of counts of the farthest level is known.

    Takes values (samples,).

    Examples:
        >>> round(count_of(0.25 * np.array([3, 7, 8, 40, 41, 17.0])), 3)
        0.25
        >>> round(count_of(np.round(0.00269 * np.arange(2000.0), 4)), 6)
        0.00269
    """
    levels = np.unique(values)
    far = levels - levels[0]
    gaps = np.diff(levels)
    gaps = gaps[gaps > 1e-9 * max(float(far[-1]), 1e-300)]
    if len(gaps) == 0:
        return 0.0
    unit, reach = float(gaps.min()), NEAR * float(gaps.min())
    while True:
        near = far[far <= reach]
        counts = np.round(near / unit)
        unit = float(near @ counts) / max(float(counts @ counts), 1.0) or unit
        if reach >= far[-1]:
            break
        reach *= 2.0
    off = np.abs(far / unit - np.round(far / unit))
    return unit if bool((off < WHOLE).all()) else 0.0
