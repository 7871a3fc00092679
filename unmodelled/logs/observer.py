"""States that no output shows, integrated along the experiments with the others imposed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from unmodelled.base.arrays import Array, Indices
from unmodelled.base.errors import BadInput
from unmodelled.engine.free_run import Integration, Windows, free_run
from unmodelled.engine.machine.program import Equations, Program, assembled
from unmodelled.logs.measurements import Measurements
from unmodelled.logs.readings import Reading, hidden_states, without_beside
from unmodelled.systems.model import System

#: Integration steps per sampling period; the next number is taken where one is unstable.
SUBSTEPS = (4, 32)


@dataclass(frozen=True)
class _Stretch:
    """Successive experiments of one record, over which no number of the system changes."""

    owner: int  # number of the first of them
    last: int  # number of the last of them
    start: int  # filled sample
    steps: int  # filled samples that follow


@dataclass(frozen=True, eq=False)
class _Courses:
    """Samples of experiments with the gaps between the parts of a record filled by straight lines."""

    logs: Measurements
    before: Indices  # (filled samples,), samples at or before them
    share: Array  # (filled samples,), of the way to the next sample
    first: Indices  # (experiments,), first filled samples

    @classmethod
    def of(cls, logs: Measurements) -> _Courses:
        """Return the filled samples of experiments."""
        starts = logs.offsets[:-1]
        missing = [max(logs.gap(i) or 1, 1) - 1 for i in range(len(logs))]
        if not any(missing):
            return cls(logs, np.arange(len(logs.t)), np.zeros(len(logs.t)), starts)
        count = np.ones(len(logs.t), np.int64)
        count[starts[1:] - 1] += np.array(missing[1:], np.int64)
        before = np.repeat(np.arange(len(count)), count)
        number = np.arange(len(before)) - np.repeat(np.cumsum(count) - count, count)
        return cls(logs, before, number / count[before], starts + np.cumsum(missing))

    def filled(self, values: Array) -> Array:
        """Return the filled samples of tables (tables * samples, columns), in the same shape."""
        samples, columns = len(self.logs.t), values.shape[1]
        if len(self.before) == samples:
            return values
        tables = values.reshape(len(values) // samples, samples, columns)
        after = tables[:, np.minimum(self.before + 1, samples - 1)]
        between = tables[:, self.before] + self.share[:, None] * (after - tables[:, self.before])
        return between.reshape(-1, columns)

    def levels(self, runs: Iterable[int], numbers: Sequence[Array]) -> list[list[_Stretch]]:
        """Return stretches of equal numbers (experiments, ...) to some experiments, first ones first."""
        levels: list[list[_Stretch]] = []
        for record in self._records(set(runs)):
            changes = [i for i in record[1:] if any((a[i] != a[i - 1]).any() for a in numbers)]
            for level, (a, b) in enumerate(zip([record[0], *changes], [*changes, None], strict=True)):
                last = record[-1] if b is None else b - 1
                length = int(self.logs.offsets[last + 1] - self.logs.offsets[last]) - 1
                end = self.first[last] + length if b is None else self.first[b]
                stretch = _Stretch(a, last, int(self.first[a]), int(end - self.first[a]))
                levels += [[]] if level == len(levels) else []
                levels[level].append(stretch)
        return levels

    def _records(self, wanted: set[int]) -> list[list[int]]:
        """Experiments of every record with a wanted one, up to the last wanted one."""
        records: list[list[int]] = []
        for i in range(len(self.logs)):
            if self.logs.gap(i) is None:
                records.append([i])
            else:
                records[-1].append(i)
        last = [max(wanted.intersection(record), default=-1) for record in records]
        return [
            [i for i in record if i <= end] for record, end in zip(records, last, strict=True) if end >= 0
        ]


@dataclass(frozen=True, eq=False)
class Observer:
    """Integration of hidden states, driven by inputs and by what outputs show of the other states."""

    program: Program  # its outputs are the hidden states
    initial: Program  # its outputs are the hidden states at the start of every experiment
    columns: tuple[int, ...]  # numbers of the inputs and other states that both programs depend on
    hold: tuple[float, ...]  # course of these between samples, see `Integration`
    names: tuple[str, ...]  # of the hidden states

    @classmethod
    def of(cls, system: System, shown: Sequence[Reading]) -> Observer:
        """Return the observer of the states that no output shows."""
        hidden, states = hidden_states(system, shown), without_beside(system, shown)
        names = [system.x[k] for k in hidden]
        starts = [system.states[k].initial.xreplace(states) for k in hidden]
        for _ in hidden:
            starts = [start.xreplace(dict(zip(names, starts, strict=True))) for start in starts]
        for name, start in zip(names, starts, strict=True):
            if start.free_symbols & set(names):
                unknown = " and ".join(sorted(map(str, start.free_symbols & set(names))))
                raise BadInput(
                    f"{system.place}: states.{name}.initial: depends on {unknown}, which no output shows, in "
                    "a circle: give one of them as a number"
                )
        imposed = [x for x in system.x if x not in names]
        rates = [system.dynamics[k].xreplace(states) for k in hidden]
        equations = Equations.of(system, names)
        laws = {effort: law.xreplace(states) for effort, law in equations.laws.items()}
        needed = set[object]().union(*(e.free_symbols for e in (*rates, *starts, *laws.values())))
        driving = [*system.u, *imposed]
        columns = tuple(k for k, name in enumerate(driving) if name in needed)
        driven = [driving[k] for k in columns]
        equations = replace(equations, states=names, inputs=driven, rates=rates, laws=laws)
        hold = [*(item.course for item in system.inputs), *(1.0 for _ in imposed)]
        held = tuple(hold[k] for k in columns)
        programs = assembled(equations), assembled(replace(equations, observed=starts))
        return cls(*programs, columns, held, tuple(map(str, names)))

    @property
    def parameters(self) -> Indices:
        """Indices of the parameters that the hidden states depend on, shape (such parameters,)."""
        return np.union1d(self.program.parameters, self.initial.parameters)

    def states(
        self,
        logs: Measurements,
        driven: Array,
        shift: Indices,
        at: tuple[Indices, Indices],
        p: Array,
        c: Array,
        substeps: int = SUBSTEPS[0],
    ) -> Array:
        """Integrate from the start of every record by the Runge-Kutta method of order four.

        Inputs and imposed states, driven (tables * samples, columns), run straight between samples; efforts
        are those of the known laws. A record that was cut into experiments is integrated from its first
        sample, through the gaps between them. An experiment whose record has no beginning in `logs` starts at
        its state in `logs`. Gives (rows, sets, hidden states) for p (experiments, sets, parameters) and
        c (experiments, constants), all in SI.
        """
        courses = _Courses.of(logs)
        levels = courses.levels(at[0].tolist(), [p[:, :, self.parameters], c])
        filled = courses.filled(np.ascontiguousarray(driven))
        shift = shift // len(logs.t) * len(courses.before)
        windows = [_windows(courses, filled, shift, level) for level in levels]

        def along(steps: int) -> Array:
            return self._along(courses, levels, windows, at, (p, c), self._by(logs, steps))

        return _stable(along, substeps)

    def shortly_before(
        self, windows: Windows, p: Array, c: Array, logs: Measurements, substeps: int = SUBSTEPS[0]
    ) -> Array:
        """Integrate states (windows, sets, hidden states) over windows that start as records do."""
        x0, every = self._starts(windows, p, c), np.arange(len(windows.start))

        def along(steps: int) -> Array:
            found = free_run(self.program, windows, p, c, x0, self._by(logs, steps))
            return found[every, :, windows.steps]

        return _stable(along, substeps)

    def _by(self, logs: Measurements, steps: int) -> Integration:
        return Integration(logs.period, "rk4", steps, self.hold)

    def _along(
        self,
        courses: _Courses,
        levels: Sequence[Sequence[_Stretch]],
        windows: Sequence[Windows],
        at: tuple[Indices, Indices],
        numbers: tuple[Array, Array],
        how: Integration,
    ) -> Array:
        """States (rows, sets, hidden states) at the rows of interest."""
        logs, (owner, sample) = courses.logs, at
        z = np.full((len(owner), len(windows[0].shift), len(self.names)), np.nan)
        ends: dict[int, Array] = {}
        for level, one in zip(levels, windows, strict=True):
            x0 = self._known(logs, one, self._starts(one, *numbers))
            for k, stretch in enumerate(level):
                x0[k] = ends.get(stretch.owner, x0[k])
            found = free_run(self.program, one, *numbers, x0, how)
            window = np.full(len(logs), -1)
            for k, stretch in enumerate(level):
                window[stretch.owner : stretch.last + 1] = k
                ends[stretch.last + 1] = found[k, :, stretch.steps]
            mine = window[owner] >= 0
            at_row = window[owner[mine]]
            z[mine] = found[at_row, :, courses.first[owner[mine]] + sample[mine] - one.start[at_row]]
        return z

    def _starts(self, windows: Windows, p: Array, c: Array) -> Array:
        """States (windows, sets, hidden states) from which records start."""
        owner, rows = windows.owner, windows.start[:, None] + windows.shift
        unknown = np.zeros(self.initial.sizes.states)
        return self.initial.evaluate(
            windows.t[windows.start][:, None], unknown, windows.u[rows], p[owner], c[owner][:, None]
        )

    def _known(self, logs: Measurements, windows: Windows, x0: Array) -> Array:
        """The same, from `logs` where the record of an experiment has no beginning there."""
        known = [j for j, name in enumerate(self.names) if name in logs.states]
        columns = [logs.states.index(self.names[j]) for j in known]
        for k, i in enumerate(windows.owner.tolist()):
            if known and logs.continues and logs.continues[i] is not None:
                x0[k][:, known] = logs.x[logs.offsets[i], columns]
        return x0


def _stable(along: Callable[[int], Array], substeps: int) -> Array:
    """The states by the fewest integration steps per sampling period that are stable."""
    for steps in (substeps, *(more for more in SUBSTEPS if more > substeps)):
        z = along(steps)
        if np.isfinite(z).all():
            break
    return z


def _windows(courses: _Courses, filled: Array, shift: Indices, stretches: Sequence[_Stretch]) -> Windows:
    """The stretches as windows of filled samples."""
    owner, start, steps = (
        np.array([getattr(s, name) for s in stretches], np.int64) for name in ("owner", "start", "steps")
    )
    return Windows(filled, courses.logs.t[courses.before], start, steps, owner, shift)
