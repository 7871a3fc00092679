"""Numbers of a last fit with their intervals: from experiments left out, and from the curvature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.result import Estimate, Interval
from unmodelled.diagnosis.data.spread import Spread
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.fitting.unknowns import Unknown
from unmodelled.diagnosis.judge.last_fits import LastFit


@dataclass(frozen=True, eq=False)
class Numbers:
    """The numbers of a fit that all experiments share."""

    last: LastFit

    @cached_property
    def _open(self) -> dict[str, tuple[int, Unknown]]:
        """Place among the open numbers, and bounds, by name in the fit."""
        return {u.name: (k, u) for k, u in enumerate(self.last.around.columns.unknowns(own=False))}

    @property
    def fitted(self) -> FittedHypothesis:
        """Return the fit."""
        return self.last.fitted

    @cached_property
    def _covariance(self) -> Array:
        """Covariance (open, open) of the linearised fit, in plausible sizes."""
        return np.asarray(np.linalg.inv(self.last.around.normal[:-1, :-1]), np.float64)

    @cached_property
    def _scatter(self) -> Array:
        """Covariance (open, open) by the experiments that are left out (jackknife), in plausible sizes."""
        steps = self.last.left_out.steps
        off = steps - steps.mean(axis=0)
        return np.asarray((len(steps) - 1) / len(steps) * off.T @ off)

    def error(self, name: str) -> float:
        """Return the standard error of a number that leaves, SI: the larger of both."""
        spread = self._spread(self.last.names[name])
        return max(spread.curvature, spread.experiments)

    def _spread(self, own: str) -> Spread:
        """How sure an open number is."""
        k, unknown = self._open[own]
        squares = self._covariance[k, k], self._scatter[k, k]
        curvature, experiments = (np.sqrt(squares) * unknown.scale).tolist()
        return Spread(curvature, experiments, len(self.last.left_out.steps), (unknown.low, unknown.high))

    def interval(self, own: str, level: float) -> Interval:
        """Return the interval, SI, of a number of the fit, cut at its bounds; of no width if not fitted."""
        value = self.fitted.fit.values[own]
        return self._spread(own).interval(value, level) if own in self._open else (value, value)

    def estimate(self, name: str, unit: str, known: float, level: float) -> Estimate:
        """Return a number that leaves with its interval; one that was not fitted has no width.

        It is determined where the interval is narrower than the number or its plausible size.
        """
        own = self.last.names.get(name, "")
        if own not in self._open:
            value = _value_in(self.last, name)
            return Estimate(unit, known, value, (value, value))
        value, (_, unknown), spread = self.last.values[name], self._open[own], self._spread(own)
        determined = spread.reach(level) < max(abs(value), unknown.scale)
        at_bound, ends = self.fitted.at_bound(own), self.interval(own, level)
        return Estimate(unit, known, value, ends, determined, at_bound, spread=spread)

    def spread(self, names: Sequence[str]) -> Array:
        """Return the covariance (names, names) of relative changes of fitted numbers, none of them zero."""
        rows = [self._open[name][0] for name in names]
        size = np.array([self._open[name][1].scale / self.fitted.fit.values[name] for name in names])
        found = (self._covariance + self._scatter)[np.ix_(rows, rows)]
        return np.asarray(found * np.outer(size, size))

    def distance(self, values: Mapping[str, float], close: float) -> float:
        """Return the squared distance of other values, SI by name in the fit, in standard deviations.

        Differences are logarithms of ratios, so that numbers may change together as a product that the logs
        determine allows; the share `close` counts as one standard deviation more.
        """
        ratio = np.array([value / self.fitted.fit.values[name] for name, value in values.items()])
        off = np.where(ratio > 0.0, np.log(np.where(ratio > 0.0, ratio, 1.0)), ratio - 1.0)
        return float(off @ np.linalg.solve(self.spread([*values]) + close**2 * np.eye(len(off)), off))

    def correlations(self, names: Sequence[str]) -> dict[tuple[str, str], float]:
        """Return correlations by pair of names; none of fewer than two numbers."""
        there = [name for name in names if self.last.names.get(name) in self._open]
        rows = [self._open[self.last.names[name]][0] for name in there]
        spread = self._covariance[np.ix_(rows, rows)]
        size = np.sqrt(np.diag(spread))
        found = np.clip(spread / np.outer(size, size), -1.0, 1.0)
        pairs = product(enumerate(there), enumerate(there))
        return {(a, b): float(found[i, k]) for (i, a), (k, b) in pairs} if len(there) > 1 else {}


def _value_in(last: LastFit, name: str) -> float:
    full = last.leaving.full
    return float(dict(zip((p.name for p in full.parameters), full.values, strict=True))[name])
