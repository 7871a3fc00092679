"""The noise floor: the gap that sensor noise alone causes, for a model without fault."""

from __future__ import annotations

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.fitting.deviation import Deviation
from unmodelled.diagnosis.fitting.simulation import Simulation


def start_noise(simulation: Simulation, values: Array) -> Array:
    """Return the noise (windows, measured states), SI, of the measured states at which windows start.

    A state that an output shows has the noise of the output, divided by the gain of the sensor; see
    `SmoothedSlope.error` for velocities.
    """
    recording, reader = simulation.recording, simulation.reader
    each = np.broadcast_to(values, (len(recording.logs), *values.shape[1:]))[:, 0]
    gains = reader.gains(each, recording.logs.u[recording.start], recording.owner)
    sigma = 1.0 / np.abs(gains[:, :, 0])
    for k, r in enumerate(reader.readings):
        if not r.slope and r.lag == 0:
            sigma[:, k] *= recording.noise[r.output]
            continue
        errors = recording.sensors.slope_error(r.output)[recording.start]
        sigma[:, k] *= errors if r.slope else np.hypot(recording.noise[r.output], gains[:, k, 2] * errors)
    return np.asarray(sigma)


def start_spread(simulation: Simulation, values: Array, substeps: int = 1) -> Array:
    """Return how far starts may be off, (windows, measured states and hidden ones), SI.

    A state that no output shows is integrated from the start of its record, where nobody knows it: it may be
    off by as much as it varies, in the window that begins there.
    """
    recording, shown = simulation.recording, start_noise(simulation, values)
    if not simulation.hidden:
        return shown
    logs, owner = recording.logs, recording.owner
    begun = recording.start == logs.offsets[owner]
    if logs.continues:
        begun &= np.array([before is None for before in logs.continues])[owner]
    with np.errstate(all="ignore"):
        spread = np.nan_to_num(simulation.hidden_starts(values, substeps)[:, 0].std(axis=0), posinf=0.0)
    return np.concatenate([shown, begun[:, None] * spread], axis=1)


def floor(simulation: Simulation, values: Array, substeps: int = 1) -> Deviation:
    """Return the noise floor: the gap that remains if `values` (experiments or 1, 1, numbers) are the truth.

    The measured outputs are noisy, and so are the states at which windows start. The effect of a noisy state
    on the outputs is found by starting one standard deviation above and one below it, state by state.
    """
    recording = simulation.recording
    sigma = start_noise(simulation, values)
    states, sensor = sigma.shape[1], (recording.noise / recording.scale) ** 2
    if not states:
        return Deviation.of(recording, np.broadcast_to(sensor, (*recording.rows.shape, len(sensor))))
    above = sigma[:, None] * np.eye(states)
    runs = simulation(
        np.repeat(values, 2 * states, axis=1), np.concatenate([above, -above], axis=1), substeps
    )
    with np.errstate(all="ignore"):
        spread = 0.5 * np.abs(runs.y[:, :states] - runs.y[:, states:]) / recording.scale
    passed = np.where(spread <= LARGEST_ERROR, spread, LARGEST_ERROR) ** 2
    return Deviation.of(recording, passed.sum(1) + sensor)
