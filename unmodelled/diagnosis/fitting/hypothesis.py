"""A model that may explain the measurements: the known physics, and effects on top of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.diagnosis.fitting.unknowns import Unknown
from unmodelled.effects.added import Added
from unmodelled.effects.columns import extended
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.systems.model import System

Array = NDArray[np.float64]

#: A logger reads an input up to half a sample before or after it acts; delays, in samples.
TIMING = 0.6
#: Further complexity of an effect at one level of a factor only, and of one of a parameter that was known.
LOCAL, KNOWN = 1.5, 1.0


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
        return law + LOCAL * (place.factor is not None) + KNOWN * parameter

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
        physics = [Unknown.of(p) for p in self.study.system.parameters if p.identify]
        timing = [Unknown(name, -TIMING * period, TIMING * period, period) for name in self.timing]
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
