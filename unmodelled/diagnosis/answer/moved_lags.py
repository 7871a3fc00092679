"""Lags that may as well be at the other end of the machine: in its drive, or in its sensor.

In a linear machine, a lag of the drive and a lag of the sensor give the same output. Windows that start at
measured states still prefer one of them, because the start of a window is read through the sensor.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.result import DiagnosedEffect, Diagnosis
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.effects.actuator_lag import ActuatorLag
from unmodelled.effects.added import Added, with_numbers
from unmodelled.effects.effect import Effect
from unmodelled.effects.scales import Scales
from unmodelled.effects.sensor_lag import SensorLag
from unmodelled.systems.model import System

#: Law at the other end, by family.
OTHER_END: dict[str, Effect] = {"sensor_lag": ActuatorLag(), "actuator_lag": SensorLag()}
#: Largest error over whole runs, relative to that of the named effect, with which another one is its equal.
EQUAL = 1.1
#: Share of a run after which its start is forgotten.
FORGOTTEN = 0.25


def with_moved_lags(found: Diagnosis) -> Diagnosis:
    """Return a diagnosis whose lags list those at the other end that predict whole experiments as well.

    A lag with the same time constant is moved to the other end, and held-out experiments are simulated from
    their first state.
    """
    late = [k for k, each in enumerate(found.effects) if each.added.family in OTHER_END]
    if not late:
        return found
    whole, effects = _whole_error(found, found.augmented.system), list(found.effects)
    for k in late:
        listed = {other.site for other in effects[k].indistinguishable}
        moved = [
            added
            for added, system in _moved(found, effects[k])
            if added.site not in listed and _whole_error(found, system) <= EQUAL * whole
        ]
        effects[k] = replace(effects[k], indistinguishable=(*effects[k].indistinguishable, *moved))
    return replace(found, effects=tuple(effects))


def _moved(found: Diagnosis, late: DiagnosedEffect) -> Iterator[tuple[Added, System]]:
    """The lag at every place of the other end, and the system in which it replaces the named one."""
    law, logs = OTHER_END[late.added.family], found.logs
    (seconds,) = (estimate.value for estimate in late.estimates.values())
    bare = found.augmented.system.with_values(dict.fromkeys(late.added.amplitudes, 0.0))
    scales = Scales.measured(found.system, logs.period, logs.offsets, logs.t, logs.x, logs.u, logs.c)
    for place in law.places(found.system):
        other = law.add(bare, place, scales)
        (name,) = other.shapes
        values = {name: seconds, **dict.fromkeys(other.amplitudes, 1.0)}
        yield other, with_numbers(other.system, [other], values)


def _whole_error(found: Diagnosis, system: System) -> float:
    """Root mean square error over whole held-out experiments, in standard deviations of the outputs."""
    model = found.augmented
    latest = max(output.delay for output in system.outputs)
    recording = Recording.whole(model.logs, found.held_out, latest)
    simulation = Simulation(system, recording)
    runs = simulation(simulation.values[None, None], substeps=model.gap.substeps)
    later = np.arange(runs.counted.shape[1]) >= FORGOTTEN * recording.steps[:, None]
    errors = runs.errors(recording.scale)[runs.counted & later]
    return float(np.sqrt(np.mean(errors**2))) if np.isfinite(errors).all() else float("inf")
