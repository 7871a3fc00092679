"""Experiments, simulated from the start that the limits give."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import NamedTuple

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.design.limits import Limits
from unmodelled.engine.free_run import Integration, Windows, free_run
from unmodelled.engine.machine.program import Program
from unmodelled.systems.model import System, symbol

#: Values that are simulated at once, about: a budget of memory.
AT_ONCE = 10_000_000


def quantities(system: System, limits: Limits) -> tuple[sp.Expr, ...]:
    """Return expressions of what the travel limits hold for, see `Limits.columns`.

    Of an output it is the logged column, and the same where an effect at the sensor makes the column err.
    """
    outputs = {o.name: o.expression for o in system.outputs}
    logged = [outputs[n] if n in outputs else system.expression(n) for n in limits.travel]
    return (*logged, *(limits.shown.get(n, e) for n, e in zip(limits.travel, logged, strict=True)))


def equations(system: System, watched: Sequence[sp.Expr]) -> Program:
    """Compile a system with its outputs, and with quantities to watch."""
    return Program.of(system, [*(o.expression for o in system.outputs), *watched])


class Simulated(NamedTuple):
    """Simulated experiments."""

    y: Array  # outputs, shape (designs, sets, samples, outputs), SI
    watched: Array  # quantities, shape (designs, sets, times, quantities), SI
    step: float  # s, from one time to the next

    def of(self, design: int) -> Simulated:
        """Return the runs of one experiment, whose arrays begin with the sets."""
        return Simulated(self.y[design], self.watched[design], self.step)

    def sets(self, some: slice) -> Simulated:
        """Return the runs of one experiment with some of its sets of numbers."""
        return Simulated(self.y[some], self.watched[some], self.step)


def in_parts(u: Array, systems: Sequence[System], limits: Limits, substeps: int) -> list[Array]:
    """Split experiments (designs, samples, inputs) into parts that `simulated` can hold in memory."""
    size = u.shape[1] * substeps * len(systems) * (2 * len(limits.travel) + len(systems[0].outputs))
    return np.array_split(u, min(-(-len(u) * size // AT_ONCE), len(u))) if len(u) else []


def simulated(
    systems: Sequence[System],
    u: Array,
    limits: Limits,
    c: Array,
    substeps: int,
    program: Program,
    watching: bool = True,
) -> Simulated:
    """Simulate experiments u (designs, samples, inputs) at constants c with several sets of numbers, SI.

    `watching`, the quantities are those of every integration step: between two samples a machine may swing
    to and fro. They go on after the last sample, at the last inputs, until these have acted in spite of
    their delays. Otherwise they are those of the samples.
    """
    designs, samples, width = u.shape
    looks = substeps if watching else 1
    late = max((item.delay for s in systems for item in s.inputs), default=0.0) / limits.period
    more = ceil(max(late, 0.0) - 1e-9) if watching else 0
    step, hold = limits.period / looks, tuple(item.course for item in systems[0].inputs)
    fine = _finer(np.concatenate([u, np.repeat(u[:, -1:], more, axis=1)], axis=1), looks, hold)
    times = fine.shape[1]
    # by (set, design, time): every set of numbers has input delays of its own
    tables = [_later(fine, [item.delay / step for item in s.inputs]).reshape(-1, width) for s in systems]
    windows = Windows(
        *(np.concatenate(tables), np.tile(step * np.arange(times), designs), times * np.arange(designs)),
        *(np.full(designs, times - 1), np.zeros(designs, np.int64)),
        times * designs * np.arange(len(systems)),
    )
    p = np.array([s.values for s in systems])[None]
    x0 = np.array([start_of(s, limits, c, u[0, 0]) for s in systems])
    how = Integration(step, "rk4", substeps // looks, hold)
    with np.errstate(all="ignore"):
        found = free_run(program, windows, p, c[None], np.tile(x0, (designs, 1, 1)), how)
    outputs = len(systems[0].outputs)
    y = found[:, :, : (samples - 1) * looks + 1 : looks, :outputs]
    shown = [[item.delay / limits.period for item in s.outputs] for s in systems]
    y = np.stack([_later(y[:, k], delays) for k, delays in enumerate(shown)], axis=1)
    return Simulated(y, found[..., outputs:], step)


def _finer(u: Array, looks: int, hold: Sequence[float]) -> Array:
    """Inputs (designs, samples, inputs) at `looks` times per sample; for `hold` see `Integration`."""
    at = np.arange((u.shape[1] - 1) * looks + 1)
    left = at // looks
    after = np.minimum(left + 1, u.shape[1] - 1)
    share = (at / looks - left)[:, None] * np.asarray(hold)
    return np.asarray(u[:, left] + share * (u[:, after] - u[:, left]))


def start_of(system: System, limits: Limits, c: Array, u: Array) -> list[float]:
    """Return start states, SI; those not given follow from the file at c (constants,) and u (inputs,)."""
    known = _known(system, c, u) | dict.fromkeys(system.x, 0.0)
    given = {name: float(x.xreplace(known)) for name, x in limits.start_states.items()}
    known |= {symbol(name): value for name, value in given.items()}
    return [given[s.name] if s.name in given else float(s.initial.xreplace(known)) for s in system.states]


def shown_start(system: System, limits: Limits, u: Array) -> dict[str, float]:
    """Return the start by state, SI; of a state whose name an output has, it is that of the output.

    Takes u (inputs,), SI.
    """
    start = start_of(system, limits, limits.c, u)
    known = _known(system, limits.c, u) | dict(zip(system.x, start, strict=True))
    return {str(x): float(limits.shown.get(str(x), x).xreplace(known)) for x in system.x}


def _known(system: System, c: Array, u: Array) -> dict[sp.Expr, float]:
    """Values of parameters, constants and inputs, SI."""
    known: dict[sp.Expr, float] = dict(zip(system.p, system.values, strict=True))
    return known | dict(zip(system.c, c.tolist(), strict=True)) | dict(zip(system.u, u.tolist(), strict=True))


def _later(values: Array, delays: Sequence[float]) -> Array:
    """Signals (designs, samples, channels), each by its delay (samples) later; they rest before the start."""
    if not any(delays):
        return values
    last = values.shape[1] - 1
    shifted = []
    for k, delay in enumerate(delays):
        at = np.clip(np.arange(last + 1) - delay, 0.0, last)
        left = np.minimum(at.astype(np.int64), last - 1)
        own = values[:, :, k]
        shifted.append(own[:, left] + (at - left) * (own[:, left + 1] - own[:, left]))
    return np.stack(shifted, axis=-1)
