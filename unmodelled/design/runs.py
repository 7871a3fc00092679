"""Simulation of experiments from the start that the limits give, with the delays of inputs and outputs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd
import sympy as sp
from numpy.typing import NDArray

from unmodelled.design.limits import Limits
from unmodelled.engine.free_run import Integration, Windows, free_run
from unmodelled.engine.machine.program import Program
from unmodelled.logs.logs import as_logged
from unmodelled.systems.model import System, symbol

Array = NDArray[np.float64]


def frame(u: Array, system: System, limits: Limits) -> pd.DataFrame:
    """Return an experiment (samples, inputs), SI, as a user runs it: t (s), inputs in logged units."""
    columns = {item.column: as_logged(item, u[:, k]) for k, item in enumerate(system.inputs)}
    return pd.DataFrame({"t": limits.period * np.arange(len(u)), **columns})


def quantities(system: System, names: Iterable[str]) -> tuple[sp.Expr, ...]:
    """Return states, outputs and signals as expressions."""
    outputs = {o.name: o.expression for o in system.outputs}
    states = {s.name for s in system.states}
    return tuple(outputs[n] if n in outputs and n not in states else system.expression(n) for n in names)


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
    known: dict[sp.Expr, float] = dict(zip(system.p, system.values, strict=True))
    known |= dict(zip(system.c, c.tolist(), strict=True)) | dict(zip(system.u, u.tolist(), strict=True))
    known |= {symbol(s.name): limits.start.get(s.name, 0.0) for s in system.states}
    return [
        limits.start[s.name] if s.name in limits.start else float(s.initial.xreplace(known))
        for s in system.states
    ]


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
