"""An effect is a rule: at its own place, and at no other, the correction is a function of the coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.where.corrections import Corrections

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Bins of the first coordinate, for either direction, and of the others.
FINE, COARSE = 32, 16
#: Times over which a place may remember, as shares of the longest experiment.
MEMORY = (0.005, 0.02, 0.1)
#: The data are cut into so many parts; a rule is judged on the parts that it was not fitted to.
FOLDS = 4
#: How far the height of a bin is drawn to zero: what is known of it before, in windows.
PRIORS = (0.3, 3.0, 30.0)
FIRM, _TINY = 1e15, 1e-300


@dataclass(frozen=True, eq=False)
class Checked:
    """A rule on data that it was not fitted to.

    Attributes:
        lowered: by how much it lowers the square errors. gradient: what is left, see `Corrections`.
    """

    lowered: float
    gradient: Array


@dataclass(frozen=True, eq=False)
class Rule:
    """Corrections that are any function of direction and position, plus any of speed and of what was before.

    The uncertain parameters go along: what was left out when they were fitted has bent them.

    Attributes:
        corrections: that it is to explain. place: number of their place. features: (windows, heights).
        pinned: the parameters stay, after all.
    """

    corrections: Corrections
    place: int
    features: Array
    pinned: bool = False

    @classmethod
    def at(cls, corrections: Corrections, place: int, pinned: bool) -> Rule:
        """Any rule at one of the places."""
        recording = corrections.recording
        coordinates = corrections.coordinates
        found = coordinates.of(corrections.places[place])
        longest = recording.logs.period * int(np.diff(recording.logs.offsets).max())
        past = coordinates.lags(corrections.places[place], tuple(longest * share for share in MEMORY))
        columns = [_one_of(_bins(values, COARSE), COARSE) for values in past]
        if found:
            level, rate = found[0].values, found[min(1, len(found) - 1)].values
            columns.append(_one_of(_bins(level, FINE) + FINE * (rate > 0.0), 2 * FINE))
            columns.append(_one_of(_bins(rate, COARSE), COARSE))
        features = np.concatenate([*columns, np.ones((len(recording.start), 1))], axis=1)
        return cls(corrections, place, features, pinned)

    @classmethod
    def none(cls, corrections: Corrections) -> Rule:
        """Nothing but other parameters."""
        return cls(corrections, 0, np.empty((len(corrections.recording.start), 0)))

    def checked(self, gradient: Array) -> Checked:
        """With the prior that does best, where `gradient` (windows, n) is what other rules have left."""
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

    def _slope(self, gradient: Array, mine: NDArray[np.bool_]) -> Array:
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
        values = np.array([p.value for p in self.corrections.model.system.parameters if p.identify])
        return (FIRM if self.pinned else 1.0) / np.where(values == 0.0, 1.0, values) ** 2

    @cached_property
    def _parts(self) -> list[NDArray[np.bool_]]:
        """(windows,) which belong to a part."""
        return [self.corrections.group % FOLDS == k for k in range(FOLDS)]


def _bins(values: Array, count: int) -> Indices:
    edges = np.quantile(values, np.linspace(0.0, 1.0, count + 1)[1:-1])
    return np.searchsorted(edges, values).astype(np.int64)


def _one_of(bins: Indices, count: int) -> Array:
    return np.asarray(bins[:, None] == np.arange(count), np.float64)
