"""Numbers drawn between the ends of their intervals: an experiment must keep its limits for all of them."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.linalg import hadamard

from unmodelled.base.arrays import Array

#: Sets of numbers that are drawn from their intervals.
DRAWS = 20
#: Most numbers of which all ends are tried together: 64 sets.
TOGETHER = 6


def drawn_between(intervals: Array) -> Array:
    """Return `DRAWS` sets of numbers, shape (draws, numbers), from their intervals (numbers, 2).

    Every number takes as many values, equally far from each other, from one end of its interval to the
    other, in an order of its own (a Latin hypercube with its edges).
    """
    rng = np.random.default_rng(0)
    share = np.linspace(0.0, 1.0, DRAWS)
    orders = [rng.permutation(DRAWS) for _ in intervals]
    low, high = intervals.T
    places = np.array([share[order] for order in orders]).reshape(-1, DRAWS).T
    return np.asarray(low + places * (high - low))


def ends_of(intervals: Array) -> Array:
    """Return sets of numbers at the ends of their intervals (numbers, 2), shape (sets, numbers).

    They are all combinations; of more than `TOGETHER` numbers those in which any three take all (a folded
    Hadamard design).
    """
    count = len(intervals)
    if count <= TOGETHER:
        return np.array([*product(*intervals.tolist())]).reshape(-1, count)
    signs = hadamard(1 << (count - 1).bit_length())[:, :count]
    return np.where(np.concatenate([signs, -signs]) > 0, intervals[:, 1], intervals[:, 0])
