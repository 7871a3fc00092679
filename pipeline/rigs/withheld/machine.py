"""Interface of all virtual machines: motion, ports, drive, sensors and plantable effects."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from pipeline.rigs.withheld.effects.effect import Plantable, Port, PortEffect
from unmodelled.base.arrays import Array

#: Acceleration of free fall, m/s^2.
GRAVITY = 9.81

Conditions = Mapping[str, Array]
Forces = Sequence[tuple[str, PortEffect]]


class Sensor(NamedTuple):
    """Sensor of a coordinate or its rate."""

    output: str
    row: int  # number of the coordinate
    rate: bool  # measures the rate of the coordinate
    quantum: float  # resolution, unit of the output; 0: none
    noise: float  # root mean square, unit of the output
    wraps: bool = False  # the output is an angle within one turn
    through: float = 0.0  # share of the input in the output, units of the output per unit of the input


@dataclass(frozen=True)
class Range:
    """Range of the references or commands."""

    amplitude: float  # largest deviation from the centre, unit of the reference
    band: float  # highest frequency, Hz
    centre: float = 0.0  # unit of the reference


class State(NamedTuple):
    """State of a machine with d coordinates in n runs, SI units."""

    q: Array  # (d, n), positions
    v: Array  # (d, n), velocities
    before: Array  # (d, n), velocities before the last step


class Machine(ABC):
    """Base class of the virtual machines, with n runs side by side.

    Positions q and velocities v have the shape (d, n), in SI units.

    Class attributes: `name` of the system file; `input`, and whether its log is `measured` behind the drive;
    `periods` of the logger (s) and numbers of `runs` to choose from; `duration` of a run (s); `range` of the
    references; `rest`, the range in which the first coordinate starts (the others start at 0); `sensors`, of
    which those in `optional` are not always logged; `factors` with their levels; `groups`; `friction`, the
    ports of the known damping by name of its constant; `doubtful`, constants that a user may know badly, each
    with the families that a wrong value resembles; and `plantable`, the effects that can be planted.
    """

    name: ClassVar[str]
    input: ClassVar[str]
    measured: ClassVar[bool] = False
    periods: ClassVar[tuple[float, ...]] = (0.001, 0.002)
    duration: ClassVar[float]
    runs: ClassVar[tuple[int, ...]] = (8, 10)
    range: ClassVar[Range]
    rest: ClassVar[tuple[float, float]]
    sensors: ClassVar[tuple[Sensor, ...]]
    optional: ClassVar[tuple[str, ...]] = ()
    factors: ClassVar[Mapping[str, tuple[float, ...]]] = {}
    groups: ClassVar[tuple[str, ...]] = ()
    friction: ClassVar[Mapping[str, str]] = {}
    doubtful: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    plantable: ClassVar[tuple[Plantable, ...]]

    def start(self, runs: int, rng: np.random.Generator) -> Array:
        """Draw the positions in which the machine rests before a run; the default is by `rest`.

        Args:
            runs: number n of runs.
            rng: random generator.

        Returns:
            Positions, shape (d, n).
        """
        q = np.zeros((1 + max(sensor.row for sensor in self.sensors), runs))
        q[0] = rng.uniform(*self.rest, runs)
        return q

    def command(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        """Return the controller's command to the drive; the default is the reference.

        Args:
            reference: reference signal, shape (n,).
            slope: time derivative of the reference, shape (n,).
            q: positions, shape (d, n).
            v: velocities, shape (d, n).
            c: operating point of every run by factor, each of shape (n,).

        Returns:
            Command, shape (n,).
        """
        return reference

    def regulated(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        """Return the command of a controller with feedback; `reference` is its set point.

        Args:
            reference: set point, shape (n,).
            slope: rate of the set point, shape (n,).
            q: positions, shape (d, n).
            v: velocities, shape (d, n).
            c: conditions of the runs, shape (n,) each.

        Returns:
            Commands, shape (n,).
        """
        return self.command(reference, slope, q, v, c)

    @abstractmethod
    def rates(self, q: Array, v: Array, u: Array, c: Conditions) -> Array:
        """Return the accelerations without planted forces.

        Args:
            q: positions, shape (d, n).
            v: velocities, shape (d, n).
            u: input that acts on the machine, shape (n,).
            c: operating point of every run by factor, each of shape (n,).

        Returns:
            Accelerations, shape (d, n).
        """

    def step(self, dt: float, t: float, state: State, u: Array, c: Conditions, forces: Forces) -> State:
        """Return the state after a step of the scheme of Moreau and Jean (see `stepping.move`).

        Args:
            dt: length of the step, s.
            t: time since the start of the run, s.
            state: state before the step.
            u: input that acts on the machine, shape (n,).
            c: operating point of every run by factor, each of shape (n,).
            forces: port and force of every planted force.
        """
        q, v, before = state
        middle = q + 0.5 * dt * v
        # of the velocity, too, the value in the middle, by the last increment: projected ones are in it
        last, v = v, v + dt * self.rates(middle, 1.5 * v - 0.5 * before, u, c)
        for name, force in forces:
            v = v + self._pushed(name, force, dt, t, middle, v, u, c)
        return State(middle + 0.5 * dt * v, v, last)

    def _pushed(
        self, name: str, force: PortEffect, dt: float, t: float, q: Array, v: Array, u: Array, c: Conditions
    ) -> Array:
        """Return what the impulse of a planted force changes in one step: velocities, (d, n)."""
        port = self.port(name, q, v, c)._replace(load=self.load(name, u))
        return port.response * force.impulse(dt, t, port)

    @abstractmethod
    def port(self, name: str, q: Array, v: Array, c: Conditions) -> Port:
        """Return a port in a state of the machine.

        Args:
            name: name of the port.
            q: positions, shape (d, n).
            v: velocities, shape (d, n).
            c: operating point of every run by factor, each of shape (n,).
        """

    def load(self, name: str, u: Array) -> Array:
        """Return the force or torque of the drive at a port; the default is a port without a drive.

        Args:
            name: name of the port.
            u: input that acts on the machine, shape (n,).

        Returns:
            Force or torque, SI unit of the port, shape (n,).
        """
        return np.zeros_like(u)
