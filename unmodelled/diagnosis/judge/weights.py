"""Weights of residuals over windows: how many samples are compared, and how many of them are independent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array, Indices
from unmodelled.diagnosis.columns.path import Path
from unmodelled.diagnosis.judge.residual import correlation_time
from unmodelled.diagnosis.judge.tails import scale, shares

#: Samples that are compared: at least so many a window, at most so many in all, where there are more.
FEWEST, MOST = 250, 20_000
#: Times that scale and correlation time, each of which needs the other, are found in turn.
PASSES = 2


@dataclass(frozen=True, eq=False)
class Weights:
    """Weights of residuals over the same windows, those of the base, so that hypotheses compare."""

    rows: Indices  # samples of a window that are compared, (rows,)
    root: Array  # weights of their residuals in sensor noise, (windows, rows, outputs); 0 where none counts
    each: Array  # independent samples of windows, (windows, outputs)

    @classmethod
    def of(cls, path: Path) -> Weights:
        """Weigh the residuals of a path by their own scale and correlation time.

        Windows count for the correlation time as they count for the scale.
        """
        windows, K, outputs = path.error.shape
        step = max(1, min(K // FEWEST, int(np.ceil(windows * K / MOST))))
        rows = np.arange(step - 1, K, step)[: max(1, K // step)]
        error, use = path.error[:, rows], path.root[:, rows] > 0.0
        counted, share = use.sum(axis=1), np.ones((windows, outputs))
        for _ in range(PASSES):
            counting = error * np.sqrt(share)[:, None]
            tau = np.array([correlation_time(counting[..., j], use[..., j]) for j in range(outputs)])
            squares, each = (error**2 * use).sum(axis=1) / tau, counted / tau
            usual = np.maximum(scale(squares, each), 1e-12)
            share = shares(squares, each, usual)
        return cls(rows, use / np.sqrt(usual * tau), each)

    @property
    def samples(self) -> float:
        """Return the independent samples of all windows and outputs, at least two."""
        return max(2.0, float(self.each.sum()))

    def flat(self, columns: Array) -> Array:
        """Return weighted columns, shape (windows, rows * outputs, N), from (windows, K, outputs, N)."""
        weighted = np.nan_to_num(columns[:, self.rows]) * self.root[..., None]
        windows, rows, outputs, many = weighted.shape
        return weighted.reshape(windows, rows * outputs, many)

    def price(self, numbers: int) -> float:
        """Return the nats that numbers cost, log n / 2 each (Schwarz 1978)."""
        return 0.5 * numbers * float(np.log(self.samples))
