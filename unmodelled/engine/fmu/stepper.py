"""A system that is simulated step by step, along inputs that become known as it goes."""

from __future__ import annotations

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.engine.free_run import Integration, Windows, free_run
from unmodelled.engine.machine.program import Program
from unmodelled.systems.model import System

#: Longest integration step, s.
LONGEST = 1e-3
#: Parts of a step that are too short to integrate, relative to the step.
SHORTEST = 1e-9


class Stepper:
    """Free run of a system in steps. Inputs keep their values during a step.

    Before the start, delayed inputs and outputs have their first values. Where an initial state is nan, the
    state begins at the initial value of the system.
    """

    def __init__(self, system: System, p: Array, c: Array, u: Array, x: Array, t: float = 0.0) -> None:
        self.system, self.p, self.c, self.t = system, p, c, t
        self._states = Program.of(system, system.x)
        self._outputs = Program.of(system, [output.expression for output in system.outputs])
        self.x = np.where(np.isnan(x), _initial(system, u, p, c), x)
        self._u = _Past(np.array([item.delay for item in system.inputs]), t, u)
        self._y = _Past(np.array([item.delay for item in system.outputs]), t, self._observed(u))

    @property
    def y(self) -> Array:
        """Return the outputs at time `t`, shape (outputs,), SI; not finite where the simulation diverged."""
        return self._y.straight(self.t)

    def step(self, u: Array, seconds: float) -> None:
        """Simulate some seconds with inputs u (inputs,)."""
        end = self.t + seconds
        self._u.add(self.t, u)
        changes = self._u.changes(self.t + SHORTEST * seconds, end - SHORTEST * seconds)
        for until in (*changes, end):
            acting = self._u.held(0.5 * (self.t + until))
            self._integrate(acting, until)
            self._y.add(self.t, self._observed(acting))

    def _integrate(self, u: Array, until: float) -> None:
        """Integrate to a time with constant inputs (inputs,)."""
        seconds, one = until - self.t, np.zeros(1, np.int64)
        windows = Windows(np.stack([u, u]), np.array([self.t, until]), one, one + 1, one, one)
        how = Integration(seconds, "rk4", max(1, int(np.ceil(seconds / LONGEST - SHORTEST))))
        p, c, x0 = self.p[None, None], self.c[None], self.x[None, None]
        self.x, self.t = free_run(self._states, windows, p, c, x0, how)[0, 0, 1], until

    def _observed(self, u: Array) -> Array:
        return self._outputs.evaluate(np.array(self.t), self.x, u, self.p, self.c)


def defaults(system: System) -> Array:
    """Return the constants (constants,), SI, of the operating point of a run that says nothing of them."""
    return np.array([constant.other or 0.0 for constant in system.operating_point], np.float64)


class _Past:
    """Values at past times, each of which is seen after a delay of its own (values,), s."""

    def __init__(self, delays: Array, t: float, values: Array) -> None:
        self.delays, self.t, self.values = delays, np.array([t]), values[None]

    def add(self, t: float, values: Array) -> None:
        """Add values (values,) at a time; those that no delay reaches any more are forgotten."""
        kept = max(int(np.searchsorted(self.t, t - self.delays.max(initial=0.0), "right")) - 1, 0)
        self.t, self.values = np.append(self.t[kept:], t), np.vstack([self.values[kept:], values])

    def changes(self, after: float, before: float) -> list[float]:
        """Times between two times at which a value changes that is seen then."""
        times = np.unique(np.add.outer(self.delays, self.t))
        return [float(t) for t in times if after < t < before]

    def held(self, t: float) -> Array:
        """Values (values,) that are seen at a time, each kept until the next one."""
        rows = np.searchsorted(self.t, t - self.delays, "right") - 1
        return self.values[np.maximum(rows, 0), np.arange(len(self.delays))]

    def straight(self, t: float) -> Array:
        """Values (values,) that are seen at a time, along straight lines between those of the past."""
        seen = [np.interp(t - d, self.t, self.values[:, k]) for k, d in enumerate(self.delays)]
        return np.array(seen, np.float64)


def _initial(system: System, u: Array, p: Array, c: Array) -> Array:
    """Initial states (states,): numbers, or expressions in initial states, inputs and parameters."""
    known = dict(zip((*system.u, *system.p, *system.c), (*u, *p, *c), strict=True))
    starts = dict(zip(system.x, (state.initial for state in system.states), strict=True))
    found = [state.initial for state in system.states]
    for _ in found:  # an initial value that depends on others, which depend on others
        found = [value.xreplace(starts) for value in found]
    return np.array([float(value.xreplace(known)) for value in found])
