"""Angles that an encoder or an arctangent has wrapped into one turn."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TURN = 2.0 * np.pi


def wrapped(angle: Array) -> bool:
    """Whether `angle` (n,), rad, stays within one turn, jumps by a turn at times, and is smooth otherwise."""
    steps = np.diff(angle)
    jumps = np.abs(steps) > np.pi
    smooth = np.abs(np.remainder(steps + np.pi, TURN) - np.pi)
    # less than a quarter turn per sample, or a jump by a turn could as well be motion
    return bool(jumps.any() and smooth.max() < 0.5 * np.pi and np.ptp(angle) < TURN * (1.0 + 1e-3))
