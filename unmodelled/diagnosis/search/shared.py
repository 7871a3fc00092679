"""One law at all places of a kind: friction in every joint of an arm, a filter behind every sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.diagnosis.search.screen import Screened
from unmodelled.effects.effect import Effect
from unmodelled.effects.place import Place
from unmodelled.effects.place_groups import FEWEST, place_groups

#: Laws that are fitted on few windows, besides the simplest ones.
TRIED = 4


@dataclass(frozen=True, eq=False)
class Shared:
    """A fitted hypothesis and one law at several places, with numbers of its own at each.

    Attributes:
        members: the law at each place, on top of the same hypothesis.
    """

    members: tuple[Screened, ...]

    @property
    def base(self) -> FittedHypothesis:
        """Return the fitted hypothesis without the law."""
        return self.members[0].base

    @property
    def effect(self) -> Effect:
        """Return the law."""
        return self.members[0].effect

    @property
    def place(self) -> tuple[Place, ...]:
        """Return the places of the law."""
        return tuple(one.place for one in self.members)

    @property
    def gain(self) -> float:
        """Return the sum of the predicted falls of the cross-validated loss."""
        return sum(one.gain for one in self.members)

    @cached_property
    def hypothesis(self) -> Hypothesis:
        """Return the hypothesis with the law at all places."""
        found = self.base.hypothesis
        for one in self.members:
            found = found.plus(one.effect, one.place)
        return found

    @property
    def key(self) -> frozenset[tuple[str, str, Place]]:
        """Return the key of `hypothesis`."""
        return frozenset().union(*(one.key for one in self.members))

    @property
    def starts(self) -> tuple[Start, ...]:
        """Return values to start a fit from: those of the members, which may have other names there."""
        start, added = dict(self.base.fit.every), self.hypothesis.effects[-len(self.members) :]
        for one, law in zip(self.members, added, strict=True):
            alone, best = one.hypothesis.effects[-1], one.starts[0]
            names = zip((*law.amplitudes, *law.shapes), (*alone.amplitudes, *alone.shapes), strict=True)
            start |= {name: best[own] for name, own in names if own in best}
        return (start,)


def shared(found: Sequence[Screened], simplest: float) -> list[Shared]:
    """Return the most promising laws at all places of a kind: at many ports, and lags of sensors of one unit.

    Args:
        found: screened candidates on top of one hypothesis, the most promising first.
        simplest: complexity up to which a law is tried whatever its screen says.
    """
    tried: list[Shared] = []
    for group in place_groups(found[0].base.hypothesis.study.system) if found else ():
        laws: dict[tuple[str, str], list[Screened]] = {}
        for one in found:
            if one.place in group and (one.is_late if one.place.kind == "sensor" else not _is_inertial(one)):
                laws.setdefault((one.effect.family, one.effect.variant), []).append(one)
        whole = [Shared(tuple(law)) for law in laws.values() if len(law) >= FEWEST[law[0].place.kind]]
        best: dict[str, Shared] = {}
        for law in sorted(whole, key=lambda law: -law.gain):
            best.setdefault(law.effect.family, law)
        promising = [law for law in best.values() if law.gain > 0.0][:TRIED]
        # tried in any case, as single delays and the simplest laws are: no linear prediction tells
        usual = [law for law in whole if law.place[0].kind == "sensor" or law.effect.complexity <= simplest]
        tried += [law for law in whole if law in promising or law in usual]
    return tried


def _is_inertial(one: Screened) -> bool:
    """Whether the law depends on the acceleration of its port, which holds the laws of all other ports.

    With such laws at many ports, expressions would multiply.
    """
    if one.place.kind != "port":
        return False
    velocity = one.base.hypothesis.study.system.port(one.place.name).velocity
    return f"d({velocity})/dt" in one.hypothesis.effects[-1].law


def at_best_places(found: Sequence[Screened], most: int) -> list[Screened]:
    """Return the candidates; of a law at one of more than `most` places of one kind, only the best.

    So many single effects are not reached one after the other, and the law is tried at all of these places.

    Args:
        found: screened candidates on top of one hypothesis, the most promising first.
        most: number of places of one kind up to which all are kept.
    """
    groups = place_groups(found[0].base.hypothesis.study.system) if found else ()
    group_of = {p.channel: group for group in groups if len(group) > most for p in group}
    seen: set[object] = set()
    kept = []
    for one in found:
        group = group_of.get(one.place.channel)
        law = one.effect.family, one.effect.variant, one.place.factor, one.place.level, group
        if group is None or law not in seen:
            kept.append(one)
        seen.add(law)
    return kept
