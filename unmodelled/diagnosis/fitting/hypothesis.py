"""Hypotheses about the gap, the known physics with effects, and their fits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.descent import CONVERGED_SHARE
from unmodelled.diagnosis.fitting.fit import ParameterFit, fit_parameters
from unmodelled.diagnosis.fitting.floor import start_spread
from unmodelled.diagnosis.fitting.residuals import Errors
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.diagnosis.fitting.unknowns import Start, Unknown, Unknowns
from unmodelled.effects.added import Added
from unmodelled.effects.columns import extended
from unmodelled.effects.effect import Effect
from unmodelled.effects.place import Place
from unmodelled.systems.model import System

#: Time by which an input may act before or after its logged time without being called delayed, in sampling
#: periods: half a sample of zero-order hold, and a tenth for the fit.
INPUT_TIMING = 0.6
#: Distance from a bound up to which a fitted number is at it, as a share of the bound or of its plausible
#: size.
AT_BOUND_SHARE = 1e-3


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """The known physics with effects.

    When exactly a logged input acts, within about half a sample, is never known. This timing is fitted with
    every hypothesis and is not an effect.
    """

    study: Study
    system: System  # the physics with the effects, all at amplitude zero
    effects: tuple[Added, ...] = ()  # in the order in which they were added
    laws: tuple[Effect, ...] = ()  # the same as effects of the library, without networks
    _larger: dict[tuple[str, str, Place], Hypothesis] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def known(cls, study: Study) -> Hypothesis:
        """Return the known physics without effects."""
        return cls(study, study.system)

    def plus(self, effect: Effect, place: Place) -> Hypothesis:
        """Return the hypothesis with one effect more."""
        key = effect.family, effect.variant, place
        if key not in self._larger:
            hidden = self.chained and place.everywhere not in effect.places(self.system)
            self._larger[key] = self._beneath(effect, place) if hidden else self._above(effect, place)
        return self._larger[key]

    @property
    def chained(self) -> bool:
        """Return whether it has parts of a measurement chain."""
        return any(added.usual for added in self.effects)

    def places(self, effect: Effect) -> tuple[Place, ...]:
        """Return the places at which an effect can be added; a measurement chain hides none."""
        beneath = effect.places(self.study.system) if self.chained else ()
        return tuple(dict.fromkeys((*effect.places(self.system), *beneath)))

    def _above(self, effect: Effect, place: Place) -> Hypothesis:
        """The hypothesis with an effect on top of the others."""
        added = effect.add(self.system, place, self.study.scales)
        return Hypothesis(self.study, added.system, (*self.effects, added), (*self.laws, effect))

    def _beneath(self, effect: Effect, place: Place) -> Hypothesis:
        """The hypothesis with an effect between the known physics and the others.

        Behind the lag of a chain, an input no longer drives the speed that the limit of a drive depends on.
        """
        found = Hypothesis.known(self.study)._above(effect, place)
        for added, law in zip(self.effects, self.laws, strict=True):
            found = found.again(added, law)
        return found

    def again(self, added: Added, law: Effect, wider: float = 1.0) -> Hypothesis:
        """Return the hypothesis with an effect of another one on top, its priors wider by a factor.

        Its numbers may have other names, in the same order.
        """
        found = self._above(law, added.place)
        *others, last = found.effects
        now = dict(zip(added.units, last.units, strict=True))
        priors = {now[name]: wider * size for name, size in added.priors.items()}
        bounds = {now[name]: ends for name, ends in added.bounds.items()}
        last = replace(last, priors=priors, bounds=bounds, usual=added.usual)
        return replace(found, effects=(*others, last))

    @property
    def key(self) -> frozenset[tuple[str, str, Place]]:
        """Return family, variant and place of every effect."""
        return frozenset(e.key for e in self.effects)

    @cached_property
    def c(self) -> Array:
        """Return the operating points, shape (experiments, constants), with those that the effects need."""
        logs = self.study.logs
        for effect in self.effects:
            logs = extended(logs, effect.columns)
        return logs.c

    @cached_property
    def timing(self) -> Mapping[str, str]:
        """Return the inputs whose timing is fitted, by name of the timing."""
        late = {place.name for e in self.effects for place in e.delays.values() if place.kind == "actuator"}
        return {f"timing_{i.name}": i.name for i in self.system.inputs if i.name not in late}

    @property
    def delays(self) -> dict[str, str]:
        """Return the delayed inputs and outputs, by name of the delay."""
        found = {name: place.name for e in self.effects for name, place in e.delays.items()}
        return {**self.timing, **found}

    @property
    def full(self) -> System:
        """Return the system with effects that have no amplitude switched on."""
        return self.system.with_values({name: 1.0 for e in self.effects for name in e.shares})

    def simulation(self, recording: Recording) -> Simulation:
        """Return the simulation of the hypothesis."""
        return self._simulation.over(recording)

    @cached_property
    def _simulation(self) -> Simulation:
        return Simulation(self.full, self.study.recording, self.delays, self.c)

    @cached_property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Return the numbers to fit: uncertain parameters, timing, and numbers of the effects."""
        share = INPUT_TIMING
        physics = [Unknown.of(p) for p in self.study.system.parameters if p.identify]
        periods = {name: self.study.input_periods[item] for name, item in self.timing.items()}
        timing = [Unknown(name, -share * p, share * p, p) for name, p in periods.items()]
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
    recording: Recording  # windows that the unknowns were fitted to
    fit: ParameterFit

    @classmethod
    def of(
        cls,
        hypothesis: Hypothesis,
        recording: Recording,
        starts: Sequence[Start] = ({},),
        iterations: int = 30,
        substeps: int | None = None,
        share: float = CONVERGED_SHARE,
    ) -> FittedHypothesis:
        """Fit a hypothesis to a recording, see `fit_parameters`."""
        simulation = hypothesis.simulation(recording)
        found = fit_parameters(simulation, hypothesis.unknowns, starts, iterations, substeps, share)
        return cls(hypothesis, recording, found)

    def at_bound(self, name: str) -> bool:
        """Return whether a fitted number ended at one of its bounds."""
        unknown = {u.name: u for u in self.hypothesis.unknowns}.get(name)
        if unknown is None or unknown.own:
            return False
        share = AT_BOUND_SHARE
        return unknown.bound(self.fit.values[name], share) is not None

    @cached_property
    def unknowns(self) -> Unknowns:
        """Return the unknowns over the recording."""
        return Unknowns(self.hypothesis.simulation(self.recording), self.hypothesis.unknowns)

    def vector(self, unknowns: Unknowns) -> Array:
        """Return the fitted values as a vector (entries,)."""
        return unknowns.vector(self.fit.every)

    def moved(self, recording: Recording) -> tuple[Array, Array]:
        """Return corrections of the initial states and their noise, each (windows, free states)."""
        order = np.argsort(self.recording.start)
        rows = order[np.searchsorted(self.recording.start[order], recording.start)]
        sigma = start_spread(self.hypothesis.simulation(recording), self.fit.numbers, self.fit.substeps)
        return np.divide(self.fit.start[rows], sigma, out=np.zeros_like(sigma), where=sigma > 0.0), sigma

    @cached_property
    def errors(self) -> tuple[Array, Array]:
        """Return errors in units of the sensor noise, shape (windows, most steps, outputs), and starts."""
        moved, sigma = self.moved(self.recording)
        errors = Errors(self.unknowns, sigma, self.fit.substeps)
        return errors(self.vector(self.unknowns)[None], moved[:, None])[:, 0], moved
