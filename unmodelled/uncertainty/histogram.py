"""Histograms of many outputs, filled chunk by chunk; their ranges grow with the samples."""

from __future__ import annotations

from typing import Any

import numpy as np

from unmodelled.base.compiling import compiled
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.density import Array

#: Of every output; a range that must grow merges them by pairs.
BINS = 1024
#: Of the range of the first samples, added on either side for later ones.
MARGIN = 0.25


class Histogram:
    """Counts of samples in `BINS` equal bins for each of L outputs.

    Attributes:
        low, width: (L,) lower end of the first bin and width of a bin, in the unit of the outputs.
        counts: (BINS, L).
        size: samples so far, of each output.
    """

    def __init__(self) -> None:
        self.size = 0
        self.low = self.width = np.empty(0)
        self.counts = np.empty((BINS, 0))

    def add(self, samples: Array) -> None:
        """Count samples (S, L); the first chunk sets the ranges, which later ones can only widen.

        Raises:
            BadInput: samples that are not finite, or an output whose first samples are all equal; names it.
        """
        samples = np.ascontiguousarray(samples, np.float64)
        least, most = samples.min(0), samples.max(0)
        finite = np.isfinite(least) & np.isfinite(most)
        if not finite.all():
            raise BadInput(f"samples of output {np.argmin(finite) + 1} of {finite.size} are not finite")
        if not self.size:
            self._start(least, most)
        while (short := least < self.low).any():
            self._double(short, BINS // 2)
        while (short := most > self.low + BINS * self.width).any():
            self._double(short, 0)
        _count(samples, self.low, self.width, self.counts)
        self.size += len(samples)

    def _start(self, least: Array, most: Array) -> None:
        # a range of a few rounding errors of the values counts as none
        constant = most - least <= 1e-12 * np.maximum(np.abs(least), np.abs(most))
        if constant.any():
            raise BadInput(f"samples of output {np.argmax(constant) + 1} of {constant.size} are all equal")
        reach = most - least
        self.low, self.width = least - MARGIN * reach, (1.0 + 2.0 * MARGIN) * reach / BINS
        self.counts = np.zeros((BINS, least.size))

    def _double(self, outputs: Any, offset: int) -> None:
        """Bins twice as wide for some outputs (L,); what there is starts at bin `offset`."""
        pairs = self.counts[0::2, outputs] + self.counts[1::2, outputs]
        self.low[outputs] -= offset * 2.0 * self.width[outputs]
        self.width[outputs] *= 2.0
        self.counts[:, outputs] = 0.0
        self.counts[offset : offset + BINS // 2, outputs] = pairs


@compiled
def _count(samples: Array, low: Array, width: Array, counts: Array) -> None:
    for s in range(len(samples)):
        for l in range(low.size):
            k = int((samples[s, l] - low[l]) / width[l])
            counts[min(max(k, 0), BINS - 1), l] += 1.0
