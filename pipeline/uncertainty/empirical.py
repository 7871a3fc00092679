"""Densities from Monte Carlo samples: smoothed histograms, the reference of section 3.4."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import fft
from scipy.interpolate import PchipInterpolator

from unmodelled.base.arrays import Array
from unmodelled.base.compiling import compiled
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.density import Density, GaussianDensity

#: Of every output; a range that must grow merges them by pairs.
BINS = 1024
#: Of the range of the first samples, added on either side for later ones.
MARGIN = 0.25
#: Knots of the spline, a bin apart: the histogram, and room for its smoothed ends.
KNOTS = 2 * BINS
#: Probability of a bin that may be a rounding error of the Fourier transform.
ROUNDING = 1e-14
#: Rounds of the smoothing width, each from the roughness that the one before shows.
ROUNDS = 5
#: Roughness, in bins^-5, of what is flat as far as samples can tell.
LEAST = 1e-30
#: Probability that a window may leave out.
NEGLIGIBLE = 1e-9


class Histogram:
    """Histograms of L outputs with `BINS` equal bins each; samples can be added in chunks."""

    def __init__(self) -> None:
        self.size = 0  # samples of each output so far
        self.low = self.width = np.empty(0)  # (L,), lower ends of the first bins, widths of all
        self.counts = np.empty((BINS, 0))  # (BINS, L)

    def add(self, samples: Array) -> None:
        """Add samples (S, L); the first chunk sets the ranges, later ones can widen them."""
        samples = np.ascontiguousarray(samples, np.float64)
        least, most = samples.min(0), samples.max(0)
        finite = np.isfinite(least) & np.isfinite(most)
        if not finite.all():
            raise BadInput(
                f"samples of output {np.argmin(finite) + 1} of {finite.size} are not finite: narrow "
                "the bounds"
            )
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
            raise BadInput(
                f"samples of output {np.argmax(constant) + 1} of {constant.size} are all equal: no "
                "parameter changes it"
            )
        reach = most - least
        self.low, self.width = least - MARGIN * reach, (1.0 + 2.0 * MARGIN) * reach / BINS
        self.counts = np.zeros((BINS, least.size))

    def _double(self, outputs: Any, offset: int) -> None:
        """Double the bin width of some outputs (L,); the existing counts start at bin `offset`."""
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


@dataclass(frozen=True, eq=False)
class Empirical(Density):
    """Densities of L outputs from samples: derivatives of monotone splines through cumulative histograms.

    One further sample, spread as a Gaussian of the samples' mean and standard deviation, is added to the S
    samples: where no samples are, the density is 1 / (S + 1) of that Gaussian, so that its logarithm is
    finite.
    """

    low: Array  # (L,), first knots of the splines
    width: Array  # (L,), distances of the knots
    #: (4, knots - 1, L), of the cumulative probability, highest power first, in (y - low) / width minus the
    #: number of the knot.
    pieces: Array
    tails: GaussianDensity  # of the samples' mean and standard deviation
    share: float  # weight of `tails`, 1 / (S + 1)

    @classmethod
    def of(cls, samples: Array) -> Empirical:
        """Estimate densities from samples (S, L) that fit into memory; otherwise fill a `Histogram`."""
        histogram = Histogram()
        histogram.add(samples)
        return cls.from_histogram(histogram)

    @classmethod
    def from_histogram(cls, histogram: Histogram) -> Empirical:
        """Estimate densities by Gaussian smoothing of a histogram and a spline through it."""
        if not histogram.size:
            raise ValueError("the histogram holds no samples")
        shares = histogram.counts / histogram.size
        spectrum = fft.rfft(np.pad(shares, ((KNOTS // 4, KNOTS // 4), (0, 0))), axis=0)
        frequency = 2.0 * np.pi * fft.rfftfreq(KNOTS)[:, None]
        middle = np.arange(BINS)[:, None] + 0.5
        mean = (shares * middle).sum(0)
        std = np.sqrt((shares * (middle - mean) ** 2).sum(0))
        h = smoothing_width(shares, std, np.abs(spectrum) ** 2, frequency, histogram.size)
        smooth = fft.irfft(spectrum * np.exp(-0.5 * (frequency * h) ** 2), KNOTS, axis=0)
        smooth[smooth < ROUNDING] = 0.0
        knots = np.concatenate([np.zeros((1, mean.size)), np.cumsum(smooth, axis=0)])
        spline = PchipInterpolator(np.arange(KNOTS + 1), knots / knots[-1])
        low, width = histogram.low - KNOTS // 4 * histogram.width, histogram.width
        tails = GaussianDensity(histogram.low + mean * width, std * width)
        return cls(low, width, spline.c, tails, 1.0 / (histogram.size + 1))

    def log_density(self, y: Array) -> Array:
        a, b, c, _, t = self._piece(y)
        value = (1.0 - self.share) * ((3.0 * a * t + 2.0 * b) * t + c) / self.width
        logarithm = np.log(value, out=np.full_like(value, -np.inf), where=value > 0.0)
        return np.asarray(np.logaddexp(logarithm, np.log(self.share) + self.tails.log_density(y)))

    def cumulative(self, y: Array) -> Array:
        a, b, c, d, t = self._piece(y)
        inside = ((a * t + b) * t + c) * t + d
        return np.asarray((1.0 - self.share) * inside + self.share * self.tails.cumulative(y))

    def window(self) -> Array:
        risen = self.pieces[3]
        first = np.argmax(risen > NEGLIGIBLE, axis=0) - 1
        last = np.argmax(risen > 1.0 - NEGLIGIBLE, axis=0)
        return np.asarray(self.low[:, None] + self.width[:, None] * np.stack([first, last], -1))

    def _piece(self, y: Array) -> tuple[Array, ...]:
        """Return the coefficients of the pieces at `y`, highest power first, and their variable."""
        place = np.clip((y - self.low) / self.width, 0.0, self.pieces.shape[1])
        knot = np.minimum(np.nan_to_num(place), self.pieces.shape[1] - 1).astype(np.int64)
        return (*self.pieces[:, knot, np.arange(self.low.size)], place - knot)


def smoothing_width(shares: Array, std: Array, power: Array, frequency: Array, size: int) -> Array:
    """Return the standard deviations (L,), in bins, of the Gaussians that smooth histograms (BINS, L).

    The width of least mean integrated squared error is (2 sqrt(pi) size R)^(-1/5), with R the integral of the
    squared second derivative of the density. R is estimated from the samples, smoothed by the same width,
    without products of a sample with itself. The width lies between the bin width of Freedman and Diaconis
    (narrow enough for separate peaks) and the width of Silverman (wide enough for few samples).
    """
    rising = np.cumsum(shares, axis=0)
    quartiles = np.maximum(np.argmax(rising > 0.75, axis=0) - np.argmax(rising > 0.25, axis=0), 1.0)
    narrowest = quartiles / np.sqrt(3.0) * size ** (-1 / 3)
    widest = 0.9 * np.minimum(std, quartiles / 1.34) * size**-0.2
    pairs, h = (power - 1.0 / size) * frequency**4, widest
    for _ in range(ROUNDS):
        roughness = (pairs * np.exp(-((frequency * h) ** 2))).sum(0) * frequency[1] / np.pi
        best = (2.0 * np.sqrt(np.pi) * size * np.maximum(roughness, LEAST)) ** -0.2
        h = np.clip(best, narrowest, widest)
    return np.asarray(np.maximum(h, 1.0))
