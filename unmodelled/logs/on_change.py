"""Values that a recorder writes when they change: whether rows are such values."""

from __future__ import annotations

import numpy as np

from unmodelled.base.arrays import Array

#: Share of nearly equal steps in an even clock, and of changes among the rows of what is written on change.
EVEN = 0.9


def is_even(steps: Array) -> bool:
    """Return whether most steps (steps,) of a clock are nearly equal."""
    return bool(np.mean(np.abs(steps / np.median(steps) - 1.0) < 0.5) > EVEN)


def steps_alike(values: Array) -> bool:
    """Return whether most steps of values (samples,) have one size: a digit of the sensor."""
    changes = np.abs(np.diff(values))
    return bool(np.mean(np.abs(changes - np.median(changes)) < 0.01 * np.median(changes)) > EVEN)


def is_on_change(t: Array, values: Array) -> bool:
    """Return whether values (samples,) at times t, s, are written when they change.

    Such a value recurs, but not at once, and either by steps of one size or at uneven times.
    """
    recurs = 0 < 2 * len(np.unique(values)) <= len(values)
    if not recurs or np.mean(np.diff(values) != 0.0) <= EVEN:
        return False
    return steps_alike(values) or not is_even(np.diff(t))
