"""What the values of columns say: which is the speed of which position, and what drives it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodelled.logs.readers.reader import Array

#: Time over which a speed is averaged and an acceleration is integrated, s, and the fewest samples for it.
AVERAGED, FEWEST = 0.05, 2
#: Speed below which dry friction is not of one sign, as a share of the largest.
SLOW = 0.02


@dataclass(frozen=True)
class Slope:
    """Agreement of a column with the slope of a position.

    Attributes:
        correlation: correlation with the slope.
        ratio: factor between the slope and the column.
    """

    correlation: float
    ratio: float


@dataclass(frozen=True)
class Drive:
    """Acceleration of a position by an input: a*u - b*speed, and friction and gravity beside it.

    Attributes:
        gain: a, acceleration per unit of the input.
        damping: b, 1/s.
        share: share of the squared acceleration without the input that the input explains.
    """

    gain: float
    damping: float
    share: float


def at(t: Array, own: Array, values: Array) -> Array:
    """Read values at other instants, by straight lines.

    Takes t (samples,) in s, own (values,) in s, values (values,); gives (samples,).
    """
    return np.asarray(np.interp(t, own, values))


def span(t: Array) -> int:
    """Return the number of samples over which a speed is averaged.

    Takes t (samples,) in s.
    """
    step = float(np.median(np.diff(t)))
    return int(min(max(round(AVERAGED / step), FEWEST), len(t) // 4))


def slope_of(t: Array, position: Array, column: Array) -> Slope:
    """Compare a column with the slope of a position, both averaged over the same time.

    Takes t (samples,) in s, position (samples,), column (samples,).

    Examples:
        >>> t = np.linspace(0.0, 5.0, 501)
        >>> found = slope_of(t, np.sin(t), np.rad2deg(np.cos(t)))
        >>> round(found.correlation, 3), round(found.ratio, 1)
        (1.0, 57.3)
    """
    k = span(t)
    seconds = t[k:] - t[:-k]
    slope = (position[k:] - position[:-k]) / seconds
    mean = over(t, column, k) / seconds
    a, b = slope - slope.mean(), mean - mean.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return Slope(float(a @ b) / size, float(a @ b / (a @ a))) if size > 0.0 else Slope(0.0, 0.0)


def over(t: Array, values: Array, k: int) -> Array:
    """Integrate values over k samples from every sample on.

    Takes t (samples,) in s, values (samples,); gives (samples - k,).
    """
    total = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(t))])
    return np.asarray(total[k:] - total[:-k])


def drive_of(t: Array, position: Array, u: Array) -> Drive:
    """Fit the acceleration of a position by an input, beside damping, dry friction, gravity and a constant.

    Speeds and accelerations are integrated, so that noise is not differentiated twice.

    Takes t (samples,) in s, position (samples,), u (samples,).

    Examples:
        >>> t = np.linspace(0.0, 10.0, 2001)
        >>> found = drive_of(t, np.sin(t), -0.5 * np.sin(t) + 0.2 * np.cos(t))  # J = 0.5, b = 0.2
        >>> round(found.gain, 2), round(found.damping, 2), round(found.share, 2)
        (2.0, 0.4, 1.0)
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
    columns = np.column_stack([over(middle, each, n) for each in (drive, *beside)])
    gained = speed[n:] - speed[:-n]
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0.0] = 1.0
    found, *_ = np.linalg.lstsq(columns / scale, gained, rcond=1e-8)
    without, *_ = np.linalg.lstsq(columns[:, 1:] / scale[1:], gained, rcond=1e-8)
    rest = float(np.sum((gained - columns[:, 1:] / scale[1:] @ without) ** 2))
    left = float(np.sum((gained - columns / scale @ found) ** 2))
    gain, damping = found[:2] / scale[:2]
    return Drive(float(gain), float(-damping), 1.0 - left / rest if rest > 0.0 else 0.0)
