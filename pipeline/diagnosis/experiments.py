"""The gap of every experiment, held out or not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.deviation import gap
from pipeline.diagnosis.diagnosis import Diagnosis, Model
from pipeline.diagnosis.floor import floor
from pipeline.diagnosis.recording import Recording
from pipeline.diagnosis.sensors import Sensors
from pipeline.diagnosis.simulation import Simulation

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
        """By free runs of all models over the same windows of all experiments."""
        models = diagnosis.known, diagnosis.reidentified, diagnosis.augmented
        latest = max(output.delay for model in models for output in model.system.outputs)
        recording = Recording.of(diagnosis.logs, diagnosis.horizon, latest=latest, sensors=sensors)

        def simulation(model: Model) -> Simulation:
            return Simulation(model.system, replace(recording, logs=model.logs))

        found = []
        for model in models:
            run = simulation(model)
            found.append(gap(run, run.values[None, None], model.gap.substeps))
        last = simulation(diagnosis.augmented)
        found.append(floor(last, last.values[None, None], diagnosis.augmented.gap.substeps))
        return cls(*(np.array([each.per_experiment[i] for i in diagnosis.logs.ids]) for each in found))
