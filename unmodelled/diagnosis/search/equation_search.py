"""The search for effects by linear systems around fitted models: what these rank is fitted and judged."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from unmodelled.base.workers import threads_of
from unmodelled.diagnosis.core.choose import Chooser, Scored
from unmodelled.diagnosis.core.columns import Atom, Columns
from unmodelled.diagnosis.core.equations import Equations
from unmodelled.diagnosis.core.path import Path
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.search.candidates import Candidates
from unmodelled.diagnosis.search.effect_search import FEW_OUTPUTS, MOST_EFFECTS, EffectSearch, Key
from unmodelled.diagnosis.search.proposal import Proposal

#: Samples of all windows of a linear system, of a machine with up to `FEW_OUTPUTS` outputs; more tell little.
LINEAR_SAMPLES = 15_000
#: Single laws, and classes of sets, that are fitted over few windows, around the known physics and around
#: others; of these, how many are fitted to all; sets of differences between experiments.
SINGLES, CLASSES, FITTED, DIFFERENT = (12, 6), (12, 6), (8, 4), 3
#: Single laws around which the system is linearised again, beside what is named.
RIVALS = 2


class EquationSearch(EffectSearch):
    """A search for effects that fits what linear systems rank.

    Attributes:
        around: differences between experiments, by the key of the hypothesis around which a system was
            solved.
    """

    around: dict[Key, list[Atom]]

    def __post_init__(self) -> None:
        self.around = {}
        super().__post_init__()

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
        return self.candidates

    def _grow_laws(self) -> None:
        """Solve systems and fit as long as that names something new."""
        for _ in range(MOST_EFFECTS):
            parents = self._new(self._parents()) or self._new(self._fewer())
            if not parents:
                break
            for parent in parents:
                self._solve(parent)
            self._remove()

    def _parents(self) -> list[FittedHypothesis]:
        """Fits around which the system is linearised: the known physics, then the best ones."""
        if not self.around:
            return [self.base]
        candidates = self.candidates
        named = candidates.named()
        one = [k for k in candidates.promising(1) if k != named and not candidates.beats(named, k)]
        chosen = [named, *(one[:RIVALS] if len(self.around) == 1 else ())]
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
        self.around[parent.hypothesis.key] = chooser.differences() if len(self.fitted.runs) > 1 else []
        first = int(bool(parent.hypothesis.effects))
        heads = [group.head for group in chooser.classes() if group.head.atoms]
        best = chooser.singles[: SINGLES[first]]
        # beside another effect, the simplest variant of a law may be enough
        sets = [*best, *map(chooser.plainest, best), *heads[: CLASSES[first]]]
        self._fit_best(parent, [_proposal(parent, chooser, one) for one in sets], FITTED[first])

    def _vary(self) -> bool:
        """Fit a difference between experiments beside what is named and alone; whether that names others."""
        named, before = self._named(), self._named().hypothesis.key
        if len(named.hypothesis.together) >= MOST_EFFECTS:
            return False
        for parent in {p.hypothesis.key: p for p in (named, self.base)}.values():
            own = self.around.get(parent.hypothesis.key, [])[:DIFFERENT]
            new = [Proposal(parent, (atom,), (np.zeros(1),)) for atom in own]
            self._fit_best(parent, new, DIFFERENT)
        self._remove()
        return self._named().hypothesis.key != before

    def _fit_best(self, parent: FittedHypothesis, proposals: Sequence[Proposal], most: int) -> None:
        """Fit proposals over few windows, and those to all that none of lower cost beats there."""
        own = {p.key: p for p in proposals if p.key not in self.found and not p.key & self.refused}
        new = list(own.values())
        self.progress(f"fit {len(new)} sets of effects over few windows, and the best {most}")
        with threads_of(self.workers) as pool:
            scouts = list(pool.map(self._scouting.short, new))
        scouted = Candidates((self._scouting.as_short(self.base), *scouts), self.study.thresholds)
        order = sorted(range(1, 1 + len(new)), key=lambda k: float(scouted.costs[k]))
        kept = [k for n, k in enumerate(order) if not any(scouted.beats(j, k) for j in order[:n])]
        self.fit([(new[k - 1], scouts[k - 1].fitted.fit.every) for k in kept[:most]])

    def _chooser(self, parent: FittedHypothesis) -> Chooser:
        recording = self.study.recording
        length = float(recording.steps.mean()) * max(1.0, len(self.study.system.outputs) / FEW_OUTPUTS)
        few = recording.thinned(max(8, int(LINEAR_SAMPLES / length)))
        path = Path.of(parent, few)
        if path.hidden:  # their change is integrated from window to window: none may be left out
            path = Path.of(parent, recording)
        return Chooser(Equations.of(Columns(path)), path.gap)


def _proposal(parent: FittedHypothesis, chooser: Chooser, one: Scored) -> Proposal:
    """A set of laws with its linear amounts; a law that needs another one comes after it."""
    atoms = [chooser.equations.atoms[a] for a in one.atoms]
    amounts = chooser.folds.amounts(one.atoms)
    order = sorted(range(len(atoms)), key=lambda k: bool(atoms[k].effect.beside))
    return Proposal(parent, tuple(atoms[k] for k in order), tuple(amounts[k] for k in order))
