"""Laws as functions of local signals along a path: no system is built for them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.columns.path import Path
from unmodelled.effects.law import Law
from unmodelled.effects.motion import acceleration
from unmodelled.effects.place import Place, Site
from unmodelled.engine.free_run import Integration, Windows, free_run
from unmodelled.engine.machine.program import Equations, Program, assembled
from unmodelled.systems.grammar import parse
from unmodelled.systems.model import symbol
from unmodelled.systems.scope import Scope, Value


@cache
def compiled(adds: tuple[str, ...], rates: tuple[tuple[str, str], ...], *names: tuple[str, ...]) -> Program:
    """Return a law in local names as a program of the register machine."""
    memory = tuple(name for name, _ in rates)
    scope = Scope({n: Value(symbol(n)) for group in (*names, memory) for n in group})
    signals, numbers, constants = ([symbol(n) for n in group] for group in names)
    shown, grown = ([parse(text, scope, text) for text in texts] for texts in (adds, [r for _, r in rates]))
    return assembled(
        Equations([symbol(n) for n in memory], signals, numbers, constants, grown, shown, {}, ())
    )


@dataclass(frozen=True, eq=False)
class LocalLaws:
    """Contributions of laws at the sites of a system along a path."""

    path: Path
    sites: Mapping[Place, Site]  # with the magnitudes of their signals

    @cached_property
    def _signals(self) -> tuple[dict[tuple[Place, str], int], Array, Array]:
        """Number of every local signal, and all of them on the half grid and along the logs."""
        found: dict[tuple[Place, str], sp.Expr] = {}
        system = self.path.system
        for place, where in self.sites.items():
            for local, quantity in where.quantities.items():
                found[place, local] = quantity.expression
                if isinstance(quantity.expression, sp.Dummy):  # the acceleration of a port
                    found[place, local] = acceleration(system, system.port(place.name), system.closed)
        unique = list(dict.fromkeys(found.values()))
        number = {e: k for k, e in enumerate(unique)}
        half, log = self.path.evaluate(unique), self.path.evaluate(unique, log=True)
        return {key: number[e] for key, e in found.items()}, half, log

    def signals(self, place: Place, log: bool = False) -> tuple[tuple[str, ...], Array]:
        """Return names and values (windows, 2 K + 1, signals), SI, of the local signals of a place."""
        number, half, logged = self._signals
        names = tuple(self.sites[place].quantities)
        return names, (logged if log else half)[..., [number[place, n] for n in names]]

    def contributions(self, law: Law, place: Place, shapes: Sequence[Mapping[str, float]]) -> Array:
        """Return the addition (windows, 2 K + 1, shapes * amplitudes), SI, by one unit of each amplitude.

        A memory is integrated along the logs up to the start of a window, then along the path.
        """
        path, (names, drive) = self.path, self.signals(place)
        sets = [{**{n: f.value for n, f in law.fixed.items()}, **shape} for shape in shapes]
        numbers, table = tuple(sets[0]), path.recording.logs.experiments
        p = np.array([[one[n] for n in numbers] for one in sets]).reshape(len(sets), len(numbers))
        c = np.array([of(table) for of in law.columns.values()]).T.reshape(len(table), len(law.columns))
        rates = tuple((n, m.rate) for n, m in law.memory.items())
        own = names, numbers, tuple(law.columns)
        program = compiled(tuple(a.adds for a in law.amplitudes.values()), rates, *own)
        if rates:
            memory = compiled(tuple(law.memory), rates, *own)
            with np.errstate(all="ignore"):
                found = self._along(program, drive, p, c, self._remembered(law, place, memory, p, c))
            found = np.nan_to_num(found, posinf=0.0, neginf=0.0)
        else:
            half = drive.shape[1]
            rows = drive.reshape(-1, drive.shape[2])
            found = program.evaluate_sets(path.t.ravel(), rows, p, c, np.repeat(path.owner, half))
        return found.reshape(*drive.shape[:2], -1)

    def _along(self, program: Program, drive: Array, p: Array, c: Array, x0: Array) -> Array:
        """Contributions (windows, 2 K + 1, sets, amplitudes) of a law with memory along the path."""
        path, (windows, half) = self.path, drive.shape[:2]
        none = np.zeros(len(p), np.int64)
        rows = drive.reshape(windows * half, -1)
        asked = Windows(
            rows, path.t.ravel(), half * np.arange(windows), 2 * path.recording.steps, path.owner, none
        )
        everywhere = np.broadcast_to(p, (len(c), *p.shape))
        y = free_run(program, asked, everywhere, c, x0, Integration(0.5 * path.period, "rk4", 1, 1.0))
        return np.moveaxis(y, 1, 2)

    def _remembered(self, law: Law, place: Place, memory: Program, p: Array, c: Array) -> Array:
        """Memory (windows, sets, states) at the starts of the windows."""
        (names, drive), path = self.signals(place, log=True), self.path
        logs, record = path.recording.logs, path.recording
        runs = np.array(sorted(record.runs), np.int64)
        first, length = logs.offsets[runs], np.diff(logs.offsets)[runs]
        begin = [
            np.zeros(len(runs)) if m.start == "0" else drive[first, names.index(m.start)]
            for m in law.memory.values()
        ]
        x0 = np.repeat(np.stack(begin, axis=1)[:, None], len(p), axis=1)
        none = np.zeros(len(p), np.int64)
        asked = Windows(np.ascontiguousarray(drive), logs.t, first, length - 1, runs, none)
        everywhere = np.broadcast_to(p, (len(c), *p.shape))
        z = free_run(memory, asked, everywhere, c, x0, Integration(path.period, "rk4", 2, 1.0))
        run = np.searchsorted(runs, record.owner)
        return np.nan_to_num(z[run, :, record.start - logs.offsets[record.owner]])

    def delayed(self, place: Place, delays: Array) -> Array:
        """Return the changes (windows, 2 K + 1, delays) of an input or output by delays, s."""
        path, record, logs = self.path, self.path.recording, self.path.recording.logs
        if place.kind == "actuator":
            j = [item.name for item in path.system.inputs].index(place.name)
            series, now = path.log_u[:, j], path.u[..., j]
        else:
            # the simulated output; before a window starts, that of the window before
            (output,) = (o.expression for o in path.system.outputs if o.name == place.name)
            now = path.evaluate([output])[..., 0]
            series = path.evaluate([output], log=True)[:, 0]
            rows = record.start[:, None] + np.arange(1, now.shape[1] // 2 + 1)
            series[rows[record.counted]] = now[:, 2::2][record.counted]
        found, half = np.empty((*now.shape, len(delays))), np.arange(now.shape[1]) / 2.0
        for w, (start, run) in enumerate(zip(record.start, record.owner, strict=True)):
            low, high = logs.offsets[run], logs.offsets[run + 1]
            at = (start - low) + half[:, None] - delays / path.period
            found[w] = np.interp(at, np.arange(high - low), series[low:high])
        return found - now[..., None]
