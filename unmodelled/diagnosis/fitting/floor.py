"""What the noise of the sensors leaves of the gap of a model without fault."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.fitting.deviation import Deviation
from unmodelled.diagnosis.fitting.simulation import Simulation

Array = NDArray[np.float64]


def start_noise(simulation: Simulation, values: Array) -> Array:
    """(windows, measured states) standard deviation of the error of the states at which windows start.

    A state that an output shows has the noise of the output; see `SmoothedSlope.error` for velocities.

    Args:
        values: (experiments or 1, 1, numbers).
    """
    recording, reader = simulation.recording, simulation.reader
    everywhere = np.broadcast_to(values, (len(recording.logs), *values.shape[1:]))
    sigma = 1.0 / np.abs(reader.gains(everywhere))[recording.owner, 0, :, 0]
    for k, r in enumerate(reader.readings):
        errors = recording.sensors.slope_error(r.output)[recording.start] if r.slope else None
        sigma[:, k] *= recording.noise[r.output] if errors is None else errors
    return np.asarray(sigma)


def floor(simulation: Simulation, values: Array, substeps: int = 1) -> Deviation:
    """The noise floor: the gap that would be left if `simulation` with `values` were the truth.

    The measured outputs are noisy, and so are the states at which windows start. What the latter do to the
    outputs is found by starting a standard deviation above and below, state by state.

    Args:
        values: (experiments or 1, 1, numbers). substeps: steps of the integration per sample.
    """
    recording = simulation.recording
    sigma = start_noise(simulation, values)
    states = sigma.shape[1]
    above = sigma[:, None] * np.eye(states)
    runs = simulation(
        np.repeat(values, 2 * states, axis=1), np.concatenate([above, -above], axis=1), substeps
    )
    with np.errstate(all="ignore"):
        spread = 0.5 * np.abs(runs.y[:, :states] - runs.y[:, states:]) / recording.scale
    passed = np.where(spread <= LARGEST_ERROR, spread, LARGEST_ERROR) ** 2
    return Deviation.of(recording, passed.sum(1) + (recording.noise / recording.scale) ** 2)
