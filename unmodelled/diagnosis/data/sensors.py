"""What the outputs of measured experiments show of the states and of their rates, and how noisy it is."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_coeffs

from unmodelled.diagnosis.data.gap import output_scale
from unmodelled.logs.clock import delayed
from unmodelled.logs.differentiate import ORDER, noise, resolution, smooth_derivative
from unmodelled.logs.logs import Logs

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Draws of noise from which the error is estimated.
REPLICATES = 3


@dataclass(frozen=True)
class SmoothedSlope:
    """The smoothed derivative of one output.

    Attributes:
        y: (samples,) the smoothed output. v: (samples,) its derivative, per second. width: in samples.
    """

    y: Array
    v: Array
    width: int

    @classmethod
    def of(cls, y: Array, offsets: Indices, period: float) -> SmoothedSlope:
        """Of the samples (samples,) of experiments one after the other, see `smooth_derivative`."""
        return cls(*smooth_derivative(y, offsets, period))

    def error(self, noise: float, offsets: Indices, period: float) -> Array:
        """(samples,) standard deviation of the error of `v`, by the parametric bootstrap.

        The smoothed output is taken for the truth, given new noise and smoothed again: what comes out is
        wrong by the noise that passes the filter and by what the filter bends. Samples at the same distance
        from an end of their experiment, where half of the filter is missing, share an estimate, as do all
        others.
        """
        truth = np.concatenate([_derivative(self.y[a:b], period) for a, b in pairwise(offsets)])
        square = np.zeros_like(truth)
        for k in range(REPLICATES):
            noisy = self.y + noise * np.random.default_rng(k).standard_normal(len(truth))
            square += (smooth_derivative(noisy, offsets, period)[1] - truth) ** 2 / REPLICATES
        return np.sqrt(self._shared(square, offsets))

    def _shared(self, square: Array, offsets: Indices) -> Array:
        """The mean over samples that have as much of the filter."""
        within = np.concatenate([np.arange(b - a) for a, b in pairwise(offsets)])
        left = np.concatenate([np.arange(b - a)[::-1] for a, b in pairwise(offsets)])
        near = np.minimum(np.minimum(within, left), self.width)
        kind = np.where(left < within, self.width + 1 + near, near)
        kind[near == self.width] = self.width
        count = np.bincount(kind)
        return np.asarray((np.bincount(kind, square) / np.maximum(count, 1))[kind])


def _derivative(y: Array, period: float) -> Array:
    return np.asarray(CubicSpline(period * np.arange(len(y)), y)(period * np.arange(len(y)), 1))


#: Standard deviations of an output.
LEAST_NOISE = 1e-9


@dataclass(frozen=True, eq=False)
class Sensors:
    """The outputs of some experiments. What it takes long to find out is found out once.

    Attributes:
        logs: of all experiments; their states do not count. runs: numbers of those that say how noisy the
            outputs are and how far to smooth them, all unless given; only their slopes are known.
        slopes: by number of an output, those that are known already.
    """

    logs: Logs
    runs: tuple[int, ...] | None = None
    slopes: dict[int, SmoothedSlope] = field(default_factory=dict, repr=False)
    _errors: dict[int, Array] = field(default_factory=dict, repr=False)

    @cached_property
    def noise(self) -> Array:
        """(outputs,) standard deviation of the sensors' noise, at least that of their resolution.

        What a smooth curve leaves of the output: unlike differences of neighbours it sees noise that is not
        white, such as that of a speed which the drive itself takes from an encoder.
        """
        left = [self._rough(j) for j in range(len(self.logs.outputs))]
        white = [
            float(np.sqrt(np.mean([noise(part) ** 2 for part in self._parts(j)]))) for j in range(len(left))
        ]
        steps = [resolution(self._parts(j)) / sqrt(12.0) for j in range(len(left))]
        return np.asarray(np.max(np.stack([left, white, steps, LEAST_NOISE * self.scale]), axis=0))

    @cached_property
    def scale(self) -> Array:
        """(outputs,) in units of which errors are told, of all experiments; see `output_scale`."""
        return output_scale(self.logs)

    def _rough(self, output: int) -> float:
        # half the width that suits the derivative: the curve itself is then hardly bent
        width = 2 * (self._smoothed(output).width // 4) + 1
        if width <= ORDER + 1:
            return 0.0
        kernel = -savgol_coeffs(width, ORDER)
        kernel[width // 2] += 1.0
        left = np.concatenate([np.convolve(part, kernel, "valid") for part in self._parts(output)])
        # the median is not led astray by corners and spikes, the mean not by the steps of an encoder
        spread = min(np.sqrt(np.mean(left**2)), 1.4826 * np.median(np.abs(left)))
        return float(spread / np.linalg.norm(kernel))

    def _parts(self, output: int) -> list[Array]:
        return [self.logs.y[self.logs.rows(i), output] for i in self._known]

    @property
    def _known(self) -> tuple[int, ...]:
        return tuple(range(len(self.logs))) if self.runs is None else self.runs

    @cached_property
    def _rows(self) -> NDArray[np.int64]:
        """The samples of the runs."""
        return np.concatenate([np.arange(*self.logs.offsets[[i, i + 1]]) for i in self._known])

    @cached_property
    def _offsets(self) -> NDArray[np.int64]:
        """Where each of the runs begins among these."""
        return np.concatenate([[0], np.cumsum(np.diff(self.logs.offsets)[list(self._known)])])

    def _spread(self, values: Array) -> Array:
        """(samples,) of all experiments from those of the runs; 0 in the others."""
        found = np.zeros(len(self.logs.y))
        found[self._rows] = values
        return found

    def shown(self, output: int, delay: float) -> Array:
        """(samples,) what an output with a delay (s) says of every moment, which it shows later."""
        return self._earlier(self.logs.y[:, output], delay)

    def slope(self, output: int, delay: float) -> Array:
        """(samples,) the smoothed derivative of `shown`, per second."""
        return self._earlier(self._spread(self._smoothed(output).v), delay)

    def slope_error(self, output: int) -> Array:
        """(samples,) standard deviation of the error of `slope` without delay, per second."""
        if output not in self._errors:
            noise, period = float(self.noise[output]), self.logs.period
            self._errors[output] = self._spread(self._smoothed(output).error(noise, self._offsets, period))
        return self._errors[output]

    def _smoothed(self, output: int) -> SmoothedSlope:
        if output not in self.slopes:
            logs = self.logs
            self.slopes[output] = SmoothedSlope.of(logs.y[self._rows, output], self._offsets, logs.period)
        return self.slopes[output]

    def _earlier(self, values: Array, delay: float) -> Array:
        if delay == 0.0:
            return values
        return delayed(values[:, None], self.logs.offsets, self.logs.period, [-delay], "cubic")[:, 0]
