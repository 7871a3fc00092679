"""How sure a fitted number is: what its interval at any level is made from."""

from __future__ import annotations

from dataclasses import dataclass

from scipy.special import ndtri, stdtrit


@dataclass(frozen=True)
class Spread:
    """Standard errors of a number, SI, and its bounds."""

    curvature: float  # of the linearised fit
    experiments: float  # of the fits without one experiment each (jackknife)
    count: int  # experiments that were left out, each once
    bounds: tuple[float, float]

    def reach(self, level: float) -> float:
        """Return half of the interval, SI: the jackknife of few experiments by Student's t."""
        upper = 0.5 + 0.5 * level
        by_runs = float(stdtrit(self.count - 1, upper)) * self.experiments if self.count > 1 else 0.0
        return float(max(by_runs, ndtri(upper) * self.curvature))

    def interval(self, value: float, level: float) -> tuple[float, float]:
        """Return the interval, SI, cut at the bounds.

        Examples:
            >>> low, high = Spread(0.1, 0.05, 8, (0.0, 1e3)).interval(0.15, 0.95)
            >>> low, round(high, 3)
            (0.0, 0.346)
        """
        reach, (low, high) = self.reach(level), self.bounds
        return max(value - reach, low), min(value + reach, high)
