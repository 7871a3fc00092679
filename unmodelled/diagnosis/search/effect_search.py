"""The search for effects: fits of the candidates that a screen finds promising, up to three effects."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from unmodelled.base.workers import threads_of
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.search.candidates import Candidates
from unmodelled.diagnosis.search.screen import Screened, screen
from unmodelled.effects.added import Added

#: Simulated samples of a screen and of a fit, about: a budget of time.
SCREENED, FITTED = 6000, 20_000
#: At each depth: candidates that an effect is added to, and fits on top of each: a budget.
DEPTHS = (1, 14), (2, 5), (1, 5)
#: Rounds in which effects of the leading candidate are exchanged, and fits for each effect: a budget.
EXCHANGES, EXCHANGED = 2, 4
#: A shape with so many starting values has many optima; the best one is searched among these multiples.
ROUGH, NEAR = 20, np.geomspace(0.85, 1.0 / 0.85, 9).tolist()


@dataclass
class EffectSearch:
    """A search for effects, with all fits so far.

    Attributes:
        study: inputs of the diagnosis.
        workers: number of threads, default 1.
        progress: function that is called with a line of text at each step.
        fits: fitted hypotheses by key, the known physics first.
        screens: screened candidates on top of a fitted hypothesis, by its key.
        widened: keys of effects at one level that were also fitted in all experiments.
    """

    study: Study
    workers: int = 1
    progress: Callable[[str], None] = lambda _: None
    fits: dict[frozenset[object], FittedHypothesis] = field(default_factory=dict)
    screens: dict[frozenset[object], list[Screened]] = field(default_factory=dict)
    widened: set[frozenset[object]] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.progress("re-identify the known physics")
        recording = self.study.recording
        length = float(recording.steps.mean())
        self.fitted = recording.thinned(max(8, round(FITTED / length)))
        self.screened = self.fitted.thinned(max(8, round(SCREENED / length)))
        base = FittedHypothesis.of(Hypothesis.known(self.study), self.fitted)
        self.fits[base.hypothesis.key] = base

    @property
    def base(self) -> FittedHypothesis:
        """Return the known physics with its uncertain parameters fitted."""
        return self.fits[frozenset()]

    @property
    def candidates(self) -> Candidates:
        """Return all fits so far, on one scale."""
        return Candidates(tuple(self.fits.values()), self.study.thresholds)

    def run(self) -> Candidates:
        """Add effects as long as they pay and more than noise remains.

        Returns:
            All fitted candidates.
        """
        for depth, (parents, count) in enumerate(DEPTHS):
            candidates = self.candidates
            named = candidates.fits[candidates.leading()]
            if len(named.hypothesis.effects) < depth or (depth and self._settled(named)):
                break
            for parent in (candidates.fits[k] for k in candidates.ranked(depth)[:parents]):
                found = self.screen(parent)
                self.progress(f"fit effects on top of {parent.hypothesis}")
                self.fit(_promising(found, count))
                self._widen()
        return self._exchanged()

    def screen(self, base: FittedHypothesis) -> list[Screened]:
        """Return all candidates with one effect more, the most promising first.

        Args:
            base: fitted hypothesis that the effect is added to.
        """
        key = base.hypothesis.key
        if key not in self.screens:
            self.progress(f"screen effects on top of {base.hypothesis}")
            self.screens[key] = screen(base, self.screened, self.workers)
        return self.screens[key]

    def _settled(self, named: FittedHypothesis) -> bool:
        """Whether only noise remains, and no much simpler candidate is to be expected."""
        simple = named.hypothesis.complexity <= self.study.thresholds.simple_complexity
        return simple and self.candidates.at_floor(named)

    def _exchanged(self) -> Candidates:
        """Exchange each effect of the leading candidate: it may have stood in for a later effect."""
        for _ in range(EXCHANGES):
            candidates = self.candidates
            effects = candidates.fits[candidates.leading()].hypothesis.effects
            for gone in effects if len(effects) > 1 else ():
                before = self.base.hypothesis
                for effect in (e for e in effects if e is not gone):
                    before = self.fitted_with(before, effect).hypothesis
                self.fit(_promising(self.screen(self.fits[before.key]), EXCHANGED))
        return self.candidates

    def fit(self, candidates: Iterable[Screened]) -> None:
        """Fit candidates that were not fitted yet.

        Args:
            candidates: screened candidates.
        """
        new = {c.key: c for c in candidates if c.key not in self.fits}
        with threads_of(self.workers) as pool:
            for fitted in pool.map(self._fit, new.values()):
                self.fits[fitted.hypothesis.key] = fitted

    def _widen(self) -> None:
        """Repeat the fit of an effect in all experiments from the result of its fit at one level.

        Where an effect explains more at one level than in all experiments, the latter fit may have found a
        local optimum.
        """
        for local in [f for f in self.fits.values() if f.hypothesis.effects and f.hypothesis.is_local]:
            wide = self.fits.get(local.hypothesis.widened)
            if wide is None or local.hypothesis.key in self.widened:
                continue
            self.widened.add(local.hypothesis.key)
            self.fits[wide.hypothesis.key] = self._again(wide, [local.fit.values])

    def _fit(self, candidate: Screened) -> FittedHypothesis:
        fitted = FittedHypothesis.of(candidate.hypothesis, self.fitted, candidate.starts)
        shapes = candidate.hypothesis.effects[-1].shapes
        rough = next((name for name, values in shapes.items() if len(values) >= ROUGH), None)
        if rough is None:
            return fitted
        values = fitted.fit.values
        return self._again(fitted, [{**values, rough: near * values[rough]} for near in NEAR])

    def _again(self, fitted: FittedHypothesis, starts: Sequence[Mapping[str, float]]) -> FittedHypothesis:
        """Fit again from other starts; return the better fit."""
        tries = Candidates((fitted, FittedHypothesis.of(fitted.hypothesis, self.fitted, starts)))
        return tries.fits[int(np.argmin(tries.losses.sum(1)))]

    def fitted_with(self, before: Hypothesis, added: Added) -> FittedHypothesis:
        """Return the fit of a hypothesis with an effect of another hypothesis.

        Args:
            before: hypothesis that was fitted.
            added: effect of another hypothesis.
        """
        key = before.key | {(added.family, added.variant, added.place)}
        if key not in self.fits:
            found = self.screen(self.fits[before.key])
            self.fit(s for s in found if s.key == key)
        return self.fits[key]


def _promising(found: Sequence[Screened], count: int) -> list[Screened]:
    """The first candidates; an effect at one level is compared with the same effect in all experiments."""
    first = [s for s in found if s.gain > 0.0][:count]
    local = {_everywhere(s) for s in first if s.place.factor is not None}
    more = [s for s in found[count:] if s.place.factor is None and _everywhere(s) in local]
    return [*first, *more]


def _everywhere(screened: Screened) -> tuple[str, str, str]:
    return screened.effect.family, screened.effect.variant, screened.place.channel
