"""Efforts at the ports of a fitted hypothesis along its training experiments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.effects.added import Added, with_numbers
from unmodelled.effects.motion import acceleration, is_inertial, mobility
from unmodelled.engine.machine.program import Program
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import TIME, System, symbol

#: Samples over which a measured acceleration is taken; one is too noisy.
LAG = 10
#: Share of a port's largest mobility below which its effort hardly moves anything, as at a dead centre.
LEAST_MOBILITY = 0.1


@dataclass(frozen=True, eq=False)
class Efforts:
    """Efforts of the known physics and of the effects, with the fitted numbers."""

    fitted: FittedHypothesis

    @cached_property
    def system(self) -> System:
        """Return the known physics with the fitted numbers."""
        return self.fitted.hypothesis.study.system.with_values(self.fitted.fit.values)

    @cached_property
    def logs(self) -> Logs:
        """Return the training experiments."""
        study = self.fitted.hypothesis.study
        return prepare(self.system, study.logs.among(study.learned))

    def along(self, expressions: Sequence[sp.Expr]) -> Array:
        """Return expressions (k, samples), SI, of the known physics along the training experiments."""
        system, logs = self.system, self.logs
        program, p = Program.of_values(system, expressions), np.array(system.values)
        return program.evaluate(logs.t, logs.x, logs.u, p, logs.c[logs.owner]).T

    def mass(self, name: str) -> float:
        """Return the median mass, or moment of inertia, that a port feels."""
        port = self.system.port(name)
        if not is_inertial(self.system, port):
            return np.inf
        (yielding,) = np.abs(self.along([mobility(self.system, port)]))
        return 1.0 / float(np.median(yielding[np.isfinite(yielding)]))

    def largest(self, name: str) -> float:
        """Return the largest effort that acts at a port, or that it lacks there to move as measured."""
        system, logs = self.system, self.logs
        port = system.port(name)
        if not is_inertial(system, port):
            return np.inf
        speed = system.expression(str(port.velocity))
        a, yielding, v = self.along(
            [acceleration(system, port, system.closed), mobility(system, port), speed]
        )
        moved = np.abs(yielding) > LEAST_MOBILITY * np.abs(yielding).max(initial=0.0)
        first = np.flatnonzero(logs.owner[LAG:] == logs.owner[:-LAG])
        slope = (v[first + LAG] - v[first]) / (LAG * logs.period)
        middle = first + LAG // 2
        slope, middle = slope[moved[middle]], middle[moved[middle]]
        lacking = (a[middle] - slope) / yielding[middle]
        efforts = np.abs(np.concatenate([a[moved] / yielding[moved], lacking]))
        return float(efforts[np.isfinite(efforts)].max(initial=0.0)) or np.inf

    def of(self, added: Added) -> float:
        """Return the largest effort of an effect on a port."""
        hypothesis, system = self.fitted.hypothesis, self.system
        final = with_numbers(hypothesis.full, hypothesis.effects, self.fitted.fit.values)
        own = {symbol(p.name): sp.Float(p.value) for p in final.parameters}
        terms = zip(added.amplitudes, added.regressors, strict=True)
        total = sum((symbol(n) * f for n, f in terms), sp.S.Zero).xreplace(own)
        if added.place.factor is not None:
            total = total.xreplace(dict.fromkeys(map(symbol, added.columns), sp.S.One))
        if not added.linear or not total.free_symbols <= {TIME, *system.x, *system.u, *system.c}:
            return 0.0
        (values,) = np.abs(self.along([total]))
        return float(values[np.isfinite(values)].max(initial=0.0))

    def input_like(self, names: Sequence[str], likeness: float) -> str | None:
        """Return the input whose scale changes the motion as one factor of all parameters does."""
        rates = self.system.closed
        own = self.along([sum(symbol(n) * sp.diff(f, symbol(n)) for n in names) for f in rates])
        for item in self.system.inputs:
            u = symbol(item.name)
            other = self.along([u * sp.diff(f, u) for f in rates])
            sizes = np.sqrt(float(np.sum(own**2) * np.sum(other**2)))
            if -float(np.sum(own * other)) > likeness * sizes > 0.0:
                return item.name
        return None
