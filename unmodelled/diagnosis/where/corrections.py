"""Corrections of a model, window by window: the effort, input or output that would have to be added there.

In a window of a few samples a correction is constant. Least squares of the errors on the response of the
simulated outputs gives its size; no measurement is differentiated. The initial states of the windows are
noisy and are fitted too, with their noise as a prior.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.result import JudgedModel
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.fitting.floor import start_noise
from unmodelled.diagnosis.fitting.normal_equations import NormalEquations
from unmodelled.diagnosis.fitting.residuals import Errors
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.diagnosis.fitting.unknowns import Unknown, Unknowns
from unmodelled.diagnosis.where.coordinates import Coordinates
from unmodelled.effects.actuator_offset import ActuatorOffset
from unmodelled.effects.constant_load import ConstantLoad
from unmodelled.effects.effect import Effect
from unmodelled.effects.place import Kind, Place
from unmodelled.effects.scales import Scales
from unmodelled.effects.sensor_offset import SensorOffset
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

#: Mean square of a correction above which windows are long enough [noise variances].
CLEAR_CORRECTION = 4.0
#: Standard error of a correction up to which its window counts [median standard errors].
BLIND_ERROR = 3.0
#: Number of experiments that are independent parts; fewer are divided into stretches [experiments].
ENOUGH_EXPERIMENTS = 4
#: The shortest windows, in s and in samples.
SHORTEST_WINDOW, FEWEST_SAMPLES = 0.01, 8
#: Independent stretches, in all, into which few experiments are divided.
STRETCHES = 16
#: Steps of the derivatives by corrections, in units of `residuals.STEP` times their plausible sizes.
SIZE = 100.0

CONSTANTS: Mapping[Kind, Effect] = {
    "port": ConstantLoad(),
    "actuator": ActuatorOffset(),
    "sensor": SensorOffset(),
}


@dataclass(frozen=True, eq=False)
class Corrections:
    """Corrections at the places of a model over the windows of a recording."""

    model: JudgedModel
    recording: Recording  # in each window a correction is constant
    places: tuple[Place, ...]  # all ports, inputs and outputs
    #: Derivatives of half the square errors of a window, in noise variances, by the corrections at the places
    #: and then by the uncertain parameters, SI; the initial states are eliminated.
    curvature: Array  # second ones, (windows, n, n)
    gradient: Array  # first ones, (windows, n)

    @classmethod
    def of(
        cls,
        model: JudgedModel,
        horizon: float,
        sensors: Sensors,
    ) -> Corrections:
        """Compute the corrections in windows as short as the noise permits."""
        logs, places = model.logs, channels(model.system)
        system, unknowns = _with_constants(model.system, logs, places)
        samples = max(FEWEST_SAMPLES, round(SHORTEST_WINDOW / logs.period))
        latest = max(output.delay for output in system.outputs)
        while True:
            recording = Recording.of(logs, logs.period * samples, latest=latest, sensors=sensors)
            normal = _normal(system, unknowns, recording, model.gap.substeps)
            found, samples = cls(model, recording, places, *normal), 2 * samples
            if found.clear or logs.period * samples > horizon:
                return found

    @cached_property
    def coordinates(self) -> Coordinates:
        """Return the coordinates of the windows."""
        return Coordinates(self.model, self.recording)

    @cached_property
    def value(self) -> Array:
        """Return the correction at each place on its own, shape (windows, places); nan without influence."""
        with np.errstate(all="ignore"):
            return np.asarray(-self.gradient[:, : len(self.places)] / self.weight)

    @cached_property
    def error(self) -> Array:
        """Return the standard error of `value`, shape (windows, places)."""
        with np.errstate(all="ignore"):
            return np.asarray(1.0 / np.sqrt(self.weight))

    @property
    def weight(self) -> Array:
        """Return the inverse variance of `value`, shape (windows, places)."""
        return np.diagonal(self.curvature, axis1=1, axis2=2)[:, : len(self.places)]

    @cached_property
    def seen(self) -> Mask:
        """Return the mask of determined corrections, shape (windows, places)."""
        error = np.where(np.isfinite(self.error), self.error, np.inf)
        return np.asarray((error <= BLIND_ERROR * np.median(error, axis=0)) & np.isfinite(error))

    @property
    def group(self) -> Indices:
        """Return independent parts, shape (windows,): experiments, or stretches where they are few."""
        recording = self.recording
        if len(recording.runs) >= ENOUGH_EXPERIMENTS:
            return recording.owner
        order = np.argsort(np.argsort(recording.start))
        return np.asarray(order * STRETCHES // len(order))

    @property
    def clear(self) -> bool:
        """Return whether the corrections of a port or input stand out from the noise."""
        return any(self._stands_out(k) for k, place in enumerate(self.places) if place.kind != "sensor")

    def _stands_out(self, place: int) -> bool:
        seen = self.seen[:, place]
        if not seen.any():
            return False
        noise = float(np.mean(self.error[seen, place] ** 2))
        return float(np.mean(self.value[seen, place] ** 2)) > (1.0 + CLEAR_CORRECTION) * noise


def channels(system: System) -> tuple[Place, ...]:
    """Return all ports, inputs and outputs."""
    return (
        *(Place("port", port.name) for port in system.ports),
        *(Place("actuator", item.name) for item in system.inputs),
        *(Place("sensor", item.name) for item in system.outputs),
    )


def _with_constants(
    system: System, logs: Logs, places: Sequence[Place]
) -> tuple[System, tuple[Unknown, ...]]:
    """The system with a constant at every place; these constants, and the uncertain parameters."""
    scales = Scales.measured(system, logs.period, logs.offsets, logs.t, logs.x, logs.u, logs.c)
    uncertain = [Unknown.of(p) for p in system.parameters if p.name in system.uncertain]
    constants = []
    for place in places:
        added = CONSTANTS[place.kind].add(system, place, scales)
        (name,) = added.amplitudes
        constants.append(Unknown(name, -np.inf, np.inf, SIZE * added.scales[name]))
        system = added.system
    return system, (*constants, *uncertain)


def _normal(
    system: System, each: tuple[Unknown, ...], recording: Recording, substeps: int
) -> tuple[Array, Array]:
    """Curvature and gradient, see `Corrections`."""
    unknowns = Unknowns(Simulation(system, recording), each)
    here = unknowns.vector({})
    sigma = start_noise(unknowns.simulation, unknowns.numbers(here[None]))
    errors, still = Errors(unknowns, sigma, substeps), np.zeros_like(sigma)
    around = errors(*errors.around(here, still))
    r = around[:, 0]
    slopes, ones = errors.slopes(here, around), np.ones_like(r)
    normal = NormalEquations.of(r, slopes, ones, still, unknowns.entry, unknowns.precision)
    curvature, gradient, _ = normal.reduced()
    size = unknowns.scale
    return curvature / np.outer(size, size), gradient / size
