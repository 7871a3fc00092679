"""Base class of the virtual machines that fill and empty: pressure, fluid, heat, current."""

from __future__ import annotations

from abc import abstractmethod

from pipeline.rigs.withheld.machine import Array, Conditions, Forces, Machine, State


class Balance(Machine):
    """Machine without inertia: positions are levels, and a port changes their rates at once."""

    @abstractmethod
    def rates(self, q: Array, v: Array, u: Array, c: Conditions) -> Array:
        """Return the rates of the levels without planted flows.

        Args:
            q: levels, shape (d, n).
            v: rates of the levels before the step, shape (d, n).
            u: input that acts on the machine, shape (n,).
            c: operating point of every run by factor, each of shape (n,).

        Returns:
            Rates, shape (d, n).
        """

    def command(self, reference: Array, slope: Array, q: Array, v: Array, c: Conditions) -> Array:
        return reference

    def step(self, dt: float, t: float, state: State, u: Array, c: Conditions, forces: Forces) -> State:
        """Return the state after a step of the midpoint rule, whose middle the last rates give.

        Args:
            dt: length of the step, s.
            t: time since the start of the run, s.
            state: state before the step.
            u: input that acts on the machine, shape (n,).
            c: operating point of every run by factor, each of shape (n,).
            forces: port and flow of every planted flow.
        """
        middle = state.q + 0.5 * dt * state.v
        v = self.rates(middle, state.v, u, c)
        for name, force in forces:
            port = self.port(name, middle, v, c)._replace(load=self.load(name, u))
            v = v + port.response * force.impulse(dt, t, port) / dt
        return State(state.q + dt * v, v, state.v)
