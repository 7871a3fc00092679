"""Further laws beside the first one, and the exchange of laws that stand in for each other."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

import numpy as np

from unmodelled.diagnosis.judge.classes import BAR, LEAST, NEARLY_ALL, SHARE, LawClass, best_class
from unmodelled.diagnosis.judge.curves import free_curves
from unmodelled.diagnosis.judge.linear import Linearised
from unmodelled.diagnosis.judge.looks import Look
from unmodelled.diagnosis.judge.refit import Parent, Refit, refit, refits
from unmodelled.diagnosis.judge.scan import scan

#: Most laws of different families beside each other: one at all joints of an arm is one law.
LAWS = 3
#: Named classes, the looks in which they were found, and the fit with all of them.
Named = tuple[list[LawClass], list[Look], Parent]


def exchanged(
    looks: Sequence[Look], look: Look, first: LawClass, workers: int, say: Callable[[str], None]
) -> Named:
    """Return the first class with further ones, or its plainest form with them where that explains more.

    A flexible form of the first law takes a part of a second one.
    """
    found = _named(looks, look, first, workers, say)
    plain = first.plainest
    if plain is first or (len(found[0]) == 1 and found[2].residual.white):
        return found
    other = _named(looks, look, plain, workers, say)
    beside = [law.speaker.removed for law in other[0][1:]]
    effects = beside and (other[2].residual.white or min(beside) >= LEAST)
    return other if effects and _evidence(look, other) > _evidence(look, found) else found


def _evidence(look: Look, found: Named) -> float:
    """Evidence of all named laws, nats, after their price."""
    laws, _, final = found
    whole = Linearised.of(final.fitted, final.base.tau, look.parent.weights)
    return whole.evidence - sum(law.speaker.price for law in laws)


def _named(
    looks: Sequence[Look],
    look: Look,
    first: LawClass,
    workers: int,
    say: Callable[[str], None],
    gone: Collection[str] = (),
) -> Named:
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
