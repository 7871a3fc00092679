"""What the outputs of measured experiments show of the states, and how noisy it is."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs

from pipeline.diagnosis.slopes import Slope
from pipeline.measurements.clock import shifted
from pipeline.measurements.logs import Logs
from pipeline.numerics.differentiate import ORDER, noise

Array = NDArray[np.float64]

#: Standard deviations of an output.
LEAST_NOISE = 1e-9


@dataclass(frozen=True, eq=False)
class Sensors:
    """The outputs of some experiments. What it takes long to find out is found out once.

    Attributes:
        logs: of the experiments; their states do not count.
    """

    logs: Logs
    _slopes: dict[int, Slope] = field(default_factory=dict, repr=False)
    _errors: dict[int, Array] = field(default_factory=dict, repr=False)

    @cached_property
    def noise(self) -> Array:
        """(outputs,) standard deviation of the sensors' noise, at least a rounding error.

        What a smooth curve leaves of the output: unlike differences of neighbours it sees noise that is not
        white, such as that of a speed which the drive itself takes from an encoder.
        """
        left = [self._rough(j) for j in range(len(self.logs.outputs))]
        white = [np.sqrt(np.mean([noise(part) ** 2 for part in self._parts(j)])) for j in range(len(left))]
        size = np.std(self.logs.y, axis=0)
        return np.asarray(np.maximum(np.maximum(left, white), LEAST_NOISE * np.where(size > 0.0, size, 1.0)))

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
        return [self.logs.y[self.logs.rows(i), output] for i in range(len(self.logs))]

    def shown(self, output: int, delay: float) -> Array:
        """(samples,) what an output with a delay (s) says of every moment, which it shows later."""
        return self._earlier(self.logs.y[:, output], delay)

    def slope(self, output: int, delay: float) -> Array:
        """(samples,) the smoothed derivative of `shown`, per second."""
        return self._earlier(self._smoothed(output).v, delay)

    def slope_error(self, output: int) -> Array:
        """(samples,) standard deviation of the error of `slope` without delay, per second."""
        if output not in self._errors:
            logs, noise = self.logs, float(self.noise[output])
            self._errors[output] = self._smoothed(output).error(noise, logs.offsets, logs.period)
        return self._errors[output]

    def _smoothed(self, output: int) -> Slope:
        if output not in self._slopes:
            logs = self.logs
            self._slopes[output] = Slope.of(logs.y[:, output], logs.offsets, logs.period)
        return self._slopes[output]

    def _earlier(self, values: Array, delay: float) -> Array:
        if delay == 0.0:
            return values
        parts = (values[a:b] for a, b in pairwise(self.logs.offsets))
        return np.concatenate([shifted(part, self.logs.period, delay, "cubic") for part in parts])
