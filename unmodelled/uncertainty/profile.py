"""Profile likelihood of distribution parameters: the information of the data on each, and on pairs of them.

Raue et al., Structural and practical identifiability analysis of partially observed dynamical models by
exploiting the profile likelihood, Bioinformatics 25 (2009).
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product

import numpy as np
from scipy.stats import chi2

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.progress import Counter
from unmodelled.uncertainty.ascent import DEEP, Objective, Peak, Recorder, climb
from unmodelled.uncertainty.box import Box
from unmodelled.uncertainty.curvature import curvature

#: Deviance at the ends of a 95 % interval of one parameter, and on the edge of the 95 % region of two.
THRESHOLD = float(chi2.ppf(0.95, 1))
THRESHOLD_OF_TWO = float(chi2.ppf(0.95, 2))
#: Deviance at which a profile ends: its range then holds the region of two parameters.
TOP = THRESHOLD_OF_TWO + 0.2
#: Rise of the root of the deviance, a straight line on a parabola, that one step aims at, and the largest
#: that a step may make unless it is the shortest.
RISE, LARGEST_RISE = 0.35, 0.8
#: Shortest and longest step, as a share of the way from bound to bound.
SHORTEST, LONGEST = 1e-3, 0.1
#: Log-likelihood above the optimum, or the warm start's, that is more than the climbing's error.
BETTER = 1e-3
#: Places between the bounds of every other parameter where the search of a pair may start.
SPREAD = (0.1, 0.5, 0.9)


@dataclass(frozen=True)
class Profile:
    """Highest log-likelihood for values of one parameter, between its bounds or up to a deviance of 6."""

    index: int  # of the parameter
    bounds: tuple[float, float]
    alphas: Array  # (P, k), sorted by this parameter, the others optimised; the optimum is one of them
    log_likelihood: Array  # (P,)
    deviance: Array  # (P,), twice the loss of log-likelihood against the optimum
    low: float | None  # of the 95 % interval; None if the data set no limit above the lower bound
    high: float | None  # likewise

    @property
    def values(self) -> Array:
        """Values of the parameter, shape (P,)."""
        return self.alphas[:, self.index]


@dataclass(frozen=True)
class Profiles:
    """Profiles of all free parameters around one optimum."""

    alpha: Array  # (k,), of the optimum
    log_likelihood: float  # of the optimum
    gain: float  # over the given optimum; 0 if no profile found a better one
    curves: tuple[Profile, ...]  # of the free parameters
    evaluations: int  # of the log-likelihood

    @property
    def intervals(self) -> Array:
        """95 % intervals, shape (k, 2): infinite on a side without a limit, of zero width if fixed."""
        ends = np.column_stack([self.alpha, self.alpha])
        for c in self.curves:
            ends[c.index] = -np.inf if c.low is None else c.low, np.inf if c.high is None else c.high
        return ends


def profile(objective: Objective, bounds: Array, alpha: Array, description: str | None = None) -> Profiles:
    """Compute the profile of every free parameter, from the optimum (k,) to both sides with warm starts.

    If a better optimum is found on the way, it replaces the given one and the profiles start again.
    """
    box, seen = Box(np.asarray(bounds, float)), Recorder(objective)
    start = optimum = evaluated_optimum(seen, box, alpha)
    with ExitStack() as stack:
        counter = stack.enter_context(Counter(int(box.free.sum()), description)) if description else None
        while (curves := _curves(seen, box, optimum, counter)) is None:
            optimum, _ = climb(seen, box, seen.peak.alpha)
    gain = optimum.log_likelihood - start.log_likelihood
    return Profiles(optimum.alpha, optimum.log_likelihood, gain, curves, seen.evaluations)


def evaluated_optimum(seen: Recorder, box: Box, alpha: Array) -> Peak:
    """Return a given optimum (k,), moved into the bounds, with its log-likelihood."""
    inside = box.clip(alpha)
    height = float(seen(inside[None])[0])
    if not np.isfinite(height):
        numbers = ", ".join(f"{a:.4g}" for a in inside)
        raise BadInput(
            f"the log-likelihood at the given optimum ({numbers}) is not finite: start from another one"
        )
    return Peak(inside, height)


def _curves(seen: Recorder, box: Box, optimum: Peak, counter: Counter | None) -> tuple[Profile, ...] | None:
    """Return all profiles; None as soon as a better optimum was found."""
    std = curvature(seen, box.bounds, optimum.alpha).std
    curves: list[Profile] = []
    for index in np.flatnonzero(box.free).tolist():
        walk = Walk(seen, box, optimum, index)
        down, up = walk.to_side(-1, std[index]), walk.to_side(1, std[index])
        if seen.peak.log_likelihood > optimum.log_likelihood + BETTER:
            return None
        points = [*reversed(down), optimum, *up]
        heights = np.array([p.log_likelihood for p in points])
        curves.append(
            Profile(
                index,
                (float(box.bounds[index, 0]), float(box.bounds[index, 1])),
                np.array([p.alpha for p in points]),
                heights,
                np.maximum(2.0 * (optimum.log_likelihood - heights), 0.0),
                walk.limit(down),
                walk.limit(up),
            )
        )
        if counter:
            counter.update(len(curves))
    return tuple(curves)


@dataclass(frozen=True)
class Walk:
    """Path along one parameter on which the others follow at the highest log-likelihood."""

    seen: Recorder
    box: Box
    optimum: Peak  # point to start from
    index: int  # of the parameter

    @cached_property
    def axis(self) -> Box:
        """Bounds of this parameter alone."""
        return Box(self.box.bounds[[self.index]])

    def to_side(self, sign: int, std: float) -> list[Peak]:
        """Return the points on one side, from the optimum outwards, up to a deviance of 6 or a bound."""
        here = self.unit(self.optimum)
        one_std = float(self.axis.to_unit([self.optimum.alpha[self.index] + sign * std])[0])
        step = float(np.clip(RISE * abs(one_std - here), SHORTEST, LONGEST))
        end = 0.0 if sign < 0 else 1.0
        points = [self.optimum]
        while here != end and self.root(points[-1]) < np.sqrt(TOP):
            ahead = float(np.clip(here + sign * step, 0.0, 1.0))
            point = self.follow(ahead, *points[-2:])
            rise = self.root(point) - self.root(points[-1])
            if rise <= LARGEST_RISE or step <= SHORTEST:
                points.append(point)
                here = ahead
            step = float(np.clip(step * np.clip(RISE / max(rise, 1e-9), 0.25, 2.0), SHORTEST, LONGEST))
        return self._looked_back(points)[1:]

    def follow(self, unit: float, *known: Peak) -> Peak:
        """Climb with the parameter fixed, from the last known point or, if higher, the line through two."""
        pinned = self.box.pinned({self.index: float(self.axis.to_alpha([unit])[0])})
        starts = pinned.clip([known[-1].alpha])
        if len(known) > 1:
            first, last = (self.unit(p) for p in known)
            a, b = (self.box.to_unit(p.alpha) for p in known)
            ahead = np.clip(b + (b - a) * (unit - last) / (last - first), 0.0, 1.0)
            starts = pinned.clip([known[-1].alpha, self.box.to_alpha(ahead)])
        return climb(self.seen, pinned, starts[int(np.argmax(self.seen(starts)))])[0]

    def unit(self, point: Peak) -> float:
        """Return the value of the parameter in the unit interval of its bounds."""
        return float(self.axis.to_unit(point.alpha[[self.index]])[0])

    def root(self, point: Peak) -> float:
        """Return the square root of the deviance, limited to a large number."""
        return float(np.sqrt(np.clip(2.0 * (self.optimum.log_likelihood - point.log_likelihood), 0.0, DEEP)))

    def limit(self, side: list[Peak]) -> float | None:
        """Return the value at which the deviance first exceeds the 95 % threshold on one side."""
        level = np.sqrt(THRESHOLD)
        for inner, outer in pairwise([self.optimum, *side]):
            low, high = self.root(inner), self.root(outer)
            if high >= level:
                share = (level - low) / (high - low)
                inside, outside = inner.alpha[self.index], outer.alpha[self.index]
                return float(inside + share * (outside - inside))
        return None

    def _looked_back(self, points: list[Peak]) -> list[Peak]:
        """Climb again to every point for which its outer neighbour gives a higher start."""
        out = list(points)
        for k in range(len(points) - 2, 0, -1):
            moved = out[k + 1].alpha.copy()
            moved[self.index] = out[k].alpha[self.index]
            if float(self.seen(moved[None])[0]) > out[k].log_likelihood + BETTER:
                out[k] = self.follow(self.unit(out[k]), out[k + 1])
        return out


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
