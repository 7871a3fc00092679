"""Rules at channels: only at the place of an effect are corrections a function of coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from threadpoolctl import threadpool_limits

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.diagnosis.where.corrections import Corrections

#: Share that a rule at a channel explains, at least [share of what is lacking].
LEAST_RULE_SHARE = 0.02
#: Share that a rule at a sensor must explain more than another rule [share of what is lacking].
SENSOR_HANDICAP = 0.1
#: Bins of the first coordinate, for either direction, and of the others.
FINE_BINS, COARSE_BINS = 32, 16
#: Times over which a place may remember, as shares of the longest experiment.
MEMORY_SHARES = (0.005, 0.02, 0.1)
#: The data are cut into so many parts; a rule is judged on the parts that it was not fitted to.
FOLDS = 4
#: How far the height of a bin is drawn to zero: what is known of it before, in windows.
PRIORS = (0.3, 3.0, 30.0)
FIRM, _TINY = 1e15, 1e-300


@dataclass(frozen=True, eq=False)
class Checked:
    """A rule on data that it was not fitted to."""

    lowered: float  # fall of the square errors
    gradient: Array  # remaining gradient, (windows, n), see `Corrections`


@dataclass(frozen=True, eq=False)
class Rule:
    """Corrections that are a function of direction and position, plus functions of speed and of the past.

    The uncertain parameters are fitted along: the missing effect has biased them.
    """

    corrections: Corrections
    place: int  # number of their place
    features: Array  # indicators of the bins, (windows, heights)
    pinned: bool = False  # whether the parameters are fixed

    @classmethod
    def at(cls, corrections: Corrections, place: int, pinned: bool) -> Rule:
        """Return the rule at a place."""
        recording = corrections.recording
        coordinates = corrections.coordinates
        found = coordinates.of(corrections.places[place])
        longest = recording.logs.period * int(np.diff(recording.logs.offsets).max())
        past = coordinates.lags(corrections.places[place], tuple(longest * share for share in MEMORY_SHARES))
        columns = [_one_of(_bins(values, COARSE_BINS), COARSE_BINS) for values in past]
        if found:
            level, rate = found[0].values, found[min(1, len(found) - 1)].values
            columns.append(_one_of(_bins(level, FINE_BINS) + FINE_BINS * (rate > 0.0), 2 * FINE_BINS))
            columns.append(_one_of(_bins(rate, COARSE_BINS), COARSE_BINS))
        features = np.concatenate([*columns, np.ones((len(recording.start), 1))], axis=1)
        return cls(corrections, place, features, pinned)

    @classmethod
    def none(cls, corrections: Corrections) -> Rule:
        """Return a rule without features: other parameters only."""
        return cls(corrections, 0, np.empty((len(corrections.recording.start), 0)))

    def checked(self, gradient: Array) -> Checked:
        """Return the rule on data that it was not fitted to, with its best prior; gradient (windows, n)."""
        tried = [self._checked(gradient, prior) for prior in PRIORS]
        return max(tried, key=lambda checked: checked.lowered)

    def _checked(self, gradient: Array, prior: float) -> Checked:
        heights, first = self.features.shape[1], len(self.corrections.places)
        slope = np.stack([self._slope(gradient, mine) for mine in self._parts])
        doubt = np.diag(np.concatenate([np.full(heights, prior / self._size), self._loose]))
        v = np.zeros_like(gradient)
        for part, mine in enumerate(self._parts):
            others = self._curvature.sum(0) - self._curvature[part] + doubt
            found = np.linalg.solve(others, slope[part] - slope.sum(0))
            v[mine, self.place] = self.features[mine] @ found[:heights]
            v[mine, first:] += found[heights:]
        left = gradient + (self.corrections.curvature @ v[:, :, None])[:, :, 0]
        return Checked(-float(np.sum(v * (gradient + left))), left)

    def _slope(self, gradient: Array, mine: Mask) -> Array:
        """(unknowns,) by heights and parameters, of some windows."""
        own, parameters = gradient[mine, self.place], gradient[mine, len(self.corrections.places) :]
        return np.concatenate([self.features[mine].T @ own, parameters.sum(0)])

    @cached_property
    def _curvature(self) -> Array:
        """(parts, unknowns, unknowns) by heights and parameters."""
        k, first, found = self.place, len(self.corrections.places), []
        for mine in self._parts:
            C, X = self.corrections.curvature[mine], self.features[mine]
            across = X.T @ C[:, k, first:]
            found.append(
                np.block([[X.T @ (C[:, k, k, None] * X), across], [across.T, C[:, first:, first:].sum(0)]])
            )
        return np.stack(found)

    @property
    def _size(self) -> float:
        """Mean square of the corrections beyond their noise."""
        weight, gradient = self.corrections.weight[:, self.place], self.corrections.gradient[:, self.place]
        square = float(np.sum(gradient**2 / np.maximum(weight, _TINY) - 1.0))
        return max(square / max(float(weight.sum()), _TINY), _TINY)

    @property
    def _loose(self) -> Array:
        """(parameters,) that what is known of the parameters before hardly counts, or they stay."""
        system = self.corrections.model.system
        values = np.array([p.value for p in system.parameters if p.name in system.uncertain])
        return (FIRM if self.pinned else 1.0) / np.where(values == 0.0, 1.0, values) ** 2

    @cached_property
    def _parts(self) -> list[Mask]:
        """(windows,) which belong to a part."""
        return [self.corrections.group % FOLDS == k for k in range(FOLDS)]


def _bins(values: Array, count: int) -> Indices:
    edges = np.quantile(values, np.linspace(0.0, 1.0, count + 1)[1:-1])
    return np.searchsorted(edges, values).astype(np.int64)


def _one_of(bins: Indices, count: int) -> Array:
    return np.asarray(bins[:, None] == np.arange(count), np.float64)


def unexplained_shares(corrections: Corrections) -> dict[str, float]:
    """Divide the remaining gap among the channels.

    A free correction in every window explains much at any place. Therefore, rules are fitted (`Rule`) and
    judged on experiments that they were not fitted to. The place whose rule lowers the errors most gets that
    share, and the next rule is judged on the rest. A rule at a sensor must be clearly better than others,
    because the initial state of a window hides an offset. The part that follows no rule is divided among the
    same places as far as there are rules, and else among the ports, in proportion to what free corrections
    explain.
    """
    whole = float(np.max(_lowered(corrections, corrections.gradient), initial=0.0))
    if whole <= 0.0:
        return {}
    with threadpool_limits(1):  # in matrices as small as these, threads mostly wait for each other
        ruled, left = _ruled(corrections, whole)
    ports = np.array([place.kind == "port" for place in corrections.places])
    free = np.where(ports | ~ports.any(), np.maximum(_lowered(corrections, left), 0.0), 0.0)
    known = min(float(ruled.sum()), 1.0)
    share = (2.0 - known) * ruled + (1.0 - known) ** 2 * free / max(float(free.sum()), 1e-300)
    names = [place.channel for place in corrections.places]
    return dict(zip(names, (share / share.sum()).tolist(), strict=True)) if share.sum() > 0.0 else {}


def _lowered(corrections: Corrections, gradient: Array) -> Array:
    """(places,) by how much a free correction in every window lowers the square errors, noise discounted."""
    seen, weight = corrections.seen, corrections.weight
    own = gradient[:, : weight.shape[1]]
    return np.asarray(np.where(seen, own**2 / np.where(seen, weight, 1.0) - 1.0, 0.0).sum(0))


def _ruled(corrections: Corrections, whole: float) -> tuple[Array, Array]:
    """Shares (places,) by which rules at the places lower the errors, and the remaining gradient."""
    found = np.zeros(len(corrections.places))
    handicap = [SENSOR_HANDICAP * whole if place.kind == "sensor" else 0.0 for place in corrections.places]
    other = Rule.none(corrections).checked(corrections.gradient)
    gradient = other.gradient if other.lowered > 0.0 else corrections.gradient
    # parameters that differ from experiment to experiment do not help to judge one by the others
    pinned = other.lowered < -LEAST_RULE_SHARE * whole
    rules = {k: Rule.at(corrections, k, pinned) for k in range(len(corrections.places))}
    while rules:
        checked = {k: rule.checked(gradient) for k, rule in rules.items()}
        best = max(checked, key=lambda k: checked[k].lowered - handicap[k])
        if checked[best].lowered < LEAST_RULE_SHARE * whole:
            break
        found[best], gradient = checked[best].lowered / whole, checked[best].gradient
        del rules[best]
    return found, gradient
