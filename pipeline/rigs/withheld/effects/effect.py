"""What can be planted in a machine: forces at a port, distortions of the actuator, and of a sensor."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Port(NamedTuple):
    """A port of n runs side by side, SI units.

    Attributes:
        position: shape (n,).
        velocity: shape (n,).
        response: change of the machine's d velocities per unit of impulse that is taken out here, shape (d,
            n).
        mobility: by how much that lowers the port's own velocity, shape (n,).
    """

    position: Array
    velocity: Array
    response: Array
    mobility: Array


@dataclass(frozen=True)
class Plan:
    """The n runs of one campaign.

    Attributes:
        period: sampling period of the logger, s.
        samples: number of samples per run.
        substeps: number of integration steps per sample.
        hold: share of a period that a command is old when the logger reads it, 0 to 1.
        conditions: operating point of every run, shape (n,) each.
        groups: group of every run; empty if there are none.
        begin: s since the campaign began at which each run starts, shape (n,).
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
        """n."""
        return len(self.begin)

    @property
    def step(self) -> float:
        """Of the integration, s."""
        return self.period / self.substeps


class Effect:
    """Something that the known physics leaves out; its public fields are its parameters in SI units."""

    def refitted(self, machine: Any) -> Any:
        """Return the machine with the effect built in."""
        return machine

    @property
    def parameters(self) -> dict[str, Any]:
        """The numbers that describe the effect, for the record."""
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.init}  # type: ignore[arg-type]
        return {
            k: np.asarray(v).tolist() if not isinstance(v, str | Effect) else v for k, v in values.items()
        }


class PortEffect(Effect, ABC):
    """A force or torque at a port. It may remember: one object serves one simulation."""

    @abstractmethod
    def impulse(self, dt: float, t: float, port: Port) -> Array:
        """Return the impulse (n,) that the effect takes out of the port in `dt` seconds from time `t` of the
        run on.
        """


class ActuatorEffect(Effect, ABC):
    """What becomes of the command on its way to the machine. It may remember, too."""

    @abstractmethod
    def applied(self, dt: float, t: float, u: Array) -> Array:
        """Return the input (n,) that acts in the `dt` seconds from `t` on when the command is `u` (n,)."""


class SensorEffect(Effect, ABC):
    """What becomes of an output before it is logged."""

    @abstractmethod
    def seen(self, period: float, y: Array) -> Array:
        """Return what the sensor shows of `y` (samples, n), sampled every `period` seconds."""


@dataclass
class Only(PortEffect):
    """A force that exists in some of the runs: `where` (n,) is 1 there and 0 elsewhere."""

    inner: PortEffect
    where: Array

    def impulse(self, dt: float, t: float, port: Port) -> Array:
        return self.where * self.inner.impulse(dt, t, port)

    @property
    def parameters(self) -> dict[str, Any]:
        """Those of the force."""
        return self.inner.parameters


@dataclass(frozen=True)
class Plantable:
    """An effect that a machine offers.

    Attributes:
        family: name of the family in shared/contracts/diagnosis.md, or another name for an effect of
            no family.
        channel: a port, `actuator:<input>` or `sensor:<output>`.
        make: the effect in a multiple of its typical size, for a campaign, with a source of chance.
        alike: (family, channel) that the logs of this machine cannot tell from it, or that come close to an
            effect that is in no family.
        local: whether it may also be planted at one level of a factor or in one group alone.
    """

    family: str
    channel: str
    make: Callable[[float, Plan, np.random.Generator], Effect]
    alike: tuple[tuple[str, str], ...] = ()
    local: bool = False
