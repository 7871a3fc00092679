"""The story of the judge, from top to bottom: base, lengths, scan, refits, class, further laws, verdict."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from unmodelled.diagnosis.data.result import Verdict
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.judge.base import Base, bases
from unmodelled.diagnosis.judge.classes import LawClass, stands
from unmodelled.diagnosis.judge.formulas import formulas
from unmodelled.diagnosis.judge.further import Named, exchanged
from unmodelled.diagnosis.judge.looks import Look, deciding, look_at, together
from unmodelled.diagnosis.judge.refit import Carried, Parent, Refit, refit
from unmodelled.diagnosis.judge.residual import Residual

#: Share of the squared residual above the noise from which laws are the main part of what is missing.
MAIN = 0.5


@dataclass(frozen=True, eq=False)
class Judgement:
    """Answer of the judge."""

    verdict: Verdict
    laws: tuple[LawClass, ...]  # the first explains most
    looks: tuple[Look, ...]  # by length, the shortest first
    rounds: tuple[Look, ...]  # in which each law was compared; the first is at the length that decides
    final: Parent  # with the laws
    alike: LawClass | None = None  # the most alike class where nothing is named
    instead: Named | None = None  # what stood before its first law gave way to a plainer form

    @property
    def look(self) -> Look:
        """Return the look at the length that decides."""
        return self.rounds[0]

    def until(self, count: int) -> Judgement:
        """Return the judgement with its first laws alone; without any, the first one is the most alike.

        A plainer form stands beside further laws only.
        """
        if count == 0:
            look, first = self.look, self.laws[0]
            return Judgement("unknown", (), self.looks, (look,), look.parent, first)
        laws, rounds, final = self.instead or (self.laws, self.rounds, self.final)
        final = rounds[count].parent if count < len(laws) else final
        verdict = _verdict(final.base, final.residual, True, True)
        return Judgement(verdict, tuple(laws[:count]), self.looks, tuple(rounds[:count]), final)


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
        looks.append(look_at(base, carried, workers))

    # 2. A law is ranked by its evidence over windows of all lengths: short ones prefer what is flexible, long
    #    ones what goes along with everything else that is wrong. The longest over which the best law stands
    #    decide. A gap that matters over windows of one length is one. Further laws follow the first one.
    looks = together(looks, workers)
    matters = any(look.matters for look in looks)
    look = deciding(looks)
    first = look.first(matters)
    laws, rounds, parent, instead = list[LawClass](), [look], look.parent, None
    if first is not None:
        (laws, rounds, parent), instead = exchanged(looks, look, first, workers, say)

    # 3. What is left decides the verdict. Where laws leave something, a formula that leaves nothing is the
    #    law. Laws that leave more than they explain are not what is missing.
    verdict = _verdict(parent.base, parent.residual, matters, bool(laws))
    if verdict in ("main_effect", "unknown"):
        say("write down a law")
        written = _written(looks)
        if written is not None:
            look, law = written
            return Judgement("effect", (law,), tuple(looks), (look,), look.parent.beside(law.speaker))
    found = Judgement(verdict, tuple(laws), tuple(looks), tuple(rounds), parent, instead=instead)
    return found.until(0) if laws and parent.explained < MAIN else found


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
            longest = replace(looks[-1], refits=(*looks[-1].refits, whole[-1]))
            return longest, LawClass((whole[-1],), np.ones(1))
    return None


def _is_whole(look: Look, law: Refit) -> bool:
    """Whether a law stands and leaves nothing."""
    return stands(law) and _verdict(look.parent.base, law.residual, True, True) == "effect"


def _verdict(base: Base, left: Residual, matters: bool, named: bool) -> Verdict:
    """Whether what is left is as small as the sensors or white."""
    if named:
        return "effect" if left.white or not base.matters(left) else "main_effect"
    return "no_gap" if left.white or not matters else "unknown"
