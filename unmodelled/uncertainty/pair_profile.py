"""Profile likelihood of pairs of parameters, for contour plots."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.progress import Counter
from unmodelled.uncertainty.ascent import Objective, Recorder, climb
from unmodelled.uncertainty.box import Box
from unmodelled.uncertainty.profile import BETTER, evaluated_optimum

Array = NDArray[np.float64]

#: Places between the bounds of every other parameter where a search may start.
SPREAD = (0.1, 0.5, 0.9)


@dataclass(frozen=True)
class PairProfile:
    """Highest log-likelihood on a grid of two parameters, with the other parameters optimised."""

    first: Array  # (P,), values
    second: Array  # (Q,), values
    alphas: Array  # (P, Q, k), all parameters
    deviance: Array  # (P, Q), twice the loss of log-likelihood against the optimum
    alpha: Array  # (k,), of the optimum
    log_likelihood: float  # of the optimum
    gain: float  # over the given optimum; 0 if the grid found no better one


def profile_pair(
    objective: Objective,
    bounds: Array,
    alpha: Array,
    pair: tuple[int, int],
    first: Array,
    second: Array,
    description: str | None = None,
) -> PairProfile:
    """Compute the profile likelihood of two parameters, from the optimum (k,) outwards with warm starts."""
    box, seen = Box(np.asarray(bounds, float)), Recorder(objective)
    given = evaluated_optimum(seen, box, alpha)
    shape = len(first), len(second)
    alphas, heights = np.tile(given.alpha, (*shape, 1)), np.full(shape, -np.inf)
    with ExitStack() as stack:
        counter = stack.enter_context(Counter(heights.size, description)) if description else None
        done = np.zeros(shape, bool)
        for count, (p, q) in enumerate(_outwards(first, second, given.alpha[list(pair)]), start=1):
            pinned = box.pinned({pair[0]: float(first[p]), pair[1]: float(second[q])})
            near = np.s_[max(p - 1, 0) : p + 2, max(q - 1, 0) : q + 2]
            starts = pinned.clip(np.vstack([given.alpha, alphas[near][done[near]], _spread(pinned)]))
            peak, _ = climb(seen, pinned, starts[int(np.argmax(seen(starts)))])
            alphas[p, q], heights[p, q], done[p, q] = peak.alpha, peak.log_likelihood, True
            if counter:
                counter.update(count)
    best = given
    if seen.peak.log_likelihood > given.log_likelihood + BETTER:
        best, _ = climb(seen, box, seen.peak.alpha)
    top = best.log_likelihood
    deviance = np.maximum(2.0 * (top - heights), 0.0)
    gain = top - given.log_likelihood
    return PairProfile(np.asarray(first), np.asarray(second), alphas, deviance, best.alpha, top, gain)


def _spread(box: Box) -> Array:
    """Return starts (S, k) spread over the free parameters, in case the optimum moves to another region."""
    shares = np.array(list(product(SPREAD, repeat=int(box.free.sum()))))
    return box.to_alpha(shares)


def _outwards(first: Array, second: Array, centre: Array) -> list[tuple[int, int]]:
    """Return the cells of a grid, nearest to a point first, so that each has an earlier neighbour."""
    p0, q0 = int(np.argmin(np.abs(first - centre[0]))), int(np.argmin(np.abs(second - centre[1])))
    cells = [(p, q) for p in range(len(first)) for q in range(len(second))]
    return sorted(cells, key=lambda c: abs(c[0] - p0) + abs(c[1] - q0))
