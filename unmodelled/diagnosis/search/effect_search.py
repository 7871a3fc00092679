"""The search for effects: candidates are grown effect by effect and judged by left-out experiments."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from unmodelled.base.workers import threads_of
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.descent import CONVERGED_SHARE
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.left_out import LeftOut
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.diagnosis.search.candidates import Candidates
from unmodelled.diagnosis.search.containing import containing
from unmodelled.diagnosis.search.discovered import discovered
from unmodelled.diagnosis.search.network import fit_network
from unmodelled.diagnosis.search.scouting import BEGUN, SIMPLEST, Growth, Scouting, broad, promising
from unmodelled.diagnosis.search.screen import Screened, screen
from unmodelled.diagnosis.search.shared import at_best_places, shared
from unmodelled.effects.added import DISCOVERED, Added
from unmodelled.effects.place import Place

Key = frozenset[object]

#: Simulated samples of a screen and of a fit, about: a budget of time. Of a machine with more outputs than
#: `FEW_OUTPUTS`, samples are fewer: each says more and takes longer. Every experiment has some windows.
SCREENED, FITTED, FEW_OUTPUTS, FEWEST_EACH = 4000, 20_000, 4, 2
#: Largest number of effects.
MOST_EFFECTS = 5
#: Number of effects up to which a further one is tried although fewer predict no better than none: of two
#: effects of the same size, neither need predict better alone.
FEWEST_TRIED = 1
#: Candidates that an effect is added to; candidates that are fitted fully then, and the first time.
PARENTS, FITTED_EACH, FITTED_FIRST = 2, 5, 12
#: Fits for each effect that is exchanged, and with numbers of single experiments.
EXCHANGED, FITTED_OWN = 2, 3
#: Share of the loss by which an iteration of a fit must lower it, of a machine with more outputs than
#: `FEW_OUTPUTS`: candidates differ by more.
NEAR_ENOUGH = 1e-3
#: A shape with so many starting values has many optima; the best one is searched among these multiples.
ROUGH, NEAR = 20, np.geomspace(0.85, 1.0 / 0.85, 9).tolist()


@dataclass
class EffectSearch:
    """A search for effects, with all fits so far.

    Attributes:
        study: inputs of the diagnosis.
        workers: number of threads, default 1.
        progress: function that is called with a line of text at each step.
        found: left-out predictions of fitted hypotheses by key, the known physics first.
        screens: screened candidates on top of a fitted hypothesis, by its key.
        grown: keys of the hypotheses that effects were added to.
        refused: family, variant and place of effects that are neither named nor added any more.
        written: whether formulas were fitted already.
    """

    study: Study
    workers: int = 1
    progress: Callable[[str], None] = lambda _: None
    found: dict[Key, LeftOut] = field(default_factory=dict)
    screens: dict[Key, list[Screened]] = field(default_factory=dict)
    grown: set[Key] = field(default_factory=set)
    refused: set[tuple[str, str, Place]] = field(default_factory=set)
    written: bool = False

    def __post_init__(self) -> None:
        self.progress("re-identify the known physics")
        recording = self.study.recording
        length = float(recording.steps.mean()) * max(1.0, len(self.study.system.outputs) / FEW_OUTPUTS)
        fewest = max(8, FEWEST_EACH * len(recording.runs))
        self.fitted = recording.thinned(max(fewest, round(FITTED / length)))
        self.screened = self.fitted.thinned(max(fewest, round(SCREENED / length)))
        known = Hypothesis.known(self.study)
        # the error of a long free run has many optima where the model swings, that of a short one has few
        start = FittedHypothesis.of(known, self.fitted.shortened(BEGUN)).fit.values
        self._keep(FittedHypothesis.of(known, self.fitted, [dict(start)]))

    @property
    def base(self) -> FittedHypothesis:
        """Return the known physics with its uncertain parameters fitted."""
        return self.found[frozenset()].fitted

    @property
    def candidates(self) -> Candidates:
        """Return all fits so far without refused effects, on one scale."""
        every = [p for key, p in self.found.items() if not key & self.refused]
        return Candidates(tuple(every), self.study.thresholds)

    @property
    def is_large(self) -> bool:
        """Return whether the machine has more outputs than `FEW_OUTPUTS`."""
        return len(self.study.system.outputs) > FEW_OUTPUTS

    def run(self) -> Candidates:
        """Add effects as long as they predict left-out experiments better, exchange and remove effects.

        Where effects were refused, the search goes on without them; that of a large machine, which takes
        minutes, only removes what does not pay without them.
        Numbers of single experiments come last: they absorb any structure. Effects are added to the best
        ones and exchanged once more: what differs between experiments and what they have in common hide each
        other.

        Returns:
            All fitted candidates.
        """
        if self.refused and self.is_large:
            self._remove()
            return self.candidates
        self._add()
        self._exchange()
        self._remove()
        self._own()
        if any(e.per_experiment for e in self._named().hypothesis.effects):
            self._exchange()
            self._remove()
        if self._discover():
            self._add()
            self._remove()
        return self.candidates

    def _add(self) -> None:
        """Add effects to the best candidates as long as more effects predict better."""
        steps = 0
        while steps < MOST_EFFECTS:
            candidates = self.candidates
            named = candidates.named()
            if steps > max(candidates.steps[named], FEWEST_TRIED):
                break
            rivals = [k for k in candidates.promising(steps) if k != named]
            for parent in (candidates.fits[k] for k in [named, *rivals][: PARENTS if steps else 1]):
                self._grow(parent)
            # effects are added to a law, too, that has taken the place of one that it contains
            now = self._named().hypothesis
            steps += 0 if now.key not in self.grown and len(now.together) == steps else 1

    def _named(self) -> FittedHypothesis:
        candidates = self.candidates
        return candidates.fits[candidates.named()]

    def screen(self, base: FittedHypothesis) -> list[Screened]:
        """Return all candidates with one effect more, the most promising first.

        Args:
            base: fitted hypothesis that the effect is added to.
        """
        key = base.hypothesis.key
        if key not in self.screens:
            self.progress(f"screen effects on top of {base.hypothesis}")
            self.screens[key] = screen(base, self.screened, self.workers)
        return [s for s in self.screens[key] if not s.key - key & self.refused]

    def _grow(self, parent: FittedHypothesis) -> None:
        if parent.hypothesis.key in self.grown:
            return
        self.grown.add(parent.hypothesis.key)
        first = not parent.hypothesis.effects
        every = [s for s in self.screen(parent) if not s.is_own]
        new = at_best_places([s for s in every if s.key not in self.found], MOST_EFFECTS)
        single = containing(new)
        chosen = broad(single) if first else promising(single)
        alike = [one for one in shared(every, SIMPLEST) if one.key not in self.found]
        most = FITTED_FIRST if first else FITTED_EACH
        self.progress(
            f"try {len(chosen) + len(alike)} effects on top of {parent.hypothesis}, and fit the best {most}"
        )
        self.fit(self._scouting.ranked(parent, [*chosen, *alike])[:most])
        self._widen()

    def _own(self) -> None:
        """Add numbers of single experiments to the named candidate and to the known physics.

        Effects and further numbers are added to candidates with such numbers as long as these are named: what
        differs between experiments and what they have in common hide each other.
        """
        if len(self.fitted.runs) < 2:
            return
        for parent in dict.fromkeys([self._named(), self.base]):
            self._differ(parent)
        while (varied := self._varied()) is not None and varied.hypothesis.key not in self.grown:
            self._grow(varied)
            self._differ(varied)
            self._remove()

    def _varied(self) -> FittedHypothesis | None:
        """The named candidate, or the best with numbers of single experiments.

        The latter must be better by much than laws that are as many: more laws may be named until laws are
        added to it, too.
        """
        candidates = self.candidates
        named, own, steps = candidates.named(), candidates.own > 0, candidates.steps
        best = int(np.argmin(np.where(own & candidates.sound, candidates.remaining, np.inf)))
        laws = np.where(own | (steps > steps[best]), np.inf, candidates.remaining)
        if not own[named] and own[best] and candidates.is_material(best, int(np.argmin(laws))):
            named = best
        room = own[named] and steps[named] < MOST_EFFECTS
        return candidates.fits[named] if room else None

    def _differ(self, parent: FittedHypothesis) -> None:
        """Fit the most promising numbers of single experiments on top of a fitted hypothesis."""
        own = [s for s in self.screen(parent) if s.is_own and s.key not in self.found]
        self.fit([(s, s.starts[0]) for s in own[:FITTED_OWN]])

    @cached_property
    def _scouting(self) -> Scouting:
        return Scouting(self.base, self.screened, self.workers)

    def fit(self, candidates: Iterable[tuple[Growth, Start]]) -> None:
        """Fit candidates; of two fits of one hypothesis, the better one is kept.

        Args:
            candidates: screened candidates with values to start from.
        """
        new = {c.key: (c, start) for c, start in candidates}
        with threads_of(self.workers) as pool:
            for fitted in pool.map(lambda one: self._fit(*one), new.values()):
                self._keep(fitted)

    def _fit(self, candidate: Growth, start: Start) -> FittedHypothesis:
        fitted = self._fitted(candidate.hypothesis, start)
        shapes = candidate.hypothesis.effects[-1].shapes
        rough = next((name for name, values in shapes.items() if len(values) >= ROUGH), None)
        if rough is None:
            return fitted
        found = fitted.fit
        return self._again(fitted, [{**found.every, rough: near * found.values[rough]} for near in NEAR])

    def _fitted(self, hypothesis: Hypothesis, start: Start) -> FittedHypothesis:
        """Fit a hypothesis, of a large machine only as far as candidates differ."""
        share = NEAR_ENOUGH if self.is_large else CONVERGED_SHARE
        substeps = self.base.fit.substeps
        return FittedHypothesis.of(hypothesis, self.fitted, [start], substeps=substeps, share=share)

    def _again(self, fitted: FittedHypothesis, starts: Sequence[Start]) -> FittedHypothesis:
        """Fit again from other starts; return the better fit."""
        tried = FittedHypothesis.of(fitted.hypothesis, self.fitted, starts, substeps=fitted.fit.substeps)
        return tried if tried.fit.left.value < fitted.fit.left.value else fitted

    def _keep(self, fitted: FittedHypothesis) -> None:
        key, known = fitted.hypothesis.key, self.found.get(fitted.hypothesis.key)
        if known is None or fitted.fit.left.value < known.fitted.fit.left.value:
            self.found[key] = LeftOut.of(fitted)

    def _widen(self) -> None:
        """Repeat the fit of an effect in all experiments from the result of its fit at one level.

        Where an effect explains more at one level than in all experiments, the latter fit may have found a
        local optimum.
        """
        fits = [prediction.fitted for prediction in self.found.values()]
        for local in [f for f in fits if f.hypothesis.effects and f.hypothesis.is_local]:
            wide = self.found.get(local.hypothesis.widened)
            if wide is not None and wide.score().mean() > self.found[local.hypothesis.key].score().mean():
                self._keep(self._again(wide.fitted, [local.fit.every]))

    def _exchange(self) -> None:
        """Exchange each effect of the named candidate: it may have stood in for a later effect.

        A law at many ports of one kind stands in for no single one.
        """
        named = self._named().hypothesis
        alone = [e for group in named.together if len(group) == 1 for e in group]
        effects = [e for e in named.removable if e in alone and not e.per_experiment]
        for gone in effects if len(named.together) > 1 else ():
            before = self.without(self.found[named.key].fitted, gone)
            found = [s for s in self.screen(before) if s.key not in self.found and not s.is_own]
            self.fit(self._scouting.ranked(before, promising(found))[:EXCHANGED])

    def _remove(self) -> None:
        """Fit the named candidate without each of its effects: each must pay."""
        while True:
            named = self._named()
            keys = set(self.found)
            removable = {e.key for e in named.hypothesis.removable}
            units = [u for u in named.hypothesis.units if removable.issuperset(e.key for e in u)]
            new = [unit[0] for unit in units if named.hypothesis.key - {unit[0].key} not in self.found]
            with threads_of(self.workers) as pool:
                for fitted in pool.map(lambda gone, named=named: self._fit_without(named, gone), new):
                    self._keep(fitted)
            for unit in units:
                self._without_all(named, unit)
            if keys == set(self.found):
                break

    def _without_all(self, fitted: FittedHypothesis, gone: Iterable[Added]) -> None:
        """Fit a hypothesis without some of its effects, one after the other."""
        for key in [e.key for e in gone]:
            fitted = self.without(fitted, next(e for e in fitted.hypothesis.effects if e.key == key))

    def beside_network(self, named: FittedHypothesis) -> tuple[FittedHypothesis, Candidates]:
        """Fit a network in every port of the known physics, and of a named hypothesis.

        Args:
            named: fitted hypothesis.

        Returns:
            The known physics with networks; the known physics, the named hypothesis, and this with networks,
            compared over the windows of a screen.
        """
        fits = {f.hypothesis.key: f for f in (self.base, named)}
        for f in fits.values():
            self.progress(f"fit a network in every port on top of {f.hypothesis}")
        few, seed = self.screened, self.study.seed
        with threads_of(self.workers) as pool:
            made = list(pool.map(lambda f: fit_network(f, few, seed), fits.values()))
        alike = [*(self._scouting.as_short(f) for f in (self.base, named)), LeftOut.of(made[-1])]
        return made[0], Candidates(tuple(alike), self.study.thresholds)

    def _discover(self) -> bool:
        """Fit formulas in the ports, alone, where the named candidate leaves more than a negligible error.

        Beside laws of the library they are not tried: every model of a real machine leaves errors that a
        formula chosen among many lowers.

        Returns:
            Whether a law of the library is named now that was not before.
        """
        candidates, before = self.candidates, self._named().hypothesis.key
        if self.written or candidates.leaves_little(candidates.named()):
            return False
        self.written = True
        self.progress("write down a law")
        with threads_of(self.workers) as pool:
            found = discovered(self.base, self.screened)
            for fitted in pool.map(lambda one: self._fitted(*one), found):
                self._keep(fitted)
        named = self._named().hypothesis
        return named.key != before and all(e.family != DISCOVERED for e in named.effects)

    def without(self, fitted: FittedHypothesis, gone: Added) -> FittedHypothesis:
        """Return the fit of a hypothesis without one of its effects.

        Args:
            fitted: fitted hypothesis.
            gone: effect to remove.
        """
        key = fitted.hypothesis.key - {gone.key}
        if key not in self.found:
            self._keep(self._fit_without(fitted, gone))
        return self.found[key].fitted

    def _fit_without(self, fitted: FittedHypothesis, gone: Added) -> FittedHypothesis:
        return self._fitted(fitted.hypothesis.without(gone), fitted.fit.values)
