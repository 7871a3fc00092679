"""Assess a diagnosis with known planted effects: rules of the withheld check for one case.

An answer is right if it names family and channel of the planted effect, or of an effect that the logs of this
machine cannot distinguish from it (`alike` in truth.json). A drifting or scattering parameter has the
channels at which it acts (`parameter_channels`). Only the verdicts `effect` and `main_effect` name effects.
Effects that describe the measurement chain (`tolerated` in truth.json), or that the answer cannot tell from
one of these, are neither right nor wrong. Of the effects that an answer lists as indistinguishable from a
named one, the first `ALTERNATIVES` count.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Any

Content = Mapping[str, Any]
ActsAt = Mapping[str, Collection[str]]

#: A confidence from which on a wrong answer misleads.
CONFIDENT = 0.8
#: Alternatives of a named effect that count, as many as a diagnosis lists (`most_equal`): whoever lists every
#: family at every place has said nothing.
ALTERNATIVES = 3
#: Of `Case`, all true or false.
ANSWERS = ("first", "all_reported", "exact", "placed", "one", "channel")
#: Verdicts that name effects.
NAMING = ("effect", "main_effect")
OUTSIDE = "unknown"  # what truth.json has as verdict where an effect is of no family


@dataclass(frozen=True)
class Planted:
    """A planted effect of truth.json."""

    family: str
    channel: str
    answers: frozenset[tuple[str, str]]  # families and channels that are right
    #: Of the operating point, at one level of which the effect acts; None: in all experiments
    factor: str | None
    level: float | str | None  # of the factor
    seen: bool  # by the oracle
    share: float = 1.0  # of the squared gap of the case
    material: bool = True  # whether this share is at least a tenth

    @classmethod
    def of(cls, row: Content, seen: bool) -> "Planted":
        """Read a planted effect."""
        own = (row["family"], row["channel"])
        alike = {(other["family"], other["channel"]) for other in row["alike"]}
        part = row.get("factor"), row.get("level")
        return cls(
            *own, frozenset({own, *alike}), *part, seen, row.get("share", 1.0), row.get("material", True)
        )

    def __str__(self) -> str:
        return f"{self.family} at {self.channel}{_part(self.factor, self.level)}"

    @property
    def channels(self) -> frozenset[str]:
        """Channels of the right answers."""
        return frozenset(channel for _, channel in self.answers)

    def is_named(self, named: Content, acts_at: ActsAt) -> bool:
        """Tell whether a diagnosed effect names this effect, in whichever experiments it acts."""
        own = [f"parameter:{named['parameter']}"] if named.get("parameter") else []
        every = [*own, *channels(named["port"], acts_at)]
        return any((named["family"], channel) in self.answers for channel in every)

    def is_placed(self, named: Content) -> bool:
        """Tell whether a diagnosed effect acts in the same experiments as this effect."""
        return (named.get("factor"), named.get("level")) == (self.factor, self.level)


def channels(port: str, acts_at: ActsAt) -> Iterator[str]:
    """Yield a channel of diagnosis.json, and for a parameter also the channels at which it acts."""
    yield port
    yield from acts_at.get(port, ())


@dataclass(frozen=True)
class Case:
    """Planted effects and diagnosis of a case."""

    planted: tuple[Planted, ...]
    outside: bool  # the planted effect belongs to no family
    gap_seen: bool  # by the oracle
    diagnosis: Content  # content of diagnosis.json
    acts_at: ActsAt  # see `parameter_channels`
    #: Families and channels that describe parts of the measurement chain
    tolerated: frozenset[tuple[str, str]] = frozenset()

    @classmethod
    def of(
        cls, truth: Content, diagnosis: Content, acts_at: ActsAt, seen: Sequence[bool], gap_seen: bool = True
    ) -> "Case":
        """Compare a diagnosis with truth.json; `seen` and `gap_seen` are what the oracle sees."""
        planted = tuple(Planted.of(row, one) for row, one in zip(truth["effects"], seen, strict=True))
        tolerated = frozenset((row["family"], row["channel"]) for row in truth.get("tolerated", ()))
        return cls(planted, truth["verdict"] == OUTSIDE, gap_seen, diagnosis, acts_at, tolerated)

    @property
    def truth(self) -> str:
        """The planted effects in words."""
        return " + ".join(map(str, self.planted)) or "nothing"

    @property
    def verdict(self) -> str:
        """Verdict of the diagnosis."""
        return str(self.diagnosis["verdict"])

    @property
    def named(self) -> Sequence[Content]:
        """Named effects, the strongest first, without those that describe the measurement chain."""
        effects: Sequence[Content] = self.diagnosis["effects"] if self.verdict in NAMING else ()
        return [effect for effect in effects if not self._is_tolerated(effect)]

    def _is_tolerated(self, effect: Content) -> bool:
        """Whether an effect, or one that the logs cannot tell from it, describes the measurement chain."""
        every = _with_alternatives(effect)
        said = {(e["family"], channel) for e in every for channel in channels(e["port"], self.acts_at)}
        is_planted = any(p.is_named(e, self.acts_at) for p in self.planted for e in every)
        return bool(said & self.tolerated) and not is_planted

    @property
    def reported(self) -> list[list[Content]]:
        """Every named effect with the first effects that the diagnosis cannot distinguish from it."""
        return [_with_alternatives(effect) for effect in self.named]

    @property
    def first(self) -> bool:
        """Whether the strongest named effect is planted."""
        return any(p.is_named(self.named[0], self.acts_at) for p in self.planted) if self.named else False

    @property
    def all_reported(self) -> bool:
        """Whether every planted effect is named, or reported as indistinguishable from a named effect."""
        said = [effect for effects in self.reported for effect in effects]
        return all(any(p.is_named(effect, self.acts_at) for effect in said) for p in self.planted)

    @property
    def pairings(self) -> Iterator[list[tuple[Planted, Content]]]:
        """All assignments of the named effects to different planted effects."""
        if len(self.named) <= len(self.planted):
            for order in permutations(self.planted, len(self.named)):
                yield list(zip(order, self.named, strict=True))

    @property
    def exact(self) -> bool:
        """Whether exactly the planted effects are named."""
        every = len(self.named) == len(self.planted)
        return every and any(all(p.is_named(n, self.acts_at) for p, n in pairs) for pairs in self.pairings)

    @property
    def placed(self) -> bool:
        """Whether exactly the planted effects are named, in the right experiments."""
        return self.exact and any(
            all(p.is_named(n, self.acts_at) and p.is_placed(n) for p, n in pairs) for pairs in self.pairings
        )

    @property
    def one(self) -> bool:
        """Whether at least one planted effect is named."""
        return any(p.is_named(effect, self.acts_at) for p in self.planted for effect in self.named)

    @property
    def material(self) -> list[bool]:
        """Whether each material planted effect, or an effect indistinguishable from it, is named."""
        said = [effect for effects in self.reported for effect in effects]
        return [any(p.is_named(e, self.acts_at) for e in said) for p in self.planted if p.material]

    @property
    def channel(self) -> bool:
        """Whether the channel of the strongest effect, or else of the largest share, has a planted effect."""
        said: list[str] = [effect["port"] for effect in self.diagnosis["effects"]]
        if not said:
            shares = self.diagnosis["where"]["channels"]
            said = [row["port"] for row in sorted(shares, key=lambda row: -row["share"])]
        found = said and self.verdict != "no_gap"
        right = {channel for p in self.planted for channel in p.channels}
        return bool(found and right & {*channels(said[0], self.acts_at)})

    @property
    def right(self) -> bool:
        """Whether verdict and effects are right; the confidence is the probability of this event.

        - `no_gap` is right if the oracle sees none of the planted effects.
        - `main_effect` is right if every named effect is another planted effect, and the largest planted
          effect is among them.
        - `effect` is right if every named effect, or an effect reported as indistinguishable from it, is
          another planted effect in the right experiments, and all planted effects that the oracle sees are
          among them.
        - `unknown` is right for an effect of no family, and wrong for any other effect.
        - `check_logs` is right if nothing planted is seen, and its faults describe the measurement chain: for
          example a speed that was computed from the position and is late.
        """
        if self.verdict == "check_logs":
            return not any(p.seen for p in self.planted) and not self.outside and self._describes_chain
        if self.verdict == "no_gap":
            return not self.gap_seen if self.outside else not any(p.seen for p in self.planted)
        if self.verdict == OUTSIDE:
            return self.outside
        if not self.named:  # all named effects describe the measurement chain
            return not any(p.seen for p in self.planted) and not (self.outside and self.gap_seen)
        return any(self._told(dict(pairs)) for pairs in self._sets())

    @property
    def _describes_chain(self) -> bool:
        """Whether every fault of the logs is at a sensor that the measurement chain changes."""
        at = {channel for _, channel in self.tolerated}
        return all(f"sensor:{fault['channel']}" in at for fault in self.diagnosis["logs"])

    def _sets(self) -> Iterator[list[tuple[Planted, list[Content]]]]:
        if len(self.named) <= len(self.planted):
            for order in permutations(self.planted, len(self.named)):
                yield list(zip(order, self.reported, strict=True))

    def _told(self, said: Mapping[Planted, list[Content]]) -> bool:
        named = all(
            any(p.is_named(effect, self.acts_at) and p.is_placed(effect) for effect in effects)
            for p, effects in said.items()
        )
        if self.verdict == "main_effect":
            return named and max(self.planted, key=lambda p: p.share) in said
        return named and all(p in said for p in self.planted if p.seen)


def _with_alternatives(effect: Content) -> list[Content]:
    return [effect, *effect["indistinguishable"][:ALTERNATIVES]]


def in_words(case: Case) -> str:
    """Return the named effects in words, or the verdict."""
    text = " + ".join(
        f"{e['family']} at {e['port']}{_part(e.get('factor'), e.get('level'))}"
        + (f" (or {len(e['indistinguishable'])} more)" if e["indistinguishable"] else "")
        for e in case.named
    )
    return text or case.verdict


def _part(factor: str | None, level: float | str | None) -> str:
    return "" if factor is None else f" where {factor} is {level}"
