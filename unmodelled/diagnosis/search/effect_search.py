"""Fits of the candidates that a screen found promising: singles, pairs, triples."""

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

#: Simulated samples that a screen and a fit look at, about.
SCREENED, FITTED = 6000, 20_000
#: At each depth: how many models an effect is added to, and how many candidates are fitted on top of each.
DEPTHS = (1, 14), (2, 5), (1, 5)
#: How often effects of the named model are exchanged, and for how many candidates each.
EXCHANGES, EXCHANGED = 2, 4
#: A shape with so many starting values has many optima; the best one is sought among neighbours.
ROUGH, NEAR = 20, np.geomspace(0.85, 1.0 / 0.85, 9).tolist()


@dataclass
class EffectSearch:
    """Models that were fitted so far, the known physics first.

    Attributes:
        study: the experiments. workers: threads. progress: is told what is being done.
        fits: by what their effects are. screens: of candidates on top of a model, by the same.
        widened: those at one level that were tried everywhere.
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
        """The known physics, re-identified."""
        return self.fits[frozenset()]

    @property
    def candidates(self) -> Candidates:
        """Return what was fitted so far, on one scale."""
        return Candidates(tuple(self.fits.values()), self.study.thresholds)

    def run(self) -> Candidates:
        """Add effects as long as it pays and something is left to explain."""
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
        """All candidates on top of a fitted model, the most promising first."""
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
        """With each effect of the named model taken out, and others in its place: what was added first may
        have stood in for what came later.
        """
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
        """Fit what was not fitted yet."""
        new = {c.key: c for c in candidates if c.key not in self.fits}
        with threads_of(self.workers) as pool:
            for fitted in pool.map(self._fit, new.values()):
                self.fits[fitted.hypothesis.key] = fitted

    def _widen(self) -> None:
        """Where an effect explains more at one level than everywhere, the fit everywhere may have gone
        astray: it is done again from where the other one ended.
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
        """The same from other starts, if that is better."""
        tries = Candidates((fitted, FittedHypothesis.of(fitted.hypothesis, self.fitted, starts)))
        return tries.fits[int(np.argmin(tries.losses.sum(1)))]

    def fitted_with(self, before: Hypothesis, added: Added) -> FittedHypothesis:
        """The fit of `before` with an effect that belongs to another hypothesis, from where it was fitted."""
        key = before.key | {(added.family, added.variant, added.place)}
        if key not in self.fits:
            found = self.screen(self.fits[before.key])
            self.fit(s for s in found if s.key == key)
        return self.fits[key]


def _promising(found: Sequence[Screened], count: int) -> list[Screened]:
    """The first ones; what acts at one level of a factor is to be compared with the same everywhere."""
    first = [s for s in found if s.gain > 0.0][:count]
    local = {_everywhere(s) for s in first if s.place.factor is not None}
    more = [s for s in found[count:] if s.place.factor is None and _everywhere(s) in local]
    return [*first, *more]


def _everywhere(screened: Screened) -> tuple[str, str, str]:
    return screened.effect.family, screened.effect.variant, screened.place.channel
