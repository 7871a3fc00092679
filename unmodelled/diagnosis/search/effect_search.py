"""The search for effects: what linear systems around fitted models rank is fitted and judged."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TypeVar

import numpy as np

from unmodelled.base.workers import threads_of
from unmodelled.diagnosis.core.choose import Chooser
from unmodelled.diagnosis.core.columns import ROUGH, Atom, Columns
from unmodelled.diagnosis.core.equations import Equations
from unmodelled.diagnosis.core.path import Path
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.descent import CONVERGED_SHARE
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.left_out import LeftOut
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.diagnosis.search.candidates import Candidates
from unmodelled.diagnosis.search.discovered import discovered
from unmodelled.diagnosis.search.network import fit_network
from unmodelled.diagnosis.search.proposal import BEGUN, Proposal, ShortFits
from unmodelled.effects.added import DISCOVERED, Added
from unmodelled.effects.place import Place

T = TypeVar("T")
Key = frozenset[tuple[str, str, Place]]

#: Simulated samples of a linear system, of a fit, and of a short fit, about: a budget of time. Of a machine
#: with more outputs than `FEW_OUTPUTS`, samples are fewer: each says more and takes longer. Every experiment
#: has some windows.
LINEAR, FITTED, SHORT, FEW_OUTPUTS, FEWEST_EACH = 15_000, 20_000, 4000, 4, 2
#: Largest number of effects.
MOST_EFFECTS = 5
#: Single laws, and classes of sets, that are fitted over few windows, around the known physics and around
#: others; of these, how many are fitted to all, and how many single laws at least; sets of differences
#: between experiments.
SINGLES, CLASSES, BEST, ALONE, DIFFERENT = (12, 6), (12, 6), (8, 4), (4, 2), 3
#: Best single laws of which every variant is fitted over few windows; of the others, the plainest one.
VARIED = 3
#: Single laws around which the system is linearised again, beside what is named; sets of a class that are
#: kept until one of them is named, and of those how many that differ in one law are fitted.
RIVALS, KEPT_TWINS, TWINS = 2, 12, 4
#: Share of the loss by which an iteration of a fit must lower it: candidates differ by more.
NEAR_ENOUGH = 1e-3
#: Multiples of a shape with many optima, see `ROUGH`, at which fits begin, too.
NEAR = np.delete(np.geomspace(0.85, 1.0 / 0.85, 9), 4).tolist()


@dataclass
class EffectSearch:
    """A search for effects, with all fits so far."""

    study: Study
    workers: int = 1  # threads
    progress: Callable[[str], None] = lambda _: None  # called with a line of text at each step
    found: dict[Key, LeftOut] = field(default_factory=dict)  # left-out predictions, the known physics first
    #: Differences between experiments, by the hypothesis around which a system was solved.
    around: dict[Key, list[Atom]] = field(default_factory=dict)
    complete: set[Key] = field(default_factory=set)  # fitted without each of their effects
    converged: set[Key] = field(default_factory=set)  # fitted until their loss fell no more
    classes: list[list[Proposal]] = field(default_factory=list)  # predict the same in a linear system
    #: Probability that a law of the first system removes as much error if nothing is missing.
    chance: float = 1.0
    written: bool = False  # whether formulas were fitted already

    def __post_init__(self) -> None:
        self.progress("re-identify the known physics")
        self.fitted = self.study.recording.thinned(self._count(FITTED))
        known = Hypothesis.known(self.study)
        # the error of a long free run has many optima where the model swings, that of a short one has few
        start = FittedHypothesis.of(known, self.fitted.shortened(BEGUN)).fit.values
        self._keep(FittedHypothesis.of(known, self.fitted, [dict(start)]))

    @cached_property
    def few(self) -> Recording:
        """Return the windows of short fits."""
        return self.fitted.thinned(self._count(SHORT))

    def _count(self, samples: int) -> int:
        """Number of windows of so many samples."""
        recording = self.study.recording
        length = float(recording.steps.mean()) * max(1.0, len(self.study.system.outputs) / FEW_OUTPUTS)
        return max(8, FEWEST_EACH * len(recording.runs), round(samples / length))

    @cached_property
    def _short(self) -> ShortFits:
        return ShortFits(self.base, self.few)

    @property
    def base(self) -> FittedHypothesis:
        """Return the known physics with its uncertain parameters fitted."""
        return self.found[frozenset()].fitted

    @property
    def candidates(self) -> Candidates:
        """Return all fits so far, on one scale."""
        return Candidates(tuple(self.found.values()), self.study.thresholds)

    def run(self) -> Candidates:
        """Fit what the linear systems rank, around the known physics and around the best fits.

        The system is linearised again around what is named: what the first effect hid shows beside it.
        Numbers of single experiments absorb any structure and come last; laws are added to them once more.
        """
        self._grow_laws()
        while self._vary():
            self._grow_laws()
        if self._discover():
            self._remove()
        self._fit_twins()
        self._converge()
        return self.candidates

    def _grow_laws(self) -> None:
        """Solve systems and fit as long as that names something new."""
        for _ in range(MOST_EFFECTS):
            before = self._named().hypothesis.key
            parents = self._new(self._parents()) or self._new(self._fewer())
            for parent in parents:
                self._solve(parent)
            if not parents:
                self._thin_out()
            self._remove()
            if not parents and self._named().hypothesis.key == before:
                break

    def _parents(self) -> list[FittedHypothesis]:
        """Fits around which the system is linearised: the known physics, then what is named, and single laws.

        A set of laws may stand in for another set that begins with the best single law.
        """
        if not self.around:
            return [self.base]
        candidates = self.candidates
        named = candidates.named()
        one = candidates.promising(1)
        one = [k for k in one if not any(candidates.beats(j, k) for j in one)]
        chosen = dict.fromkeys([named, *(one[:RIVALS] if len(self.around) == 1 else ())])
        return [candidates.fits[k] for k in chosen if candidates.steps[k] < MOST_EFFECTS]

    def _fewer(self) -> list[FittedHypothesis]:
        """Each of two named effects alone: the other one may have stood in for a later one."""
        named = self._named()
        alone = {group[0].key for group in named.hypothesis.together if len(group) == 1}
        gone = [e for e in named.hypothesis.removable if e.key in alone and not e.per_experiment]
        return [self.without(named, e) for e in gone] if len(named.hypothesis.together) == 2 else []

    def _new(self, parents: Sequence[FittedHypothesis]) -> list[FittedHypothesis]:
        return [p for p in parents if p.hypothesis.key not in self.around]

    def _solve(self, parent: FittedHypothesis) -> None:
        """Solve the linear system around a fit, and fit the best sets of laws."""
        self.progress(f"solve the linear system around {parent.hypothesis}")
        chooser = self._chooser(parent)
        if not self.around:
            self.chance = chooser.chance
        self.around[parent.hypothesis.key] = chooser.differences() if len(self.fitted.runs) > 1 else []
        first, groups = int(bool(parent.hypothesis.effects)), [g for g in chooser.classes() if g[0].atoms]
        alike = (group[: 1 + KEPT_TWINS] for group in groups)
        self.classes += [[Proposal.of(parent, chooser, one) for one in group] for group in alike]
        heads = [group[0] for group in groups]
        best = chooser.singles[: SINGLES[first]]
        # variants differ by little in the linear system, and beside another effect the plainest may be enough
        few = [v for k, one in enumerate(best) for v in chooser.variants(one)[: None if k < VARIED else 1]]
        far = [] if first else [one for one in chooser.singles if chooser.may_be_far(one)]
        sets = [*best, *few, *far, *heads[: CLASSES[first]]]
        self._fit_best([Proposal.of(parent, chooser, one) for one in sets], BEST[first], ALONE[first])

    def _fit_twins(self) -> None:
        """Fit sets that predict what the named one does, with another law in place of one of its laws."""
        named = {(family, place) for family, _, place in self._named().hypothesis.key}
        found: list[Proposal] = []
        for group in self.classes:
            laws = [{(family, place) for family, _, place in one.key} for one in group]
            if named in laws:
                swapped = (len(own) == len(named) and len(own - named) == 1 for own in laws)
                found += [one for one, is_twin in zip(group, swapped, strict=True) if is_twin]
        self._fit_best(found, TWINS, 0)
        self._remove()

    def _vary(self) -> bool:
        """Fit a difference between experiments beside what is named and alone; whether laws may be named now.

        Laws are added to the best difference, too, if it removes more than laws do that are as many: what
        differs between experiments and what they have in common hide each other.
        """
        named, before = self._named(), self._named().hypothesis.key
        if len(named.hypothesis.together) >= MOST_EFFECTS:
            return False
        for parent in {p.hypothesis.key: p for p in (named, self.base)}.values():
            own = self.around.get(parent.hypothesis.key, [])[:DIFFERENT]
            new = [Proposal(parent, (atom,), (np.zeros(1),)) for atom in own]
            self._fit_best(new, DIFFERENT, 0)
        self._remove()
        candidates = self.candidates
        best = int(np.argmin(np.where((candidates.own > 0) & candidates.sound, candidates.remaining, np.inf)))
        laws = (candidates.own == 0) & (candidates.steps <= candidates.steps[best])
        law = int(np.argmin(np.where(laws, candidates.remaining, np.inf)))
        varied = candidates.fits[best]
        if candidates.own[best] and candidates.is_material(best, law) and self._new([varied]):
            self._solve(varied)
            self._remove()
            return True
        return self._named().hypothesis.key != before

    def _fit_best(self, proposals: Sequence[Proposal], most: int, alone: int) -> None:
        """Fit proposals over few windows; to all those that none of lower cost beats, and some single laws.

        A set of many laws may beat every single one over few windows; that one is enough shows in full.
        """
        free = [p for p in proposals if p.key not in self.found]
        own = {(p.key, p.rough): p for p in free}
        new = [p for p in own.values() if p.is_possible]
        self.progress(f"fit {len(new)} sets of effects over few windows, and the best to all")
        with threads_of(self.workers) as pool:
            scouts = list(pool.map(self._short.of, new))
        scouted = Candidates((self._short.again(self.base), *scouts), self.study.thresholds)
        order = sorted(range(1, 1 + len(new)), key=lambda k: float(scouted.costs[k]))
        kept = [k for n, k in enumerate(order) if not any(scouted.beats(j, k) for j in order[:n])]
        single = [k for k in order if new[k - 1].is_single]
        best = dict.fromkeys([*kept[:most], *single[:alone]])
        self._keep_each(self._fit, [scouts[k - 1].fitted for k in best])

    def _chooser(self, parent: FittedHypothesis) -> Chooser:
        path = Path.of(parent, self.study.recording, self._count(LINEAR))
        return Chooser(Equations.of(Columns(path)), path.gap)

    def _named(self) -> FittedHypothesis:
        candidates = self.candidates
        return candidates.fits[candidates.named()]

    def _fit(self, short: FittedHypothesis) -> FittedHypothesis:
        """Fit a hypothesis to all windows from a short fit; a shape with many optima begins near it, too."""
        hypothesis, found = short.hypothesis, short.fit
        shapes = hypothesis.effects[-1].shapes
        rough = next((name for name, values in shapes.items() if len(values) >= ROUGH), None)
        near = [{**found.every, rough: k * found.values[rough]} for k in NEAR] if rough else []
        return self._fitted(hypothesis, [found.every, *near])

    def _fitted(
        self,
        hypothesis: Hypothesis,
        starts: Sequence[Start],
        share: float = NEAR_ENOUGH,
        substeps: int | None = None,
    ) -> FittedHypothesis:
        steps = substeps or self.base.fit.substeps
        return FittedHypothesis.of(hypothesis, self.fitted, starts, substeps=steps, share=share)

    def _converge(self) -> None:
        """Fit the named candidate, and those with an effect less, until their loss falls no more.

        The steps of the integration that are enough beside the error of the known physics may be too coarse
        for a model that fits: with finer ones, its rivals are fitted again, too.
        """
        while (named := self._named()).hypothesis.key not in self.converged:
            self.converged.add(named.hypothesis.key)
            every = [named, *(self.without(named, effect) for effect in named.hypothesis.removable)]
            steps = max(named.steps_needed, named.fit.substeps)
            if steps > named.fit.substeps:
                candidates = self.candidates
                rivals = candidates.as_good(candidates.fits.index(named))
                every += [candidates.fits[k] for k in rivals if candidates.fits[k] not in every]
            self._keep_each(partial(self._fitted_on, steps), every)
            self._remove()

    def _fitted_on(self, substeps: int, fitted: FittedHypothesis) -> FittedHypothesis:
        return self._fitted(fitted.hypothesis, [fitted.fit.every], CONVERGED_SHARE, substeps)

    def _keep_each(self, fit: Callable[[T], FittedHypothesis], each: Iterable[T]) -> None:
        """Fit side by side, and keep what is better than before."""
        with threads_of(self.workers) as pool:
            for fitted in pool.map(fit, each):
                self._keep(fitted)

    def _keep(self, fitted: FittedHypothesis) -> None:
        key, known = fitted.hypothesis.key, self.found.get(fitted.hypothesis.key)
        if known is None or fitted.fit.left.value < known.fitted.fit.left.value:
            self.found[key] = LeftOut.of(fitted)

    def _remove(self) -> None:
        """Fit the named candidate without each of its effects: each must pay."""
        while (named := self._named()).hypothesis.key not in self.complete:
            self._without_each(named)

    def _thin_out(self) -> None:
        """Fit the best set of every size without each of its effects: a part of it may be enough."""
        for size in range(MOST_EFFECTS, 1, -1):
            candidates = self.candidates
            for k in candidates.promising(size)[:1]:
                self._without_each(candidates.fits[k])

    def _without_each(self, fitted: FittedHypothesis) -> None:
        self.complete.add(fitted.hypothesis.key)
        removable = {e.key for e in fitted.hypothesis.removable}
        units = [u for u in fitted.hypothesis.units if removable.issuperset(e.key for e in u)]
        new = [unit[0] for unit in units if fitted.hypothesis.key - {unit[0].key} not in self.found]
        self._keep_each(lambda gone: self._fit_without(fitted, gone), new)
        for unit in units:
            fewer = fitted
            for key in [e.key for e in unit]:  # the effect as the smaller hypothesis has it
                fewer = self.without(fewer, next(e for e in fewer.hypothesis.effects if e.key == key))

    def without(self, fitted: FittedHypothesis, gone: Added) -> FittedHypothesis:
        """Return the fit of a hypothesis without one of its effects."""
        key = fitted.hypothesis.key - {gone.key}
        if key not in self.found:
            self._keep(self._fit_without(fitted, gone))
        return self.found[key].fitted

    def _fit_without(self, fitted: FittedHypothesis, gone: Added) -> FittedHypothesis:
        return self._fitted(fitted.hypothesis.without(gone), [fitted.fit.values])

    def _discover(self) -> bool:
        """Fit formulas in the ports, alone, where the named candidate leaves more than a negligible error.

        Beside laws of the library they are not tried: every model of a real machine leaves errors that a
        formula chosen among many lowers.
        """
        candidates, before = self.candidates, self._named().hypothesis.key
        if self.written or candidates.leaves_little(candidates.named()):
            return False
        self.written = True
        self.progress("write down a law")
        self._keep_each(lambda one: self._fitted(one[0], [one[1]]), discovered(self.base, self.few))
        named = self._named().hypothesis
        return named.key != before and all(e.family != DISCOVERED for e in named.effects)

    def beside_network(self, named: FittedHypothesis) -> tuple[FittedHypothesis, Candidates]:
        """Fit a network in every port of the known physics, and of a named hypothesis."""
        fits = {f.hypothesis.key: f for f in (self.base, named)}
        for f in fits.values():
            self.progress(f"fit a network in every port on top of {f.hypothesis}")
        few, seed = self.few, self.study.seed
        with threads_of(self.workers) as pool:
            made = list(pool.map(lambda f: fit_network(f, few, seed), fits.values()))
        alike = [*(self._short.again(f) for f in (self.base, named)), LeftOut.of(made[-1])]
        return made[0], Candidates(tuple(alike), self.study.thresholds)
