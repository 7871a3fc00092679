"""The scheme of Moreau and Jean: velocities jump by impulses, positions follow the projected velocities."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.rigs.withheld.effects.effect import ActuatorEffect, Plan, PortEffect
from pipeline.rigs.withheld.machine import Conditions, Machine

Array = NDArray[np.float64]
#: Reference, its slope, positions, velocities and conditions -> command.
Control = Callable[[Array, Array, Array, Array, Conditions], Array]


class Motion(NamedTuple):
    """Positions q and velocities v (samples, d, n) when the logger reads them, commands u (samples, n)."""

    q: Array
    v: Array
    u: Array


def move(
    machine: Machine,
    plan: Plan,
    reference: Array,
    q: Array,
    forces: Sequence[tuple[str, PortEffect]],
    drive: Sequence[ActuatorEffect],
    control: Control | None = None,
) -> Motion:
    """Run the machine from rest at `q` (d, n) along `reference` (samples, n).

    Where nothing sticks or hits the scheme is of second order: forces are those in the middle of a step,
    positions follow by the trapezoidal rule. Dry friction that suffices leaves exactly no velocity. A command
    holds for a period.

    Args:
        forces: port and effect; smooth ones before those that project velocities.
        drive: what happens to the command, in this order.
        control: command once per sample; `machine.command` unless given.
    """
    command = machine.command if control is None else control
    slope = np.gradient(reference, plan.period, axis=0)

    def commanded(k: int, q: Array, v: Array) -> Array:
        return command(reference[k], slope[k], q, v, plan.conditions)

    return _run(machine, plan, commanded, q, forces, drive, None, 1)


def follow(
    machine: Machine,
    plan: Plan,
    motion: Motion,
    steps: int,
    forces: Sequence[tuple[str, PortEffect]],
    drive: Sequence[ActuatorEffect],
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
    forces: Sequence[tuple[str, PortEffect]],
    drive: Sequence[ActuatorEffect],
    restarts: Motion | None,
    steps: int,
) -> Motion:
    v = before = np.zeros_like(q)
    dt, read = plan.step, round(plan.hold * plan.substeps)
    rows: list[tuple[Array, Array, Array]] = []

    def logged() -> tuple[Array, Array, Array]:
        rows.append((q, v, u))
        k = len(rows) - 1
        if restarts is None or k % steps:
            return q, v, before
        return restarts.q[k], restarts.v[k], restarts.v[k]

    for k in range(plan.samples):
        u = commanded(k, q, v)
        for s in range(plan.substeps):
            if s == read:
                q, v, before = logged()
            t, acting = k * plan.period + s * dt, u
            for actuator in drive:
                acting = actuator.applied(dt, t, acting)
            q, v, before = _step(machine, plan, dt, t, q, v, before, acting, forces)
        if read == plan.substeps:
            q, v, before = logged()
    return Motion(*(np.array(column) for column in zip(*rows, strict=True)))


def _step(
    machine: Machine,
    plan: Plan,
    dt: float,
    t: float,
    q: Array,
    v: Array,
    before: Array,
    u: Array,
    forces: Sequence[tuple[str, PortEffect]],
) -> tuple[Array, Array, Array]:
    """Positions and velocities after the step, and the velocities before it."""
    middle = q + 0.5 * dt * v
    # of the velocity, too, the value in the middle, by the last increment: projected ones are in it
    last, v = v, v + dt * machine.acceleration(middle, 1.5 * v - 0.5 * before, u, plan.conditions)
    for name, force in forces:
        port = machine.port(name, middle, v, plan.conditions)
        v = v + port.response * force.impulse(dt, t, port)
    return middle + 0.5 * dt * v, v, last
