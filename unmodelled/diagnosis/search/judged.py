"""A fitted model on the experiments that were held out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.deviation import errors
from unmodelled.diagnosis.fitting.fitted import Fitted
from unmodelled.diagnosis.fitting.floor import floor
from unmodelled.diagnosis.fitting.models import own_values

Array = NDArray[np.float64]

#: Of the floor: the least that an effect must contribute to the gap to be seen.
SEEN = 0.25
#: How many times as large as the floor a gap must be, which is not known better than that.
BEYOND = 1.2
#: Draws of the bootstrap.
DRAWS = 1000


@dataclass(frozen=True)
class Judged:
    """How far free runs of a model lie from held-out measurements.

    Attributes:
        square: (windows,) square error, mean over samples and outputs, in variances of the outputs.
        samples: (windows,) their numbers. floor: of the gap.
    """

    square: Array
    samples: Array
    floor: float

    @classmethod
    def of(cls, fitted: Fitted) -> Judged:
        """From windows that start at the measured states; see `deviation.gap`."""
        study = fitted.hypothesis.study
        recording = Recording.of(study.logs, study.horizon, study.held_out, study.latest, study.sensors)
        simulation = fitted.hypothesis.simulation(recording)
        numbers = _numbers(fitted)
        runs = simulation(numbers, substeps=fitted.fit.substeps)
        square = errors(runs, recording.scale) ** 2 * recording.counted[:, :, None]
        samples = recording.steps.astype(np.float64)
        left = floor(simulation, numbers, fitted.fit.substeps).value
        return cls(square.sum(axis=1).mean(axis=1) / samples, samples, left)

    @property
    def gap(self) -> float:
        """Root mean square over windows, samples and outputs."""
        return float(np.sqrt(np.average(self.square, weights=self.samples)))

    @property
    def has_gap(self) -> bool:
        """Whether it is worse than noise explains."""
        return self.gap > BEYOND * self.floor

    def is_worse_than(self, other: Judged) -> bool:
        """Whether the other model is better by more than chance and by more than a part of the noise.

        Its mean square error is lower by more than the square of a quarter of the floor, and by more than
        zero in 97.5 % of the bootstrap samples of the windows.
        """
        rise = self.square - other.square
        drawn = np.random.default_rng(0).integers(0, len(rise), (DRAWS, len(rise)))
        means = np.sum((rise * self.samples)[drawn], axis=1) / np.sum(self.samples[drawn], axis=1)
        large = np.average(rise, weights=self.samples) > (SEEN * other.floor) ** 2
        return bool(large and np.quantile(means, 0.025) > 0.0)


def _numbers(fitted: Fitted) -> Array:
    """(experiments, 1, numbers) of the fit, and of every held-out experiment the values of its own."""
    numbers, names = fitted.fit.numbers.copy(), fitted.unknowns.simulation.names
    for name, values in own_values(fitted).items():
        numbers[:, 0, names.index(name)] = [values[i] for i in fitted.recording.logs.ids]
    return numbers
