"""Integrate by the scheme of Moreau and Jean: impulses change velocities, and velocities change positions."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from pipeline.rigs.withheld.effects.effect import ActuatorEffect, Plan
from pipeline.rigs.withheld.machine import Conditions, Forces, Machine, State
from unmodelled.base.arrays import Array

#: Reference, its slope, positions, velocities and conditions -> command.
Control = Callable[[Array, Array, Array, Array, Conditions], Array]


class Motion(NamedTuple):
    """Simulated motion at the samples of the logger."""

    q: Array  # (samples, d, n), positions
    v: Array  # (samples, d, n), velocities
    u: Array  # (samples, n), commands


def move(
    machine: Machine,
    plan: Plan,
    reference: Array,
    q: Array,
    forces: Forces,
    drive: Sequence[ActuatorEffect],
    control: Control | None = None,
) -> Motion:
    """Simulate a machine from rest along a reference.

    The scheme is of second order where nothing sticks or hits: forces are evaluated at the centre of a step,
    and positions follow by the trapezoidal rule. Sticking friction makes the velocity exactly zero. A command
    is held for one sampling period.

    Takes reference (samples, n), q (d, n).
    """
    command = machine.command if control is None else control
    slope = np.gradient(reference, plan.period, axis=0)

    def commanded(k: int, q: Array, v: Array) -> Array:
        return command(reference[k], slope[k], q, v, plan.conditions)

    return _run(machine, plan, commanded, q, forces, drive, None, 1)


def follow(
    machine: Machine, plan: Plan, motion: Motion, steps: int, forces: Forces, drive: Sequence[ActuatorEffect]
) -> Motion:
    """Run the machine with the commands of `motion`, in windows of `steps` samples from its states.

    The rows are those of the windows' ends and insides; a window starts after the row that ends the last one.
    Effects keep their memory from window to window.
    """

    def commanded(k: int, q: Array, v: Array) -> Array:
        return np.asarray(motion.u[k])

    return _run(machine, plan, commanded, motion.q[0], forces, drive, motion, steps)


def _run(
    machine: Machine,
    plan: Plan,
    commanded: Callable[[int, Array, Array], Array],
    q: Array,
    forces: Forces,
    drive: Sequence[ActuatorEffect],
    restarts: Motion | None,
    steps: int,
) -> Motion:
    state = State(q, np.zeros_like(q), np.zeros_like(q))
    dt, read = plan.step, round(plan.hold * plan.substeps)
    rows: list[tuple[Array, Array, Array]] = []

    def logged() -> State:
        rows.append((state.q, state.v, u))
        k = len(rows) - 1
        if restarts is None or k % steps:
            return state
        return State(restarts.q[k], restarts.v[k], restarts.v[k])

    for k in range(plan.samples):
        u = commanded(k, state.q, state.v)
        for s in range(plan.substeps):
            if s == read:
                state = logged()
            t, acting = k * plan.period + s * dt, u
            for actuator in drive:
                acting = actuator.applied(dt, t, acting)
            state = machine.step(dt, t, state, acting, plan.conditions, forces)
        if read == plan.substeps:
            state = logged()
    return Motion(*(np.array(column) for column in zip(*rows, strict=True)))
