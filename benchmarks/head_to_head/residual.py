"""What the known physics does not explain of the measured rates, for methods that regress it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import sympy as sp

from benchmarks.head_to_head.method import Model, gap_of, uncertain
from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.result import JudgedModel
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.judged_models import judged_model, known_model
from unmodelled.logs.differentiate import smooth_derivative
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import Port, symbol
from unmodelled.systems.numeric import numpy_system_function


@dataclass(frozen=True, eq=False)
class Residual:
    """Rates that efforts at ports drive: measured, known, and by how much an effort changes them."""

    study: Study
    base: JudgedModel  # known physics with the numbers of the file, or re-identified

    @classmethod
    def each(cls, study: Study) -> Iterator[Residual]:
        """Yield the residual of the physics as given, and of the physics with re-identified parameters."""
        yield cls(study, known_model(study))
        fitted = FittedHypothesis.of(Hypothesis.known(study), study.recording)
        yield cls(study, judged_model("re-identified", fitted))

    @cached_property
    def logs(self):  # type: ignore[no-untyped-def]
        """Return the logs with the states of the base."""
        return prepare(self.base.system, self.base.logs)

    @cached_property
    def rates(self) -> tuple[int, ...]:
        """Return the numbers of the measured states whose rates depend on an effort."""
        system, measured = self.base.system, self.logs.measured
        driven = [bool(rate.free_symbols & {*system.e}) for rate in system.dynamics]
        return tuple(k for k in range(len(driven)) if driven[k] and measured[k])

    @cached_property
    def ports(self) -> tuple[Port, ...]:
        """Return the ports whose efforts act on a measured rate."""
        system = self.base.system
        driven = {s for k in self.rates for s in system.dynamics[k].free_symbols}
        return tuple(p for p in system.ports if symbol(p.effort) in driven)

    def values(self, expressions: list[sp.Expr]) -> Array:
        """Return k expressions of the system along all samples (samples, k); zero where undefined."""
        system, logs = self.base.system, self.logs
        function = numpy_system_function(system, expressions, efforts_zero=True)
        found = function(logs.t, logs.x, logs.u, np.empty(0), np.array(system.values), logs.c[logs.owner])
        return np.nan_to_num(found, posinf=0.0, neginf=0.0)

    @cached_property
    def known(self) -> Array:
        """Return the rates of the known physics, shape (samples, rates)."""
        return self.values([self.base.system.closed[k] for k in self.rates])

    @cached_property
    def influence(self) -> Array:
        """Return by how much the effort of a port changes a rate, shape (samples, rates, ports)."""
        system = self.base.system
        slopes = [sp.diff(system.dynamics[k], symbol(p.effort)) for k in self.rates for p in self.ports]
        return self.values(slopes).reshape(-1, len(self.rates), len(self.ports))

    @cached_property
    def measured(self) -> Array:
        """Return the rates by smoothing differentiation of the states, shape (samples, rates)."""
        logs = self.logs
        rates = [smooth_derivative(logs.x[:, k], logs.offsets, logs.period)[1] for k in self.rates]
        return np.stack(rates, axis=1)

    def coordinates(self, port: Port) -> dict[str, sp.Expr]:
        """Return position and velocity of a port, inputs and constants, by a short name."""
        system = self.base.system
        found = {}
        if port.position is not None:
            found["q"] = system.expression(port.position)
        if port.velocity is not None:
            found["v"] = system.expression(port.velocity)
        others = [str(s) for s in (*system.u, *system.c)]
        return {**found, **{f"in_{name}": symbol(name) for name in others}}

    def model(self, laws: Mapping[str, sp.Expr], budget: str) -> Model:
        """Return the base with laws, additional efforts by port; `budget` is the size of the search."""
        system = self.base.system
        ports = tuple(
            replace(p, law=laws[p.name] + (0 if p.law is None else p.law)) if laws.get(p.name, 0) != 0 else p
            for p in system.ports
        )
        found = replace(system, ports=ports)
        kept = {name: law for name, law in laws.items() if law != 0}
        said = "; ".join(f"{_short(law)} at {name}" for name, law in kept.items())
        says = f"law: {said}" if said else "no law"
        return Model(found, self.base.logs, says, uncertain(found), budget=budget, laws=kept)


def best_law(study: Study, regressed: Callable[[Residual, Study], list[Model]]) -> Model:
    """Return the model with the smallest gap on the training experiments, of regressed ones and no law."""
    found = []
    for residual in Residual.each(study):
        found.append(residual.model({}, "no law lowers the gap of the training experiments"))
        found += regressed(residual, study) if residual.rates else []
    return min(found, key=lambda model: gap_of(model, study, learned=True))


def _short(law: sp.Expr) -> str:
    return str(law.xreplace({number: sp.Float(number, 3) for number in law.atoms(sp.Float)}))
