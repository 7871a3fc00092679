"""Preparation of measured experiments for one system: inputs at the time they act, and estimated states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.logs.clock import SHORTEST_LOG, delayed
from unmodelled.logs.constants import part_name, with_constants
from unmodelled.logs.differentiate import smooth_derivative
from unmodelled.logs.measurements import Continued, M, Measurements, names
from unmodelled.logs.observer import Observer
from unmodelled.logs.readings import Reading, hidden_states, readings
from unmodelled.logs.time_units import on_clock
from unmodelled.systems.model import System
from unmodelled.systems.numeric import numpy_system_function

#: Parts into which a record that is alone is cut, at most.
PARTS = 8


def prepare(system: System, logs: M) -> M:
    """Return the experiments with the inputs as they act on `system`, and with its estimated states.

    A state that an output shows, as itself or times and plus constants, is that output's column; what the
    output shows of other states beside it is subtracted. The velocity of such a position is its smoothed
    derivative. Both are read later by the output's delay, and held at the end where the log has no later
    samples. Every other state is integrated from its initial value with these imposed. Logs that were
    prepared for another system with the same inputs and outputs are prepared anew; preparing twice for one
    system changes nothing.
    """
    if (logs.outputs, logs.inputs, logs.constants) != (wanted := names(system))[:2] + wanted[3:]:
        raise BadInput(f"system {system.name}: inputs, outputs or operating point are not those of the logs")
    acting = with_delays(system, logs)
    x, measured, notes = _states(system, acting)
    every = tuple(dict.fromkeys([*acting.notes, *system.notes, *notes]))
    return replace(acting, states=wanted[2], x=x, measured=measured, notes=every)


def prepared_for(system: System, logs: M) -> M:
    """Return the experiments prepared for a system that may have further constants, as an augmented one."""
    places = [f"experiment {name}" for name in logs.ids]
    table, notes = with_constants(system, logs.experiments, places)
    constants = names(system)[3]
    if lacking := [name for name in constants if name not in table]:
        raise BadInput(f"system {system.name}: operating_point.{lacking[0]}: the logs have no such column")
    c, every = table[list(constants)].to_numpy(np.float64), tuple(dict.fromkeys([*logs.notes, *notes]))
    return prepare(system, replace(logs, experiments=table, constants=constants, c=c, notes=every))


def several(system: System, logs: M) -> M:
    """Return a record that is alone as several experiments, one after the other, with a note.

    Two or more experiments stay as they are, and so does a record that is too short.
    """
    count = min(PARTS, len(logs.t) // SHORTEST_LOG)
    if len(logs) > 1 or count < 2:
        return logs
    edges = np.linspace(0, len(logs.t), count + 1).astype(np.int64)
    ids = tuple(part_name(logs.ids[0], k) for k in range(1, count + 1))
    note = (
        f"{logs.ids[0]} is the only record: it was cut into {count} experiments of "
        f"{logs.period * len(logs.t) / count:.3g} s, {ids[0]} to {ids[-1]}; states that no output shows "
        "go on from one to the next"
    )
    rows = [0] * count
    parts = replace(
        logs,
        ids=ids,
        experiments=logs.experiments.iloc[rows].assign(id=ids).reset_index(drop=True),
        offsets=edges,
        t=logs.t - np.repeat(logs.t[edges[:-1]], np.diff(edges)),
        c=logs.c[rows],
        continues=(None, *(Continued(name, 1) for name in ids[:-1])),
        notes=(*logs.notes, note),
    )
    return prepare(system, parts)


def with_delays(system: System, logs: M) -> M:
    """Return the experiments with the inputs of `system` after its delays; the states stay as they are."""
    wanted = tuple(item.delay for item in system.inputs)
    more = [new - old for new, old in zip(wanted, logs.delays or [0.0] * len(wanted), strict=True)]
    shortest = int(np.argmin(np.diff(logs.offsets)))
    seconds = logs.period * (np.diff(logs.offsets)[shortest] - 1)
    for item, delay in zip(system.inputs, more, strict=True):
        if abs(delay) >= seconds:
            raise BadInput(
                f"system {system.name}: inputs.{item.name}.delay: {delay:g} s is too long for "
                f"experiment {logs.ids[shortest]} of {seconds:g} s"
            )
    return replace(logs, u=delayed(logs.u, logs.offsets, logs.period, more, "linear"), delays=wanted)


def _states(system: System, logs: Measurements) -> tuple[Array, tuple[bool, ...], list[str]]:
    """States (samples, states), whether an output shows each of them or its position, and notes."""
    x = np.zeros((len(logs.t), len(system.states)))
    gains = _Gains(system, logs)
    shown = readings(system, gains.usable)
    found = {r.state: r for r in shown}
    notes = []
    for r in (r for r in shown if not r.slope):
        x[:, r.state] = gains.state(r)
        if not r.plain:
            output = system.outputs[r.output]
            notes.append(f"{system.states[r.state].name} was read from {output.name} = {output.expression}")
    for r in (r for r in shown if r.slope):
        position = next(p for p in shown if not p.slope and p.output == r.output)
        _, x[:, r.state], width = smooth_derivative(x[:, position.state], logs.offsets, logs.period)
        notes.append(
            f"{system.states[r.state].name} was estimated from {system.states[position.state].name} by "
            f"smoothing differentiation over {width} samples"
        )
    ahead = [-system.outputs[found[k].output].delay if k in found else 0.0 for k in range(x.shape[1])]
    x = delayed(x, logs.offsets, logs.period, ahead, "cubic")
    held = {system.outputs[r.output].name: system.outputs[r.output].delay for r in shown}
    notes += [
        f"what {name} shows is held over the last {delay:g} s, its delay"
        for name, delay in held.items()
        if delay > 0.0
    ]
    hidden = hidden_states(system, shown)
    if hidden:
        x[:, hidden] = _integrated(system, shown, logs, x)
        hidden_names = ", ".join(system.states[k].name for k in hidden)
        notes.append(
            f"{hidden_names}: no output shows it, integrated from the start of each record: a record that "
            "begins elsewhere than at `initial` is predicted wrongly; begin it there"
        )
    if any(r.beside for r in shown):
        x[:, [r.state for r in shown]] -= _beside(system, shown, logs, x)
    return x, tuple(k in found for k in range(x.shape[1])), notes


class _Gains:
    """Gains and offsets of outputs along experiments, with the system's own numbers."""

    def __init__(self, system: System, logs: Measurements) -> None:
        self.system, self.logs = system, logs

    def _values(self, reading: Reading) -> Array:
        """Gain, offset and lag at the times that the samples show, (samples, 3)."""
        system, logs = self.system, self.logs
        late = [system.outputs[reading.output].delay] * logs.u.shape[1]
        u = delayed(logs.u, logs.offsets, logs.period, late, "linear")
        function = numpy_system_function(
            system, [reading.gain, reading.offset, reading.lag], efforts_zero=True
        )
        x, none = np.zeros((1, len(system.x))), np.empty(0)
        return function(0.0, x, u, none, np.array(system.values), logs.c[logs.owner])

    def usable(self, reading: Reading) -> bool:
        """Whether the output can be solved for the state in every experiment."""
        if reading.plain:
            return True
        values = self._values(reading)
        return bool(np.isfinite(values).all() and np.all(values[..., 0] != 0.0))

    def state(self, reading: Reading) -> Array:
        """Values of the state, (samples,)."""
        y = self.logs.y[:, reading.output]
        if reading.plain:
            return y
        values = self._values(reading)
        if reading.lag != 0:
            y = y + values[:, 2] * smooth_derivative(y, self.logs.offsets, self.logs.period)[1]
        return np.asarray((y - values[:, 1]) / values[:, 0])


def _beside(system: System, shown: Sequence[Reading], logs: Measurements, x: Array) -> Array:
    """What outputs show together with the states that are read from them, (samples, readings)."""
    function = numpy_system_function(system, [r.beside for r in shown], efforts_zero=True)
    return function(0.0, x, logs.u, np.empty(0), np.array(system.values), logs.c[logs.owner])


def _integrated(system: System, shown: Sequence[Reading], logs: Measurements, x: Array) -> Array:
    """States that no output shows, (samples, such states), the others of `x` imposed."""
    hidden = hidden_states(system, shown)
    sample = np.arange(len(logs.t)) - logs.offsets[logs.owner]
    driven = np.concatenate([logs.u, np.delete(x, hidden, axis=1)], axis=1)
    p = np.broadcast_to(system.values, (len(logs), 1, len(system.values)))
    observer, none = Observer.of(system, shown), np.zeros(1, np.int64)
    z = observer.states(logs, driven[:, observer.columns], none, (logs.owner, sample), p, logs.c)[:, 0]
    bad = ~np.isfinite(z)
    if not bad.any():
        return z
    row = min(np.flatnonzero(bad.any(axis=1)).tolist(), key=lambda k: (sample[k], logs.owner[k]))
    state = system.states[hidden[int(np.argmax(bad[row]))]]
    where = f"experiment {logs.ids[logs.owner[row]]} at t = {on_clock(sample[row] * logs.period, logs.clock)}"
    raise BadInput(
        f"system {system.name}: dynamics.{state.name} diverges in {where} when it is integrated from its "
        f"initial value {state.initial}"
    )
