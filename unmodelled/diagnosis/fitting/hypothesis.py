"""A model that may explain the measurements: the known physics, and effects on top of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.fit import Fit, fit
from unmodelled.diagnosis.fitting.floor import start_noise
from unmodelled.diagnosis.fitting.residuals import Errors, spread
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.diagnosis.fitting.unknowns import Unknown, Unknowns
from unmodelled.effects.added import Added
from unmodelled.effects.columns import extended
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.systems.model import System

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """The known physics with effects.

    When exactly a logged input acts, within about half a sample, is never known: it is fitted with every
    hypothesis and no effect.

    Attributes:
        study: the experiments. system: the physics with the effects, at level zero.
        effects: in the order in which they were added.
    """

    study: Study
    system: System
    effects: tuple[Added, ...] = ()

    @classmethod
    def known(cls, study: Study) -> Hypothesis:
        """Nothing but the known physics."""
        return cls(study, study.system)

    def plus(self, effect: Effect, place: Place) -> Hypothesis:
        """With one effect more."""
        added = effect.add(self.system, place, self.study.scales)
        return Hypothesis(self.study, added.system, (*self.effects, added))

    def __str__(self) -> str:
        return " and ".join(
            ["the known physics", *(f"{e.family} at {e.place.channel}" for e in self.effects)]
        )

    @property
    def key(self) -> frozenset[tuple[str, str, Place]]:
        """Which effects where."""
        return frozenset((e.family, e.variant, e.place) for e in self.effects)

    @property
    def is_local(self) -> bool:
        """Whether the last effect acts at one level of a factor only."""
        return self.effects[-1].place.factor is not None

    @property
    def widened(self) -> frozenset[tuple[str, str, Place]]:
        """The key of the same with the last effect in all experiments."""
        *others, last = self.effects
        everywhere = replace(last.place, factor=None, level=None)
        return frozenset(
            [*((e.family, e.variant, e.place) for e in others), (last.family, last.variant, everywhere)]
        )

    @property
    def complexity(self) -> float:
        """How much it takes to believe in it: that of the effects together."""
        every = {(e.family, e.variant): e.complexity for e in effects()}
        return sum(self.complexity_of(every[e.family, e.variant], e.place) for e in self.effects)

    def complexity_of(self, law: float, place: Place) -> float:
        """Of an effect whose law has a complexity of its own, at a place."""
        known = {p.name for p in self.study.system.parameters if not p.identify}
        parameter = place.kind == "parameter" and place.name in known
        limits = self.study.thresholds
        local = limits.local_complexity * (place.factor is not None)
        return law + local + limits.known_parameter_complexity * parameter

    @cached_property
    def c(self) -> Array:
        """(experiments, constants) operating points, with what the effects need."""
        logs = self.study.logs
        for effect in self.effects:
            logs = extended(logs, effect.columns)
        return logs.c

    @cached_property
    def timing(self) -> Mapping[str, str]:
        """Name of a delay -> input, for the inputs without one."""
        late = {place.name for e in self.effects for place in e.delays.values() if place.kind == "actuator"}
        return {f"timing_{i.name}": i.name for i in self.system.inputs if i.name not in late}

    @property
    def delays(self) -> dict[str, str]:
        """Names of numbers -> names of the inputs or outputs that they delay."""
        found = {name: place.name for e in self.effects for name, place in e.delays.items()}
        return {**self.timing, **found}

    @property
    def full(self) -> System:
        """With the effects that are there or not all there."""
        return self.system.with_values({name: 1.0 for e in self.effects for name in e.shares})

    def simulation(self, recording: Recording) -> Simulation:
        """Over some windows."""
        return Simulation(self.full, recording, self.delays, self.c)

    @cached_property
    def unknowns(self) -> tuple[Unknown, ...]:
        """What is fitted: uncertain parameters, timing, and the numbers of the effects."""
        period = self.study.logs.period
        room = self.study.thresholds.input_timing * period
        physics = [Unknown.of(p) for p in self.study.system.parameters if p.identify]
        timing = [Unknown(name, -room, room, period) for name in self.timing]
        return (*physics, *timing, *(u for e in self.effects for u in self._of(e)))

    def _of(self, effect: Added) -> list[Unknown]:
        names = [n for n in (*effect.amplitudes, *effect.shapes) if n not in effect.shares]
        found = [
            Unknown(
                *(n, *effect.bounds[n], effect.scales[n]),
                own=n in effect.per_experiment,
                prior=effect.priors.get(n, np.inf),
            )
            for n in names
        ]
        known = {o.name: o.delay for o in self.study.system.outputs}
        late = {n: place.name for n, place in effect.delays.items() if place.kind == "sensor"}
        return [
            replace(u, high=min(u.high, self.study.latest - known[late[u.name]])) if u.name in late else u
            for u in found
        ]


@dataclass(frozen=True, eq=False)
class FittedHypothesis:
    """A hypothesis whose unknowns were fitted to a recording."""

    hypothesis: Hypothesis
    recording: Recording
    fit: Fit

    @classmethod
    def of(
        cls,
        hypothesis: Hypothesis,
        recording: Recording,
        starts: Sequence[Mapping[str, float]] = ({},),
        iterations: int = 30,
        substeps: int | None = None,
    ) -> FittedHypothesis:
        """Fit from the best of `starts`, see `fit`."""
        simulation = hypothesis.simulation(recording)
        found = fit(simulation, hypothesis.unknowns, starts, iterations, substeps)
        return cls(hypothesis, recording, found)

    @cached_property
    def unknowns(self) -> Unknowns:
        """Over the recording."""
        return Unknowns(self.hypothesis.simulation(self.recording), self.hypothesis.unknowns)

    def vector(self, unknowns: Unknowns) -> Array:
        """(entries,) the fitted values, in the vector of unknowns of the same hypothesis."""
        runs = sorted(unknowns.simulation.recording.runs)
        ids = [unknowns.simulation.recording.logs.ids[i] for i in runs]
        values = [
            value
            for u in unknowns.each
            for value in ([self.fit.own[u.name][i] for i in ids] if u.own else [self.fit.values[u.name]])
        ]
        return np.array(values) / unknowns.scale

    def moved(self, recording: Recording) -> tuple[Array, Array]:
        """By how much the starts of the windows of `recording`, which are among those of the fit, were moved,
        in their noise; and that noise: (windows, measured states) both."""
        order = np.argsort(self.recording.start)
        rows = order[np.searchsorted(self.recording.start[order], recording.start)]
        sigma = start_noise(self.hypothesis.simulation(recording), self.fit.numbers)
        return self.fit.start[rows] / sigma, sigma

    @cached_property
    def errors(self) -> tuple[Array, Array]:
        """Errors (windows, most steps, outputs) in units of the sensors' noise, and moved starts."""
        moved, sigma = self.moved(self.recording)
        errors = Errors(self.unknowns, sigma, self.fit.substeps)
        return errors(self.vector(self.unknowns)[None], moved[:, None])[:, 0], moved

    @cached_property
    def spread(self) -> Array:
        """(outputs,) of the errors, see `spread`."""
        return spread(self.errors[0], self.recording.counted)
