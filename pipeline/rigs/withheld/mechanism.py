"""Base class of the virtual machines with several coordinates and levels."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from pipeline.rigs.withheld.effects.effect import Port
from pipeline.rigs.withheld.machine import Conditions, Forces, Machine, State
from unmodelled.base.arrays import Array, Mask


class Mechanism(Machine):
    """Machine whose inertia times acceleration is the sum of its efforts, with position control.

    The last rows of positions and velocities can be levels, such as a current or a pressure: their inertia
    is a capacity, their effort a flow, and their velocity the rate of the level.

    Class attributes, beside those of `Machine`: `levels`, number of rows that are levels; `led`, row that
    the controller leads along the reference; `limits` of its command. Attributes of the objects:
    `stiffness` and `damping`, proportional and derivative gain of the controller.
    """

    levels: ClassVar[int] = 0
    led: ClassVar[int] = 0
    limits: ClassVar[tuple[float, float]]
    stiffness: float
    damping: float

    @property
    @abstractmethod
    def ports(self) -> Mapping[str, tuple[float, ...]]:
        """Position of every port per position of every row."""

    @abstractmethod
    def inertia(self, q: Array, c: Conditions) -> Sequence[Sequence[Array | float]]:
        """Return the symmetric matrix of inertia.

        Args:
            q: positions and levels, shape (d, n).
            c: operating point of every run by factor, each of shape (n,).

        Returns:
            Matrix (d, d), of numbers or shape (n,) each.
        """

    @abstractmethod
    def efforts(self, q: Array, v: Array, u: Array, c: Conditions) -> Sequence[Array]:
        """Return the sum of the known efforts in every row.

        Args:
            q: positions and levels, shape (d, n).
            v: velocities, shape (d, n).
            u: input that acts on the machine, shape (n,).
            c: operating point of every run by factor, each of shape (n,).

        Returns:
            d efforts, shape (n,) each.
        """

    @abstractmethod
    def held(self, reference: Array, slope: Array, c: Conditions) -> Array:
        """Return the command with which the led row follows a slow reference.

        Args:
            reference: reference signal, shape (n,).
            slope: time derivative of the reference, shape (n,).
            c: operating point of every run by factor, each of shape (n,).

        Returns:
            Command, shape (n,).
        """

    def command(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        u = self.held(reference, slope, c) + self.stiffness * (reference - q[self.led])
        return np.asarray(np.clip(u + self.damping * (slope - v[self.led]), *self.limits))

    def rates(self, q: Array, v: Array, u: Array, c: Conditions) -> Array:
        return self._moved(q, np.stack(self.efforts(q, v, u, c)), c)

    def port(self, name: str, q: Array, v: Array, c: Conditions) -> Port:
        along = np.array(self.ports[name])
        response = -self._moved(q, along[:, None], c)
        return Port(along @ q, along @ np.where(self._moving(q), v, q), response, -along @ response)

    def step(self, dt: float, t: float, state: State, u: Array, c: Conditions, forces: Forces) -> State:
        # coordinates as every machine, levels by the midpoint rule
        q, v, before = state
        moving = self._moving(q)
        middle = q + 0.5 * dt * v
        rates = self.rates(middle, 1.5 * v - 0.5 * before, u, c)
        new = np.where(moving, v + dt * rates, rates)
        for name, force in forces:
            change = self._pushed(name, force, dt, t, middle, new, u, c)
            new = new + np.where(moving, change, change / dt)
        return State(np.where(moving, middle + 0.5 * dt * new, q + dt * new), new, v)

    def _moving(self, q: Array) -> Mask:
        """Whether a row is a coordinate, (d, 1)."""
        return np.asarray(np.arange(len(q))[:, None] < len(q) - self.levels)

    def _moved(self, q: Array, efforts: Array, c: Conditions) -> Array:
        """Return the accelerations, (d, n), by efforts (d, n) or (d, 1)."""
        inertia = np.empty((len(q), *q.shape))
        for i, row in enumerate(self.inertia(q, c)):
            for j, value in enumerate(row):
                inertia[i, j] = value
        solved = np.linalg.solve(inertia.transpose(2, 0, 1), efforts.T[:, :, None])
        return np.asarray(solved[:, :, 0].T)
