"""Profile likelihood of the parameters of a distribution: what the data say about each of them.

Raue et al., Structural and practical identifiability analysis of partially observed dynamical models by
exploiting the profile likelihood, Bioinformatics 25 (2009).
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from unmodelled.base.errors import BadInput
from unmodelled.base.progress import Counter
from unmodelled.uncertainty.ascent import DEEP, Objective, Peak, Recorder, climb
from unmodelled.uncertainty.box import Box
from unmodelled.uncertainty.curvature import curvature

Array = NDArray[np.float64]

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


@dataclass(frozen=True)
class Profile:
    """The highest log-likelihood for every value of one parameter, from bound to bound or to deviance 6.

    Attributes:
        index: of the parameter. bounds: of the parameter.
        alphas: (P, k) parameters, the others optimised, in rising order of this one; the optimum is among
            them.
        log_likelihood: (P,) there. deviance: (P,) twice the log-likelihood lost against the optimum.
        low, high: ends of the 95 % interval; None where the deviance stays below the threshold up to the
            bound, so that the data set no limit on that side.
    """

    index: int
    bounds: tuple[float, float]
    alphas: Array
    log_likelihood: Array
    deviance: Array
    low: float | None
    high: float | None

    @property
    def values(self) -> Array:
        """(P,) values of the parameter."""
        return self.alphas[:, self.index]


@dataclass(frozen=True)
class Profiles:
    """Profiles of all free parameters around one optimum.

    Attributes:
        alpha: (k,) the optimum. log_likelihood: there.
        gain: log-likelihood of this optimum above the given one's; 0 when no profile found a better one.
        curves: one for every free parameter. evaluations: of the log-likelihood that they took.
    """

    alpha: Array
    log_likelihood: float
    gain: float
    curves: tuple[Profile, ...]
    evaluations: int

    @property
    def intervals(self) -> Array:
        """(k, 2) 95 % intervals, infinite on a side without a limit; the value itself where it is fixed."""
        ends = np.column_stack([self.alpha, self.alpha])
        for c in self.curves:
            ends[c.index] = -np.inf if c.low is None else c.low, np.inf if c.high is None else c.high
        return ends


def profile(objective: Objective, bounds: Array, alpha: Array, description: str | None = None) -> Profiles:
    """Profile likelihood of every free parameter, walked from the optimum to both sides with warm starts.

    A better optimum than the given one that turns up on the way takes its place, and the profiles start anew.

    Args:
        objective: log-likelihoods (B,) of a batch of parameters (B, k).
        bounds: (k, 2) of the parameters; equal ones hold a parameter fixed.
        alpha: (k,) the optimum.
        description: of the work, for a progress bar; without it there is none.

    Raises:
        BadInput: when the bounds are not possible, or the log-likelihood at the optimum is not finite.
    """
    box, seen = Box(np.asarray(bounds, float)), Recorder(objective)
    start = optimum = evaluated(seen, box, alpha)
    with ExitStack() as stack:
        counter = stack.enter_context(Counter(int(box.free.sum()), description)) if description else None
        while (curves := _curves(seen, box, optimum, counter)) is None:
            optimum, _ = climb(seen, box, seen.peak.alpha)
    gain = optimum.log_likelihood - start.log_likelihood
    return Profiles(optimum.alpha, optimum.log_likelihood, gain, curves, seen.evaluations)


def evaluated(seen: Recorder, box: Box, alpha: Array) -> Peak:
    """The point of the box that a given optimum stands for.

    Raises:
        BadInput: when the log-likelihood there is not finite.
    """
    inside = box.clip(alpha)
    height = float(seen(inside[None])[0])
    if not np.isfinite(height):
        numbers = ", ".join(f"{a:.4g}" for a in inside)
        raise BadInput(f"the log-likelihood at the given optimum ({numbers}) is not finite")
    return Peak(inside, height)


def _curves(seen: Recorder, box: Box, optimum: Peak, counter: Counter | None) -> tuple[Profile, ...] | None:
    """All profiles; None once something better than the optimum was seen."""
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
    """The way along one parameter, the others following at the highest log-likelihood.

    Attributes:
        seen: the objective. box: of the search. optimum: to start from. index: of the parameter.
    """

    seen: Recorder
    box: Box
    optimum: Peak
    index: int

    @cached_property
    def axis(self) -> Box:
        """The box of this parameter alone."""
        return Box(self.box.bounds[[self.index]])

    def to_side(self, sign: int, std: float) -> list[Peak]:
        """Points from next to the optimum outwards, until the deviance or the bound ends them.

        Args:
            sign: -1 towards the lower bound, 1 towards the upper. std: the parameter's standard error.
        """
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
        """The highest point with the parameter at `unit` of its way, climbed to from the last known point.

        Two known points also lead on in a straight line; the climb starts there where that is higher.
        """
        pinned = self.box.pinned({self.index: float(self.axis.to_alpha([unit])[0])})
        starts = pinned.clip([known[-1].alpha])
        if len(known) > 1:
            first, last = (self.unit(p) for p in known)
            a, b = (self.box.to_unit(p.alpha) for p in known)
            ahead = np.clip(b + (b - a) * (unit - last) / (last - first), 0.0, 1.0)
            starts = pinned.clip([known[-1].alpha, self.box.to_alpha(ahead)])
        return climb(self.seen, pinned, starts[int(np.argmax(self.seen(starts)))])[0]

    def unit(self, point: Peak) -> float:
        """Where the parameter is on its way from bound to bound, 0 to 1."""
        return float(self.axis.to_unit(point.alpha[[self.index]])[0])

    def root(self, point: Peak) -> float:
        """Root of the deviance, with an end."""
        return float(np.sqrt(np.clip(2.0 * (self.optimum.log_likelihood - point.log_likelihood), 0.0, DEEP)))

    def limit(self, side: list[Peak]) -> float | None:
        """Where the deviance first passes the threshold on one side; None where it does not."""
        level = np.sqrt(THRESHOLD)
        for inner, outer in pairwise([self.optimum, *side]):
            low, high = self.root(inner), self.root(outer)
            if high >= level:
                share = (level - low) / (high - low)
                inside, outside = inner.alpha[self.index], outer.alpha[self.index]
                return float(inside + share * (outside - inside))
        return None

    def _looked_back(self, points: list[Peak]) -> list[Peak]:
        """Every point that its outer neighbour leads higher up is climbed to from there."""
        out = list(points)
        for k in range(len(points) - 2, 0, -1):
            moved = out[k + 1].alpha.copy()
            moved[self.index] = out[k].alpha[self.index]
            if float(self.seen(moved[None])[0]) > out[k].log_likelihood + BETTER:
                out[k] = self.follow(self.unit(out[k]), out[k + 1])
        return out
