"""The gap of a model by its free runs on the expression machine, as `evaluation.gap` defines it.

A model that exists for one diagnosis only is not worth compiling.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.deviation import Deviation, substeps_needed
from pipeline.diagnosis.recording import Recording
from pipeline.diagnosis.sensors import Sensors
from pipeline.diagnosis.simulation import Simulation
from pipeline.evaluation.free_run import WHOLE, FreeRun
from pipeline.evaluation.gap import LARGEST_ERROR, SUBSTEPS, Gap, noise_floor
from pipeline.measurements.logs import Logs
from pipeline.physics.system.model import System

Array = NDArray[np.float64]


def free_runs(
    system: System, logs: Logs, horizon: float, runs: Sequence[int], sensors: Sensors | None = None
) -> Gap:
    """The gap of `system` with its values on the experiments `runs` of logs with its constants; see `gap`.

    `sensors` are those of the logs, where they are known already.
    """
    latest = max((output.delay for output in system.outputs), default=0.0)
    recording = Recording.of(logs, horizon, runs, latest, sensors)
    simulation = Simulation(system, recording)
    values = simulation.values[None, None]
    substeps = substeps_needed(simulation, values, SUBSTEPS[-1])
    found = simulation(values, substeps=substeps)
    with np.errstate(all="ignore"):
        error = (found.y[:, 0] - found.measured[:, 0]) / recording.scale
    inside = np.abs(error) <= LARGEST_ERROR
    error = np.where(inside, error, np.copysign(LARGEST_ERROR, np.where(np.isnan(error), 1.0, error)))
    deviation = Deviation.of(recording, error**2)
    floor = noise_floor(logs, runs)
    return Gap(
        value=deviation.value,
        per_experiment=dict(deviation.per_experiment),
        per_output=dict(deviation.per_output),
        floor=float(np.sqrt(np.mean(floor**2))),
        scale=dict(zip(logs.outputs, recording.scale.tolist(), strict=True)),
        substeps=substeps,
        run=_in_rows(system, recording, found.measured[:, 0] + error * recording.scale),
        notes=(),
    )


def _in_rows(system: System, recording: Recording, simulated: Array) -> FreeRun:
    """Simulated outputs (windows, most steps, outputs) beside the samples that show them."""
    logs, some = recording.logs, recording.counted
    y = np.full(logs.y.shape, np.nan)
    counted = np.zeros(logs.y.shape, np.bool_)
    window = np.zeros(len(logs.y), np.int64)
    for j, output in enumerate(system.outputs):
        rows = recording.rows[some] + math.floor(output.delay / logs.period + WHOLE)
        y[rows, j], counted[rows, j] = simulated[some][:, j], True
    for i in recording.runs:
        mine = np.sort(recording.start[recording.owner == i])
        part = logs.rows(i)
        window[part] = np.maximum(np.searchsorted(mine, np.arange(part.start, part.stop), "left") - 1, 0)
    return FreeRun(y, counted, window)
