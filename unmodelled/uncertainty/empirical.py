"""Densities from Monte Carlo samples: splines on histograms, the reference of section 3.4."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft
from scipy.interpolate import PchipInterpolator

from unmodelled.uncertainty.density import Array, Density
from unmodelled.uncertainty.gaussian import Gaussian
from unmodelled.uncertainty.histogram import BINS, Histogram

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


@dataclass(frozen=True, eq=False)
class Empirical(Density):
    """The derivative of a monotone cubic spline through a smoothed cumulative histogram.

    To S samples comes one more that is spread as the Gaussian of their mean and standard deviation: where no
    samples are, the density is this Gaussian's share 1 / (S + 1), so that its logarithm is finite.

    Attributes:
        low, width: (L,) start and spacing of the spline's knots, in the unit of the outputs.
        pieces: (4, knots - 1, L) polynomials of the cumulative probability in (y - low) / width less the
            number of the knot, highest power first.
        tails: the Gaussian.
        share: of the Gaussian, 1 / (S + 1).
    """

    low: Array
    width: Array
    pieces: Array
    tails: Gaussian
    share: float

    @classmethod
    def of(cls, samples: Array) -> Empirical:
        """From samples (S, L) that fit into memory; else fill a `Histogram` and use `from_histogram`.

        Raises:
            BadInput: samples of an output are not finite or all equal.
        """
        histogram = Histogram()
        histogram.add(samples)
        return cls.from_histogram(histogram)

    @classmethod
    def from_histogram(cls, histogram: Histogram) -> Empirical:
        """Smooth the histogram by a Gaussian of the width `smoothing_width` says, and put a spline on it."""
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
        tails = Gaussian(histogram.low + mean * width, std * width)
        return cls(low, width, spline.c, tails, 1.0 / (histogram.size + 1))

    def log_density(self, y: Array) -> Array:
        """See `Density`; finite everywhere."""
        a, b, c, _, t = self._piece(y)
        value = (1.0 - self.share) * ((3.0 * a * t + 2.0 * b) * t + c) / self.width
        logarithm = np.log(value, out=np.full_like(value, -np.inf), where=value > 0.0)
        return np.asarray(np.logaddexp(logarithm, np.log(self.share) + self.tails.log_density(y)))

    def cumulative(self, y: Array) -> Array:
        """See `Density`."""
        a, b, c, d, t = self._piece(y)
        inside = ((a * t + b) * t + c) * t + d
        return np.asarray((1.0 - self.share) * inside + self.share * self.tails.cumulative(y))

    def window(self) -> Array:
        """See `Density`: the knots between which the spline rises."""
        risen = self.pieces[3]
        first = np.argmax(risen > NEGLIGIBLE, axis=0) - 1
        last = np.argmax(risen > 1.0 - NEGLIGIBLE, axis=0)
        return np.asarray(self.low[:, None] + self.width[:, None] * np.stack([first, last], -1))

    def _piece(self, y: Array) -> tuple[Array, ...]:
        """Coefficients of the pieces at `y`, highest power first, and the variable they are for."""
        place = np.clip((y - self.low) / self.width, 0.0, self.pieces.shape[1])
        knot = np.minimum(np.nan_to_num(place), self.pieces.shape[1] - 1).astype(np.int64)
        return (*self.pieces[:, knot, np.arange(self.low.size)], place - knot)


def smoothing_width(shares: Array, std: Array, power: Array, frequency: Array, size: int) -> Array:
    """Standard deviation of the Gaussian that smooths a histogram of `size` samples.

    The width of least mean integrated squared error is (2 sqrt(pi) size R)^(-1/5), with R the integral of the
    squared second derivative of the density; R is taken from the samples smoothed by that very width, without
    products of a sample with itself. The result is kept between the spread of a bin of Freedman and Diaconis'
    rule, narrow enough for separate peaks, and Silverman's width, wide enough for few samples.

    Args:
        shares: (BINS, L) of the samples. std: (L,) in bins. power: (frequencies, L) squared magnitude of the
            shares' Fourier transform. frequency: (frequencies, 1) rad per bin.

    Returns:
        (L,) in bins, at least 1.
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
