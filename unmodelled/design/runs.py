"""Experiments, simulated from the start that the limits give."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.design.limits import Limits
from unmodelled.engine.free_run import Integration, Windows, free_run
from unmodelled.engine.machine.program import Program
from unmodelled.systems.model import System, symbol


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


def simulated(
    systems: Sequence[System], u: Array, limits: Limits, c: Array, substeps: int, program: Program
) -> tuple[Array, Array]:
    """Simulate experiments u (designs, samples, inputs) at constants c with several sets of numbers, SI.

    Gives outputs (designs, sets, samples, outputs) and quantities (designs, sets, samples, quantities).
    """
    designs, samples, _ = u.shape
    # by (set, design, sample): every set of numbers has input delays of its own
    late = [[item.delay / limits.period for item in s.inputs] for s in systems]
    tables = np.concatenate([_later(u, delays).reshape(-1, u.shape[2]) for delays in late])
    first = samples * np.arange(designs)
    windows = Windows(
        *(tables, np.tile(limits.period * np.arange(samples), designs), first),
        *(np.full(designs, samples - 1), np.zeros(designs, np.int64)),
        samples * designs * np.arange(len(systems)),
    )
    p = np.array([s.values for s in systems])[None]
    x0 = np.array([start_of(s, limits, c, u[0, 0]) for s in systems])
    hold = tuple(item.course for item in systems[0].inputs)
    how = Integration(limits.period, "rk4", max(substeps, 1), hold)
    start = np.tile(x0, (designs, 1, 1))
    with np.errstate(all="ignore"):
        found = free_run(program, windows, p, c[None], start, how)
    outputs = len(systems[0].outputs)
    y = found[..., :outputs]
    shown = [[item.delay / limits.period for item in s.outputs] for s in systems]
    y = np.stack([_later(y[:, k], delays) for k, delays in enumerate(shown)], axis=1)
    return y, found[..., outputs:]


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
