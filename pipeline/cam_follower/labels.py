"""Label experiments as stall, jump or contact (section 5.2.2)."""

from itertools import pairwise

import numpy as np

from pipeline.cam_follower.cam import TURN
from unmodelled.base.arrays import Array


def unwrapped(theta: Array) -> Array:
    """Unwrap an angle (n,), rad; a start just below zero, logged as 2 pi, becomes negative."""
    angle = np.unwrap(theta)
    return angle - TURN if angle[0] > np.pi else angle


def full_revolutions(angle: Array) -> list[slice]:
    """Return the samples of the full revolutions of angle (n,), rad, without first and last one."""
    turn = np.floor(np.maximum.accumulate(angle) / TURN).astype(int)
    edges = np.searchsorted(turn, np.arange(1, turn[-1] + 1))
    return [slice(int(a), int(b)) for a, b in pairwise(edges)]


def mean_extreme(angle: Array, signal: Array, largest: bool) -> float:
    """Return the maximum or minimum of a signal (n,) per full revolution, averaged over them."""
    extreme = np.max if largest else np.min
    values = [extreme(signal[turn]) for turn in full_revolutions(angle)]
    return float(np.mean(values)) if values else float("nan")


def label(turns: float, eps_share: float, jump_share: float, stall_turns: float) -> str:
    """Return the label of an experiment: "stall", "jump" or "contact"."""
    if turns < stall_turns:
        return "stall"
    return "jump" if eps_share > jump_share else "contact"
