"""The story of the judge, from top to bottom: base, lengths, scan, refits, class, further laws, verdict."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from unmodelled.diagnosis.data.result import Verdict
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.judge.base import Base, bases
from unmodelled.diagnosis.judge.classes import BAR, NEARLY_ALL, SHARE, LawClass, best_class, stands
from unmodelled.diagnosis.judge.curves import free_curves
from unmodelled.diagnosis.judge.formulas import formulas
from unmodelled.diagnosis.judge.refit import Carried, Parent, Refit, refit, refits
from unmodelled.diagnosis.judge.residual import Residual
from unmodelled.diagnosis.judge.scan import scan

#: Most laws of different families beside each other: one at all joints of an arm is one law.
LAWS = 3
#: Share of the squared residual above the noise from which laws are the main part of what is missing.
MAIN = 0.5


@dataclass(frozen=True, eq=False)
class Look:
    """Evidence of laws at one length of the windows."""

    parent: Parent
    refits: tuple[Refit, ...]

    @property
    def matters(self) -> bool:
        """Return whether the gap of the base matters at this length."""
        return self.parent.base.matters(self.parent.residual)

    def first(self, matters: bool) -> LawClass | None:
        """Return the class that is named; where no gap `matters`, only if it removes nearly all of it."""
        found = best_class(self.refits)
        if found is None or matters or found.speaker.removed >= NEARLY_ALL:
            return found
        return None


@dataclass(frozen=True, eq=False)
class Judgement:
    """Answer of the judge."""

    verdict: Verdict
    laws: tuple[LawClass, ...]  # the first explains most
    looks: tuple[Look, ...]  # by length, the shortest first
    rounds: tuple[Look, ...]  # in which each law was compared; the first is at the length that decides
    final: Parent  # with the laws
    alike: LawClass | None = None  # the most alike class where nothing is named

    @property
    def look(self) -> Look:
        """Return the look at the length that decides."""
        return self.rounds[0]

    def until(self, count: int) -> Judgement:
        """Return the judgement with its first laws alone; without any, the first one is the most alike."""
        if count == 0:
            look, first = self.look, self.laws[0]
            return Judgement("unknown", (), self.looks, (look,), look.parent, first)
        laws, rounds = self.laws[:count], self.rounds[:count]
        return Judgement("main_effect", laws, self.looks, rounds, self.rounds[count].parent)


def judge(study: Study, begun: FittedHypothesis, workers: int, say: Callable[[str], None]) -> Judgement:
    """Name the laws that a model leaves out.

    The study has the default horizon, `begun` is a fit of the known physics; `say` takes a line at each step.
    Laws are refitted in as many threads as there are `workers`.
    """
    # 1. The known physics with its measurement chain, over windows of the default horizon and of four times
    #    it. At each length every law is ranked by one linear step, and the best are refitted.
    looks, carried = list[Look](), Carried()
    for base in bases(study, begun):
        say(f"compare laws over windows of {base.horizon:.3g} s")
        looks.append(_look(base, carried, workers))

    # 2. The longest windows decide; where no law stands over them, shorter ones. A gap that matters over
    #    windows of one length is one.
    matters = any(look.matters for look in looks)
    look = next((look for look in reversed(looks) if look.first(matters) is not None), looks[-1])
    first = look.first(matters)
    laws = [] if first is None else [first]
    parent, rounds = look.parent.beside(laws[0].speaker) if laws else look.parent, [look]

    # 3. Where what is left is no noise, a further law must explain more than a free curve in the arguments of
    #    the laws so far.
    while laws and len({law.speaker.row.atom.effect.family for law in laws}) < LAWS:
        if parent.residual.white:
            break
        say("look for a further law")
        look, further = _further(parent, laws, workers)
        if further is None:
            break
        laws.append(further)
        rounds.append(look)
        parent = parent.beside(further.speaker)

    # 4. What is left decides the verdict. Where laws leave something, a formula that leaves nothing is the
    #    law. Laws that leave more than they explain are not what is missing.
    verdict = _verdict(parent.base, parent.residual, matters, bool(laws))
    if verdict in ("main_effect", "unknown"):
        say("write down a law")
        written = _written(looks)
        if written is not None:
            look, law = written
            return Judgement("effect", (law,), tuple(looks), (look,), look.parent.beside(law.speaker))
    found = Judgement(verdict, tuple(laws), tuple(looks), tuple(rounds), parent)
    return found.until(0) if laws and parent.explained < MAIN else found


def _look(base: Base, carried: Carried, workers: int) -> Look:
    """Evidence of laws around a base, and around the better one that a law leads to, if there is one."""
    while True:
        parent = Parent.of(base)
        found = refits(parent, scan(parent.around), workers, carried)
        best = max(found, key=lambda one: one.nats, default=None)
        better = base.improved(best.fitted) if best is not None and stands(best) else None
        if better is None:
            return Look(parent, tuple(found))
        base = better


def _further(parent: Parent, laws: Sequence[LawClass], workers: int) -> tuple[Look, LawClass | None]:
    """Further laws beside a fit with laws, and the class that is named, or None.

    The fit is near enough for its linear step to say which laws do not stand. Forms of one kind at one place
    stand in for each other, never beside each other, but for a law about another one, such as its drift.
    """
    named = [law.speaker.row.about for law in laws]
    families = {law.speaker.row.atom.effect.family for law in laws}
    rows = [row for row in scan(parent.around) if row.nats >= BAR]
    rows = [row for row in rows if row.about not in named or families & row.atom.effect.beside]
    found = refits(parent, rows, workers)

    def large(one: Refit) -> bool:
        """Whether a law removes a share, or nearly all that is left, or acts at another port, too."""
        gone = float(np.max(1.0 - one.square / parent.around.squares))
        again = one.row.atom.place.kind == "port" and one.row.atom.effect.family in families
        return one.removed >= SHARE or gone >= NEARLY_ALL or again

    look = Look(parent, tuple(found))
    if best_class(found, large) is None:
        return look, None
    least = max((curve.nats for curve in free_curves(parent)), default=-np.inf) + BAR
    return look, best_class([one for one in found if one.nats >= least], large)


def _written(looks: Sequence[Look]) -> tuple[Look, LawClass] | None:
    """The shortest formula that leaves nothing over windows of any length, over the longest."""
    for law in formulas(looks[0].parent):
        fits: list[Refit | None] = [law]
        for look in looks[1:]:
            last = fits[-1]
            fits.append(None if last is None else refit(look.parent, law.row, last.fitted.fit.every))
        whole = [
            one for look, one in zip(looks, fits, strict=True) if one is not None and _is_whole(look, one)
        ]
        if len(whole) == len(looks):
            return Look(looks[-1].parent, (*looks[-1].refits, whole[-1])), LawClass((whole[-1],), np.ones(1))
    return None


def _is_whole(look: Look, law: Refit) -> bool:
    """Whether a law stands and leaves nothing."""
    return stands(law) and _verdict(look.parent.base, law.residual, True, True) == "effect"


def _verdict(base: Base, left: Residual, matters: bool, named: bool) -> Verdict:
    """Whether what is left is as small as the sensors or white."""
    if named:
        return "effect" if left.white or not base.matters(left) else "main_effect"
    return "no_gap" if left.white or not matters else "unknown"
