"""Coordinates of windows: positions, velocities, inputs and outputs, and their rates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.result import JudgedModel
from unmodelled.effects.motion import is_inertial
from unmodelled.effects.place import Place, site
from unmodelled.effects.scales import Scales
from unmodelled.systems.numeric import numpy_system_function

TURN = 2.0 * np.pi
#: A position in rad that goes further than so many turns is counted within one.
TURNS = 2.0


@dataclass(frozen=True, eq=False)
class Coordinate:
    """A quantity in the middle of every window."""

    name: str  # mod(name, 2*pi) for the position within a turn, d(name)/dt for a rate without a name
    unit: str
    values: Array  # means over the windows, (windows,), SI


@dataclass(frozen=True, eq=False)
class Coordinates:
    """The coordinates of the windows of a recording, from the measured states of a model."""

    model: JudgedModel
    recording: Recording
    _found: dict[Place, tuple[Coordinate, ...]] = field(default_factory=dict, repr=False)

    def of(self, place: Place) -> tuple[Coordinate, ...]:
        """Return position, velocity and acceleration of a port, or an input or output and its rate."""
        if place not in self._found:
            self._found[place] = self._of_port(place) if place.kind == "port" else self._of_signal(place)
        return self._found[place]

    def _of_signal(self, place: Place) -> tuple[Coordinate, ...]:
        system = self.model.system
        items = system.inputs if place.kind == "actuator" else system.outputs
        unit = next(item.unit for item in items if item.name == place.name)
        return self._level(place.name, unit), self._rate(place.name, f"({unit})/s")

    def samples(self, place: Place) -> dict[str, Array]:
        """Return coordinates (samples,) at every sample, without those that are differences of samples."""
        if place.kind != "port":
            return {place.name: self._signals[place.name]}
        found = {name: self._signals[name] for name in self.model.system.port(place.name).coordinates}
        turn = (c.name for c in self.of(place) if c.name.startswith("mod("))
        return found | {name: np.mod(next(iter(found.values())), TURN) for name in turn}

    def _of_port(self, place: Place) -> tuple[Coordinate, ...]:
        system, port = self.model.system, self.model.system.port(place.name)
        units = {local: q.unit for local, q in site(system, place, self._scales).quantities.items()}
        found = []
        if port.position is not None:
            found.append(_within_a_turn(self._level(port.position, units["x"])))
        if port.velocity is not None:
            found.append(self._level(port.velocity, units["v"]))
            if is_inertial(system, port):
                found.append(self._rate(port.velocity, units["a"]))
        return tuple(found)

    def lags(self, place: Place, times: tuple[float, ...]) -> list[Array]:
        """Return how far the first coordinate (windows,) of a place is ahead of means over times, s."""
        from scipy.signal import lfilter  # half a second to load

        name = place.name
        if place.kind == "port":
            coordinates = self.model.system.port(place.name).coordinates
            if not coordinates:
                return []
            name = coordinates[0]
        signal, logs = self._signals[name], self.recording.logs
        found = []
        for time in times:
            keep, mean = float(np.exp(-logs.period / time)), np.empty_like(signal)
            for a, b in pairwise(logs.offsets):
                mean[a:b] = lfilter([1.0 - keep], [1.0, -keep], signal[a:b], zi=[keep * signal[a]])[0]
            found.append(self.mean(signal - mean))
        return found

    def mean(self, signal: Array) -> Array:
        """Return the means (windows,) of a signal (samples,) over the windows."""
        sums = np.concatenate([[0.0], np.cumsum(signal)])
        first, steps = self.recording.start, self.recording.steps
        return np.asarray((sums[first + steps + 1] - sums[first]) / (steps + 1))

    def _level(self, name: str, unit: str) -> Coordinate:
        return Coordinate(name, unit, self.mean(self._signals[name]))

    def _rate(self, name: str, unit: str) -> Coordinate:
        first, steps = self.recording.start, self.recording.steps
        signal = self._signals[name]
        slope = (signal[first + steps] - signal[first]) / (steps * self.recording.logs.period)
        return Coordinate(f"d({name})/dt", unit, slope)

    @cached_property
    def _scales(self) -> Scales:
        system, logs = self.model.system, self.model.logs
        return Scales.measured(system, logs.period, logs.offsets, logs.t, logs.x, logs.u, logs.c)

    @cached_property
    def _signals(self) -> Mapping[str, Array]:
        """(samples,) of states, inputs, outputs and the coordinates of ports."""
        system, logs = self.model.system, self.model.logs
        names = [*(s.name for s in system.states), *(i.name for i in system.inputs)]
        names += [name for port in system.ports for name in port.coordinates if name in system.signals]
        function = numpy_system_function(system, [system.expression(name) for name in names], True)
        values = function(logs.t, logs.x, logs.u, np.empty(0), np.array(system.values), logs.c[logs.owner])
        shown = dict(zip((o.name for o in system.outputs), logs.y.T, strict=True))
        return shown | dict(zip(names, values.T, strict=True))


def _within_a_turn(position: Coordinate) -> Coordinate:
    """The same within one turn if it is an angle that makes several."""
    if position.unit != "rad" or np.ptp(position.values) <= TURNS * TURN:
        return position
    return Coordinate(f"mod({position.name}, 2*pi)", "rad", np.mod(position.values, TURN))
