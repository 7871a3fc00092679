"""Base class of the virtual machines that fill and empty: pressure, fluid, heat, current."""

from abc import abstractmethod
from typing import ClassVar

import numpy as np

from pipeline.rigs.withheld.effects.effect import Port
from pipeline.rigs.withheld.machine import Conditions, Forces, Machine, State
from unmodelled.base.arrays import Array


class Balance(Machine):
    """Machine without inertia; a port takes a flow out of one level.

    The reference is the command, or what a controller adds to for the first level to which it leads.

    Class attributes, beside those of `Machine`: `limits` of the controller's command; `ports`, name of every
    level's port where there are several levels. Attributes of the objects: `stiffness`, gain of the
    controller.
    """

    runs = (9, 12)
    limits: ClassVar[tuple[float, float]]
    ports: ClassVar[tuple[str, ...]] = ()
    stiffness: float

    @abstractmethod
    def flow(self, level: Array, u: Array) -> Array:
        """Return the flow into every balance without planted flows.

        Args:
            level: d levels, shape (d, n).
            u: input that acts on the machine, shape (n,).

        Returns:
            Flow, shape (d, n).
        """

    @abstractmethod
    def capacity(self, level: Array) -> Array | float:
        """Return the content per level.

        Args:
            level: d levels, shape (d, n).

        Returns:
            Capacity, a number, shape (d, 1) or (d, n).
        """

    @abstractmethod
    def at_rest(self, u: Array) -> Array:
        """Return the first level at which an input leaves the machine at rest.

        Args:
            u: input, shape (n,).

        Returns:
            Level, shape (n,).
        """

    def regulated(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        u = reference + self.stiffness * (self.at_rest(reference) - q[0])
        return np.asarray(np.clip(u, *self.limits))

    def rates(self, q: Array, v: Array, u: Array, c: Conditions) -> Array:
        return self.flow(q, u) / self.capacity(q)

    def port(self, name: str, q: Array, v: Array, c: Conditions) -> Port:
        row = self.ports.index(name) if self.ports else 0
        mobility = np.ones_like(q) / self.capacity(q)
        mobility[np.arange(len(q)) != row] = 0.0
        return Port(q[row], v[row], -mobility, mobility[row])

    def step(self, dt: float, t: float, state: State, u: Array, c: Conditions, forces: Forces) -> State:
        # the midpoint rule, whose middle the last rates give
        middle = state.q + 0.5 * dt * state.v
        v = self.rates(middle, state.v, u, c)
        for name, force in forces:
            v = v + self._pushed(name, force, dt, t, middle, v, u, c) / dt
        return State(state.q + dt * v, v, state.v)
