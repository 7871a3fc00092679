"""Noise, values and smoothed slopes of the outputs of measured experiments."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from math import sqrt

import numpy as np
from scipy.interpolate import CubicSpline

from unmodelled.base.arrays import Array, Indices
from unmodelled.diagnosis.data.gap import output_scale
from unmodelled.logs.clock import EVERY, Rows, Splines
from unmodelled.logs.differentiate import ORDER, kernel, noise, resolution, smooth_derivative
from unmodelled.logs.logs import Logs

#: Random draws of noise from which the error of a slope is estimated.
REPLICATES = 3


@dataclass(frozen=True)
class SmoothedSlope:
    """The smoothed derivative of one output."""

    y: Array  # smoothed output, (samples,), in its unit
    v: Array  # its derivative, (samples,), per second
    width: int  # of the smoothing filter, samples

    @classmethod
    def of(cls, y: Array, offsets: Indices, period: float) -> SmoothedSlope:
        """Smooth and differentiate an output (samples,), see `smooth_derivative`; period in s."""
        return cls(*smooth_derivative(y, offsets, period))

    def error(self, noise: float, offsets: Indices, period: float) -> Array:
        """Estimate the standard deviation (samples,) of the error of `v` by the parametric bootstrap.

        The smoothed output is taken as the truth, noise is added, and it is smoothed again. The error has the
        noise that passes the filter and the filter's bias. Samples at the same distance from an end of their
        experiment, where half of the filter is missing, share an estimate, as do all others.
        """
        truth = np.concatenate([_derivative(self.y[a:b], period) for a, b in pairwise(offsets)])
        square = np.zeros_like(truth)
        for k in range(REPLICATES):
            noisy = self.y + noise * np.random.default_rng(k).standard_normal(len(truth))
            square += (smooth_derivative(noisy, offsets, period)[1] - truth) ** 2 / REPLICATES
        return np.sqrt(self._shared(square, offsets))

    def _shared(self, square: Array, offsets: Indices) -> Array:
        """Return means over the samples at which the filter has the same width."""
        within = np.concatenate([np.arange(b - a) for a, b in pairwise(offsets)])
        left = np.concatenate([np.arange(b - a)[::-1] for a, b in pairwise(offsets)])
        near = np.minimum(np.minimum(within, left), self.width)
        kind = np.where(left < within, self.width + 1 + near, near)
        kind[near == self.width] = self.width
        count = np.bincount(kind)
        return np.asarray((np.bincount(kind, square) / np.maximum(count, 1))[kind])


def _derivative(y: Array, period: float) -> Array:
    return np.asarray(CubicSpline(period * np.arange(len(y)), y)(period * np.arange(len(y)), 1))


#: Smallest noise, in standard deviations of the output: errors in units of the noise stay finite.
LEAST_NOISE = 1e-9


@dataclass(frozen=True, eq=False)
class Sensors:
    """Estimate noise and slopes of the outputs, each once."""

    logs: Logs  # of all experiments; their states are not used
    #: Experiments from which noise and smoothing are estimated, None for all; only their slopes are known.
    runs: tuple[int, ...] | None = None
    #: Slopes that are known already, by number of the output.
    slopes: dict[int, SmoothedSlope] = field(default_factory=dict, repr=False)
    _errors: dict[int, Array] = field(default_factory=dict, repr=False)
    _slopes: dict[int, Array] = field(default_factory=dict, repr=False)
    _splines: dict[tuple[int, bool], Splines] = field(default_factory=dict, repr=False)

    @cached_property
    def noise(self) -> Array:
        """Return the noise, shape (outputs,): a standard deviation, at least that of the resolution.

        It is the residual of a smooth curve. Unlike differences of neighbouring samples it contains noise
        that is not white, such as that of a speed which a drive computes from an encoder.
        """
        left = [self._rough(j) for j in range(len(self.logs.outputs))]
        white = [
            float(np.sqrt(np.mean([noise(part) ** 2 for part in self._parts(j)]))) for j in range(len(left))
        ]
        steps = [resolution(self._parts(j)) / sqrt(12.0) for j in range(len(left))]
        return np.asarray(np.max(np.stack([left, white, steps, LEAST_NOISE * self.scale]), axis=0))

    @cached_property
    def scale(self) -> Array:
        """Return the scale, shape (outputs,), of errors, over all experiments; see `output_scale`."""
        return output_scale(self.logs)

    def _rough(self, output: int) -> float:
        # half the width that suits the derivative: the curve itself is then hardly bent
        width = 2 * (self._smoothed(output).width // 4) + 1
        if width <= ORDER + 1:
            return 0.0
        removes = -kernel(width, 0, width // 2)
        removes[width // 2] += 1.0
        left = np.concatenate([np.convolve(part, removes, "valid") for part in self._parts(output)])
        # the median is not led astray by corners and spikes, the mean not by the steps of an encoder
        spread = min(np.sqrt(np.mean(left**2)), 1.4826 * np.median(np.abs(left)))
        return float(spread / np.linalg.norm(removes))

    def _parts(self, output: int) -> list[Array]:
        return [self.logs.y[self.logs.rows(i), output] for i in self._known]

    @property
    def _known(self) -> tuple[int, ...]:
        return tuple(range(len(self.logs))) if self.runs is None else self.runs

    @cached_property
    def _rows(self) -> Indices:
        """Numbers of the samples of the runs, shape (samples of the runs,)."""
        return np.concatenate([np.arange(*self.logs.offsets[[i, i + 1]]) for i in self._known])

    @cached_property
    def _offsets(self) -> Indices:
        """First samples of the runs among `_rows`, shape (runs + 1,)."""
        return np.concatenate([[0], np.cumsum(np.diff(self.logs.offsets)[list(self._known)])])

    def _spread(self, values: Array) -> Array:
        """Return values at all samples, shape (samples,), from those of the runs; 0 in other experiments."""
        found = np.zeros(len(self.logs.y))
        found[self._rows] = values
        return found

    def shown(self, output: int, delay: float, rows: Rows = EVERY) -> Array:
        """Return an output (rows,) at the time when it was measured; delay in s."""
        return self._earlier(output, False, delay, rows)

    def slope(self, output: int, delay: float, rows: Rows = EVERY) -> Array:
        """Return the smoothed derivative (rows,) of `shown`, per second; delay in s."""
        return self._earlier(output, True, delay, rows)

    def slope_error(self, output: int) -> Array:
        """Return the standard deviation (samples,) of the error of `slope` without delay, per second."""
        if output not in self._errors:
            noise, period = float(self.noise[output]), self.logs.period
            self._errors[output] = self._spread(self._smoothed(output).error(noise, self._offsets, period))
        return self._errors[output]

    def _smoothed(self, output: int) -> SmoothedSlope:
        if output not in self.slopes:
            logs = self.logs
            self.slopes[output] = SmoothedSlope.of(logs.y[self._rows, output], self._offsets, logs.period)
        return self.slopes[output]

    def _earlier(self, output: int, slope: bool, delay: float, rows: Rows) -> Array:
        if delay == 0.0:
            return self._logged(output, slope)[rows]
        if (output, slope) not in self._splines:
            self._splines[output, slope] = Splines.of(self._logged(output, slope), self.logs.offsets)
        return self._splines[output, slope].ahead(delay / self.logs.period, rows)

    def _logged(self, output: int, slope: bool) -> Array:
        if not slope:
            return self.logs.y[:, output]
        if output not in self._slopes:
            self._slopes[output] = self._spread(self._smoothed(output).v)
            if any(self.logs.continues):
                self._fill_others(output, self._slopes[output])
        return self._slopes[output]

    def _fill_others(self, output: int, slope: Array) -> None:
        """Fill in the slope in other experiments: hidden states go on through them to the next part."""
        others = [i for i in range(len(self.logs)) if i not in self._known]
        if others:
            whole = Sensors(self.logs, tuple(others))
            slope[whole._rows] = whole._smoothed(output).v
