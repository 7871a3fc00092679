"""What the values of columns say: which is the speed of which position, and what drives it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array

#: Time over which a speed is averaged and an acceleration is integrated, s, and the fewest samples for it.
AVERAGED, FEWEST = 0.05, 2
#: Share of squares that is rounding.
EXACT = 1e-12
#: Speed below which dry friction is not of one sign, as a share of the largest.
SLOW = 0.02


@dataclass(frozen=True)
class Slope:
    """Agreement of a column with the slope of a position."""

    correlation: float
    ratio: float  # factor between the slope and the column


@dataclass(frozen=True)
class Drive:
    """Acceleration of a position by an input: a*u - b*speed, and friction and gravity beside it."""

    gain: float  # a, acceleration per unit of the input
    damping: float  # b, 1/s
    share: float  # of the squared acceleration without the input that the input explains


def at(t: Array, own: Array, values: Array) -> Array:
    """Read values (values,) of instants `own` at other instants t (samples,), by straight lines."""
    return np.asarray(np.interp(t, own, values))


def span(t: Array) -> int:
    """Return the number of samples over which a speed is averaged, for instants t (samples,), s."""
    step = float(np.median(np.diff(t)))
    return int(min(max(round(AVERAGED / step), FEWEST), len(t) // 4))


def slope_of(t: Array, position: Array, column: Array) -> Slope:
    """Compare a column (samples,) with the slope of a position (samples,), averaged over the same time."""
    k = span(t)
    seconds = t[k:] - t[:-k]
    slope = (position[k:] - position[:-k]) / seconds
    mean = over(t, column, k) / seconds
    a, b = slope - slope.mean(), mean - mean.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return Slope(float(a @ b) / size, float(a @ b / (a @ a))) if size > 0.0 else Slope(0.0, 0.0)


def over(t: Array, values: Array, k: int) -> Array:
    """Integrate values (samples,) over k samples from every sample on, to (samples - k,)."""
    total = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(t))])
    return np.asarray(total[k:] - total[:-k])


def explained(
    changes: Array, wanted: Sequence[Array], beside: Sequence[Array], exact: float = EXACT
) -> tuple[Array, float, float]:
    """Return factors (columns,) of changes (changes,) by least squares, and explained shares of squares.

    The first share is of what the columns beside leave, 0 where that is a share `exact` of all, or less.
    """
    columns = np.column_stack([*wanted, *beside])
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0.0] = 1.0
    found, *_ = np.linalg.lstsq(columns / scale, changes, rcond=1e-8)
    n = len(wanted)
    others = columns[:, n:] / scale[n:]
    without, *_ = np.linalg.lstsq(others, changes, rcond=1e-8)
    rest = float(np.sum((changes - others @ without) ** 2))
    left = float(np.sum((changes - columns / scale @ found) ** 2))
    squares = float(changes @ changes)
    # nothing is left to explain where the others are exact: current and voltage of a resistor
    share = 1.0 - left / rest if rest > exact * squares else 0.0
    return np.asarray(found / scale), share, 1.0 - left / (squares or np.inf)


def drive_of(t: Array, position: Array, u: Array) -> Drive:
    """Fit the acceleration of a position (samples,) by an input u, damping, dry friction and gravity.

    Speeds and accelerations are integrated, so that noise is not differentiated twice.
    """
    k = span(t)
    middle = 0.5 * (t[k:] + t[:-k])
    speed = (position[k:] - position[:-k]) / (t[k:] - t[:-k])
    q, drive = at(middle, t, position), at(middle, t, u)
    sign = np.clip(speed / (SLOW * float(np.abs(speed).max()) or 1.0), -1.0, 1.0)
    n = 2 * span(middle)
    if len(middle) < 4 * n:
        return Drive(0.0, 0.0, 0.0)
    beside = [speed, sign, np.sin(q), np.cos(q), np.ones_like(q)]
    first, *others = (over(middle, each, n) for each in (drive, *beside))
    (gain, damping, *_), share, _ = explained(speed[n:] - speed[:-n], [first], others, exact=0.0)
    return Drive(float(gain), float(-damping), share)
