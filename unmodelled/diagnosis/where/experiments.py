"""The gap of every experiment, held out or not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.data.diagnosis import Diagnosis
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.fitting.free_runs import free_runs

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Experiments:
    """Gaps in standard deviations of the outputs over all experiments, which are (n,).

    Attributes:
        known, reidentified, augmented: of the models. floor: what the noise of the sensors leaves of them.
    """

    known: Array
    reidentified: Array
    augmented: Array
    floor: Array

    @classmethod
    def of(cls, diagnosis: Diagnosis, sensors: Sensors) -> Experiments:
        """By free runs of all models over all experiments; `sensors` are those of the logs."""
        found = []
        for model in (diagnosis.known, diagnosis.reidentified, diagnosis.augmented):
            found.append(free_runs(model.system, model.logs, diagnosis.horizon, sensors=sensors))
        each = [*(gap.per_experiment for gap in found), found[-1].floors]
        return cls(*(np.array([values[i] for i in diagnosis.logs.ids]) for values in each))
