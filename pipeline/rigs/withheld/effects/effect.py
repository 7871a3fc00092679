"""Interfaces of planted effects: forces at a port, distortions of the actuator and of a sensor."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np

from unmodelled.base.arrays import Array


class Port(NamedTuple):
    """A port of n runs side by side, SI units."""

    position: Array  # (n,)
    velocity: Array  # (n,)
    response: Array  # (d, n), change of the d velocities per unit of impulse taken out of the port
    mobility: Array  # (n,), decrease of the port's own velocity per unit of impulse
    load: Array | float = 0.0  # (n,), force or torque of the drive at the port


@dataclass(frozen=True)
class Plan:
    """The n runs of one campaign.

    Attributes:
        period: sampling period of the logger, s.
        samples: number of samples per run.
        substeps: number of integration steps per sample.
        hold: age of a command when the logger reads it, as a share of the period, 0 to 1.
        conditions: operating point of every run by factor, each of shape (n,).
        groups: group of every run; empty if there are none.
        begin: start of every run since the start of the campaign, s, shape (n,).
    """

    period: float
    samples: int
    substeps: int
    hold: float
    conditions: Mapping[str, Array]
    groups: tuple[str, ...]
    begin: Array

    @property
    def runs(self) -> int:
        """Number n of runs."""
        return len(self.begin)

    @property
    def step(self) -> float:
        """Integration step, s."""
        return self.period / self.substeps


class Effect:
    """An effect that the known physics leaves out; its public fields are its parameters in SI units."""

    def refitted(self, machine: Any) -> Any:
        """Return a machine with the effect built in; the default is the machine itself."""
        return machine

    @property
    def parameters(self) -> dict[str, Any]:
        """Parameters of the effect by name, for the record."""
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.init}  # type: ignore[arg-type]
        return {
            k: np.asarray(v).tolist() if not isinstance(v, str | Effect) else v for k, v in values.items()
        }


class PortEffect(Effect, ABC):
    """A force or torque at a port; the object may have a memory, and so serves one simulation only."""

    @abstractmethod
    def impulse(self, dt: float, t: float, port: Port) -> Array:
        """Return the impulse that the effect takes out of the port in one step.

        Args:
            dt: length of the step, s.
            t: time since the start of the run, s.
            port: state of the port in n runs.

        Returns:
            Impulse, SI unit of the port, shape (n,).
        """


class ActuatorEffect(Effect, ABC):
    """A distortion of the command; the object may have a memory, and so serves one simulation only."""

    @abstractmethod
    def applied(self, dt: float, t: float, u: Array) -> Array:
        """Return the input that acts on the machine during one step.

        Args:
            dt: length of the step, s.
            t: time since the start of the run, s.
            u: command, shape (n,).

        Returns:
            Input, shape (n,).
        """


class SensorEffect(Effect, ABC):
    """A distortion of an output before it is logged."""

    @abstractmethod
    def seen(self, period: float, y: Array) -> Array:
        """Return the output of the sensor.

        Args:
            period: sampling period, s.
            y: true output, shape (samples, n).

        Returns:
            Output of the sensor, shape (samples, n).
        """


@dataclass
class Only(PortEffect):
    """A force that acts in some of the runs."""

    inner: PortEffect
    where: Array  # (n,), 1 in runs with the force and 0 in other runs

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return self.where * self.inner.impulse(dt, t, port)

    @property
    def parameters(self) -> dict[str, Any]:
        """Parameters of the force."""
        return self.inner.parameters


#: Size of an effect (a multiple of the typical size), plan of the runs and random generator -> the effect.
Make = Callable[[float, Plan, np.random.Generator], Effect]


@dataclass(frozen=True)
class Plantable:
    """An effect that a machine offers."""

    family: str  # as in docs/reference/effects.md, or another name for an effect of no family
    channel: str  # a port, `actuator:<input>` or `sensor:<output>`
    make: Make
    #: Family and channel of effects that the logs of this machine cannot distinguish from this effect, or
    #: that come close to an effect of no family
    alike: tuple[tuple[str, str], ...] = ()
    local: bool = False  # may also be planted at one level of a factor or in one group only
