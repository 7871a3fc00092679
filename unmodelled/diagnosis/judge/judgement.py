"""The story of the judge, from top to bottom: base, lengths, scan, refits, class, further laws, verdict."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from unmodelled.diagnosis.data.result import Verdict
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.judge.base import Base, bases
from unmodelled.diagnosis.judge.classes import BAR, NEARLY_ALL, SHARE, LawClass, best_class, stands
from unmodelled.diagnosis.judge.curves import free_curves
from unmodelled.diagnosis.judge.formulas import formulas
from unmodelled.diagnosis.judge.linear import Linearised
from unmodelled.diagnosis.judge.refit import Carried, Parent, Refit, completed, refit, refits
from unmodelled.diagnosis.judge.residual import Residual
from unmodelled.diagnosis.judge.scan import Row, scan

#: Most laws of different families beside each other: one at all joints of an arm is one law.
LAWS = 3
#: Share of the squared residual above the noise from which laws are the main part of what is missing.
MAIN = 0.5


@dataclass(frozen=True, eq=False)
class Look:
    """Evidence of laws at one length of the windows."""

    parent: Parent
    rows: tuple[Row, ...]  # every law by its linear step
    refits: tuple[Refit, ...]

    @property
    def matters(self) -> bool:
        """Return whether the gap of the base matters at this length."""
        return self.parent.base.matters(self.parent.residual)

    def alone(self, law: LawClass) -> Refit | None:
        """Return a law that was found beside another one as it was refitted here, None where it was not."""
        return next((one for one in self.refits if one.row.key == law.speaker.row.key), None)

    def first(self, matters: bool) -> LawClass | None:
        """Return the class that is named; where no gap `matters`, only if it leaves nearly nothing.

        That is if a law removes nearly all of the gap, or leaves noise where the base does not.
        """
        found = best_class(self.refits)
        if found is None or matters or max(one.removed for one in found.members) >= NEARLY_ALL:
            return found
        return found if found.speaker.residual.white and not self.parent.residual.white else None


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
        laws, rounds, final = self.laws[:count], self.rounds[:count], self.rounds[count].parent
        verdict = _verdict(final.base, final.residual, True, True)
        return Judgement(verdict, laws, self.looks, rounds, final)


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

    # 2. A law is ranked by its evidence over windows of all lengths: short ones prefer what is flexible, long
    #    ones what goes along with everything else that is wrong. The longest over which the best law stands
    #    decide. A gap that matters over windows of one length is one. Further laws follow the first one.
    looks = _together(looks, workers)
    matters = any(look.matters for look in looks)
    look = _deciding(looks)
    first = look.first(matters)
    laws, rounds, parent = list[LawClass](), [look], look.parent
    if first is not None:
        laws, rounds, parent = _named(looks, look, first, workers, say)

    # 3. What is left decides the verdict. Where laws leave something, a formula that leaves nothing is the
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
        rows = scan(parent.around)
        found = refits(parent, rows, workers, carried)
        best = max(found, key=lambda one: one.nats, default=None)
        better = base.improved(best.fitted) if best is not None and stands(best) else None
        if better is None:
            return Look(parent, tuple(rows), tuple(found))
        base = better


def _together(looks: Sequence[Look], workers: int) -> list[Look]:
    """Looks with the best laws of each fitted in all of them, and their evidence overall.

    A law that cannot be fitted at a length is of size zero there. One that is among the best of no length
    has no overall evidence.
    """
    every = [
        completed(
            look.parent,
            look.rows,
            look.refits,
            [r for o in looks if o is not look for r in o.refits],
            workers,
        )
        for look in looks
    ]
    by_key = [{one.row.key: one.or_nothing for one in each} for each in every]
    shared = set.intersection(*(set(each) for each in by_key))
    overall = {key: float(np.mean([each[key] for each in by_key])) for key in shared}
    return [
        replace(look, refits=tuple(replace(one, overall=overall.get(one.row.key, -np.inf)) for one in each))
        for look, each in zip(looks, every, strict=True)
    ]


def _deciding(looks: Sequence[Look]) -> Look:
    """The longest look at which the best law of those that stand anywhere stands."""
    standing = [
        (one.overall, k, one.row.key) for k, look in enumerate(looks) for one in look.refits if stands(one)
    ]
    best = max(standing, default=None)
    if best is None:
        return looks[-1]
    return looks[max(k for _, k, key in standing if key == best[2])]


def _named(
    looks: Sequence[Look],
    look: Look,
    first: LawClass,
    workers: int,
    say: Callable[[str], None],
    gone: Collection[str] = (),
) -> tuple[list[LawClass], list[Look], Parent]:
    """The first class with further ones, the looks in which they were found, and the fit with all of them.

    `look` is the one of the looks that decides. Where what is left is no noise, a further law must explain
    more than a free curve in the arguments of the laws so far. A first law that does not pay beside the
    others made up for the second, which is then the first, without those that are `gone`.
    """
    laws, rounds, parent = [first], [look], look.parent.beside(first.speaker)
    others = [one.parent for one in looks if one is not look]
    while len({law.speaker.row.atom.effect.family for law in laws}) < LAWS and not parent.residual.white:
        say("look for a further law")
        others = _beside(others, laws[-1].speaker)
        beside, further = _further(parent, others, laws, workers, gone)
        if further is None:
            break
        laws.append(further)
        rounds.append(beside)
        parent = parent.beside(further.speaker)
    second = _as_first(look, laws[1]) if len(laws) > 1 and not gone else None
    if second is None or _pays(look, laws, parent):
        return laws, rounds, parent
    return _named(looks, look, second, workers, say, {one.row.name for one in first.members})


def _beside(parents: Sequence[Parent], law: Refit) -> list[Parent]:
    """Fits over windows of other lengths with one law more, those that it can be fitted beside."""
    fits = [(parent, refit(parent, law.row, law.fitted.fit.every)) for parent in parents]
    return [parent.beside(one) for parent, one in fits if one is not None and np.isfinite(one.nats)]


def _pays(look: Look, laws: Sequence[LawClass], final: Parent) -> bool:
    """Whether the first of some laws pays beside the others; yes where these cannot be fitted alone."""
    parent, first = look.parent, laws[0].speaker
    for law in laws[1:]:
        own = look.alone(law)
        one = refit(parent, law.speaker.row, None if own is None else own.fitted.fit.every)
        if one is None or one.nats == -np.inf:
            return True
        parent = parent.beside(one)
    whole = Linearised.of(final.fitted, final.base.tau, parent.weights)
    return whole.evidence - parent.around.evidence - first.price >= BAR


def _as_first(look: Look, law: LawClass) -> LawClass | None:
    """A law that was found beside another one, with those that are like it where it is alone; or None."""
    own = look.alone(law)
    return None if own is None else best_class([r for r in look.refits if r.overall <= own.overall])


def _further(
    parent: Parent,
    others: Sequence[Parent],
    laws: Sequence[LawClass],
    workers: int,
    gone: Collection[str],
) -> tuple[Look, LawClass | None]:
    """Further laws beside a fit with laws, and the class that is named, or None; none of those that are gone.

    The fit is near enough for its linear step to say which laws do not stand. Forms of one kind at one place
    stand in for each other, never beside each other, but for a law about another one, such as its drift. What
    a law must be is asked of windows of every length, as of the first one.
    """
    named = [law.speaker.row.about for law in laws]
    families = {law.speaker.row.atom.effect.family for law in laws}
    rows = [row for row in scan(parent.around) if row.nats >= BAR and row.name not in gone]
    rows = [row for row in rows if row.about not in named or families & row.atom.effect.beside]
    matters = parent.base.matters(parent.residual)

    def large(one: Refit) -> bool:
        """Whether a law removes a share, or nearly all that is left, or acts at another port, too.

        Where what is left does not matter, only what removes nearly all of it.
        """
        again = one.row.atom.place.kind == "port" and one.row.atom.effect.family in families
        nearly_all = parent.gone(one) >= NEARLY_ALL
        return one.overall >= BAR and (nearly_all or (matters and (one.removed >= SHARE or again)))

    found = [_overall(one, others) if large(one) else one for one in refits(parent, rows, workers)]
    look = Look(parent, tuple(rows), tuple(found))
    if best_class(found, large) is None:
        return look, None
    least = max((curve.nats for curve in free_curves(parent)), default=-np.inf) + BAR
    return look, best_class([one for one in found if one.nats >= least], large)


def _overall(law: Refit, others: Sequence[Parent]) -> Refit:
    """A law with its evidence over windows of every length; where it cannot be fitted, it is of size zero."""
    fits = (refit(parent, law.row, law.fitted.fit.every) for parent in others)
    nats = [law.nats, *(-law.price if one is None else one.or_nothing for one in fits)]
    return replace(law, overall=float(np.mean(nats)))


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
