"""Outputs that never change: a sensor that was not connected, or a joint that rests while others move."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from unmodelled.base.errors import BadInput, Faults
from unmodelled.engine.machine.program import Program
from unmodelled.logs.table import SMALLEST, Columns
from unmodelled.systems.model import Input, Output, System

#: Change of a drive, and scatter of the acceleration that the model expects, relative to the medians of the
#: experiments in which the output moves, from which on the output should have moved.
MOVES = 0.5


def check_alive(system: System, logs: Sequence[Columns], faults: Faults) -> None:
    """Refuse outputs that change in no experiment, or stand still while their drives move; logs are in SI."""
    for output in system.outputs:
        moving = [log for log in logs if _change(log, output) > 0.0]
        for log in (log for log in logs if _change(log, output) == 0.0):
            with faults.collected():
                at = f"{log.path}: row {log.row(0)}: column {output.column}"
                what = f"{at}: dead output, {log.values[output.column][0]:g} in every row"
                if not moving:
                    raise BadInput(f"{what}: {_cure(system, output, log)}")
                if is_dead(system, output, moving, log):
                    raise BadInput(f"{what} while its drive moves: leave the experiment out")


def is_dead(system: System, output: Output, moving: Sequence[Columns], still: Columns) -> bool:
    """Return whether an output stands still although its drive and the model say that it should move."""
    drives = drives_of(system, output)
    steady = not any(_change(each, u) for each in moving for u in drives)
    size = _largest if steady else _change
    sizes = [([size(each, u) for each in moving], size(still, u)) for u in drives]
    return _moves(sizes) and (steady or _moves([_expected(system, output, moving, still)]))


def _moves(sizes: Sequence[tuple[Sequence[float], float]]) -> bool:
    """Whether all that usually acts where an output moves acts here too."""
    usual = [(float(np.median(others)), here) for others, here in sizes]
    used = [here >= MOVES * most for most, here in usual if most > 0.0]
    return bool(used) and all(used)


def _expected(
    system: System, output: Output, moving: Sequence[Columns], still: Columns
) -> tuple[list[float], float]:
    """Scatter of the rate that the model expects of an output or of its speed, in logs of both kinds.

    A joint that is held against the others of an arm has a drive that changes, and no acceleration.
    """
    if system.c or output.expression not in system.x:  # constants are not known yet
        return [1.0], 1.0
    rates = dict(zip(system.x, system.dynamics, strict=True))
    rate = rates[output.expression]
    program = Program.of(system, [rates.get(rate, rate)])
    shown = {each.expression: each.column for each in system.outputs}
    speeds = {rates[x]: column for x, column in shown.items() if x in rates}

    def scatter(log: Columns) -> float:
        t, nothing = log.values["t"], np.zeros(len(log))
        of_speeds = {x: np.gradient(log.values[column], t) for x, column in speeds.items() if x in rates}
        states = of_speeds | {x: log.values[column] for x, column in shown.items()}
        x = np.stack([states.get(x, nothing) for x in system.x], -1)
        u = (
            np.stack([log.values[item.column] for item in system.inputs], -1)
            if system.u
            else np.empty((len(t), 0))
        )
        p = np.broadcast_to(np.array(system.values), (len(t), len(system.p)))
        return float(np.std(program.evaluate(t, x, u, p, np.empty((len(t), 0)))))

    return [scatter(log) for log in moving], scatter(still)


def check_size(log: Columns, system: System) -> None:
    """Refuse a log of which an output changes by less than can be computed with."""
    for column in (output.column for output in system.outputs):
        values = log.values[column]
        if len(values) and 0.0 < np.ptp(values) < SMALLEST:
            raise BadInput(
                f"{log.path}: row {log.row(0)}: column {column}: its values differ by no more than "
                f"{np.ptp(values):.3g}, too little to compute with: check the unit of the column"
            )


def drives_of(system: System, output: Output) -> list[Input]:
    """Return the inputs that drive an output: those of its joint, or else the first that act on it."""
    seen = output.expression.free_symbols
    for port in system.ports:
        if port.load is not None and {str(x) for x in seen} & {*port.coordinates}:
            seen = system.expression(port.load).free_symbols
            break
    followed = set(seen)
    while not (found := seen & {*system.u}):
        rates = [system.dynamics[k] for k, x in enumerate(system.x) if x in seen]
        seen = {x for rate in rates for x in rate.free_symbols} - followed
        if not seen:
            return []
        followed |= seen
    return [item for item, u in zip(system.inputs, system.u, strict=True) if u in found]


def _change(log: Columns, signal: Input | Output) -> float:
    values = log.values[signal.column]
    return float(np.ptp(values)) if len(values) else 0.0


def _largest(log: Columns, signal: Input | Output) -> float:
    values = log.values[signal.column]
    return float(np.max(np.abs(values))) if len(values) else 0.0


def _cure(system: System, output: Output, log: Columns) -> str:
    names = {str(x) for x in output.expression.free_symbols}
    ports = [port.name for port in system.ports if names & {*port.coordinates}]
    if system.robot is not None and ports:
        return f"lock the joint (locked: {{{ports[0]}: {log.values[output.column][0]:.4g}}})"
    return "leave the output out of the system file, or the sensor was not connected"
