"""The logger's clock: samples that are not exactly a period apart, and seconds that are too short."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from pipeline.rigs.withheld.chain.part import Part, Readings

JITTER = 0.01, 0.08  # rms, in periods
FASTEST = 1e-3


@dataclass(frozen=True)
class Clock(Part):
    """Samples are taken `jitter` (rms, periods) beside the grid; time runs fast by the share `fast`.

    `stamped`: whether the log has the instants of the samples; otherwise it has the grid.

    Attributes:
        jitter: standard deviation of the sampling instants, periods.
        fast: share by which the time stamps run fast.
        stamped: whether the log has the instants of the samples; otherwise it has the uniform grid.
    """

    jitter: float
    fast: float
    stamped: bool

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Clock:
        """Draw a clock."""
        return cls(float(rng.uniform(*JITTER)), float(rng.uniform(0.0, FASTEST)), bool(rng.uniform() < 0.5))

    def read(self, readings: Readings, rng: np.random.Generator) -> Readings:
        grid = readings.t[:, 0]
        period = grid[1] - grid[0]
        # a third of a period at most, so that no sample overtakes another
        off = np.clip(self.jitter * rng.standard_normal(readings.t.shape), -0.33, 0.33)
        instants = np.clip(readings.t + period * off, grid[0], grid[-1])
        outputs = {name: _at(grid, y, instants) for name, y in readings.outputs.items()}
        stamps = (instants if self.stamped else readings.t) * (1.0 + self.fast)
        return replace(readings, t=stamps, outputs=outputs)


def _at(grid: np.ndarray, y: np.ndarray, instants: np.ndarray) -> np.ndarray:
    return np.stack([CubicSpline(grid, y[:, i])(instants[:, i]) for i in range(y.shape[1])], axis=1)
