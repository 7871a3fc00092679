"""Further laws beside the first one, and the exchange of laws that stand in for each other."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

import numpy as np

from unmodelled.diagnosis.judge.classes import BAR, LEAST, NEARLY_ALL, SHARE, LawClass, best_class
from unmodelled.diagnosis.judge.curves import arguments, free_curves
from unmodelled.diagnosis.judge.linear import Linearised
from unmodelled.diagnosis.judge.looks import Look
from unmodelled.diagnosis.judge.refit import Parent, Refit, refit, refits
from unmodelled.diagnosis.judge.scan import scan
from unmodelled.effects.effect import DISTINCT

#: Most laws of different families beside each other: one at all joints of an arm is one law.
LAWS = 3
#: Named classes, the looks in which they were found, and the fit with all of them.
Named = tuple[list[LawClass], list[Look], Parent]


def exchanged(
    looks: Sequence[Look], look: Look, first: LawClass, workers: int, say: Callable[[str], None]
) -> tuple[Named, Named | None]:
    """Return the first class with further ones, or its plainest form with them where that explains more.

    A flexible form of the first law takes a part of a second one. What a plainest form stands instead of
    follows, if it does: without its further laws it would be less.
    """
    found = _named(looks, look, first, workers, say)
    plain = first.plainest
    if plain is first or (len(found[0]) == 1 and found[2].residual.white):
        return found, None
    other = _named(looks, look, plain, workers, say)
    laws, rounds, final = other
    beside = [_is_effect(one.parent, law.speaker) for one, law in zip(rounds[1:], laws[1:], strict=True)]
    effects = beside and (final.residual.white or all(beside))
    if not effects or _evidence(look, other) <= _evidence(look, found):
        return found, None
    return ([_beside_others(look, laws), *laws[1:]], rounds, final), found


def _beside_others(look: Look, laws: Sequence[LawClass]) -> LawClass:
    """The first class of some laws as the logs tell it apart beside the others."""
    first, parent = laws[0], _without_first(look, laws)
    refitted = [] if parent is None else [refit(parent, m.row, m.fitted.fit.every) for m in first.members]
    again = best_class([one for one in refitted if one is not None])
    if again is None or again.speaker.row.key != first.speaker.row.key:
        return first
    found = {one.row.key: one for one in first.members}
    return LawClass(tuple(found[one.row.key] for one in again.members), again.probabilities)


def _is_effect(parent: Parent, law: Refit) -> bool:
    """Whether a further law removes a share of all that was there, or nearly all that was left."""
    return law.removed >= LEAST or parent.gone(law) >= NEARLY_ALL


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
    parent = _without_first(look, laws)
    if parent is None:
        return True
    whole = Linearised.of(final.fitted, final.base.tau, look.parent.weights)
    one = Linearised.of(parent.fitted, parent.base.tau, look.parent.weights)
    return whole.evidence - one.evidence - laws[0].speaker.price >= BAR


def _without_first(look: Look, laws: Sequence[LawClass]) -> Parent | None:
    """A fit with all of some laws but the first; None where they cannot be fitted alone."""
    parent = look.parent
    for law in laws[1:]:
        own = look.alone(law)
        one = refit(parent, law.speaker.row, None if own is None else own.fitted.fit.every)
        if one is None or one.nats == -np.inf:
            return None
        parent = parent.beside(one)
    return parent


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

    The fit is near enough for its linear step to say which laws do not stand. Forms of a named law in its
    class stand in for it, never beside it, but for a law about another one, such as its drift. What a law
    must be is asked of windows of every length, as of the first one.
    """
    named = {one.row.name for law in laws for one in _forms(law)}
    families = {law.speaker.row.atom.effect.family for law in laws}
    rows = [row for row in scan(parent.around) if row.nats >= BAR and row.name not in gone]
    rows = [row for row in rows if row.name not in named or families & row.atom.effect.beside]
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
    curves = tuple(free_curves(parent))
    return look, best_class([one for one in found if all(_beats(one, curve) for curve in curves)], large)


def _forms(law: LawClass) -> list[Refit]:
    """The law to name and those of its class that are forms of it."""
    return [law.speaker] if law.kind in DISTINCT else law.forms


def _beats(law: Refit, curve: Refit) -> bool:
    """Whether a law explains more than a free curve, or nearly as much by a form that the curve holds."""
    if law.row.atom.place == curve.row.atom.place and arguments(law) <= arguments(curve):
        return law.removed >= NEARLY_ALL * curve.removed
    return law.nats >= curve.nats + BAR


def _overall(law: Refit, others: Sequence[Parent]) -> Refit:
    """A law with its evidence over windows of every length; where it cannot be fitted, it is of size zero."""
    fits = (refit(parent, law.row, law.fitted.fit.every) for parent in others)
    nats = [law.nats, *(-law.price if one is None else one.or_nothing for one in fits)]
    return replace(law, overall=float(np.mean(nats)))
