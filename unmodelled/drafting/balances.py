"""Balances of a machine: stores of heat, fluid, charge or momentum, each with what fills and empties it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from unmodelled.drafting.chains import copied
from unmodelled.drafting.channels import BARS, DEGREES, SAMPLES, Channel
from unmodelled.drafting.columns import Signal
from unmodelled.drafting.kinds import CELL, CHARGE, DIRECT, INDIRECT, SPEED, Kind
from unmodelled.drafting.motion import at, explained, over
from unmodelled.drafting.names import Role, is_command, is_gyro, number_of, words_of
from unmodelled.drafting.units import dimension_of
from unmodelled.systems.units import Dimension

#: Levels of a first model, and supplies of one.
MOST, SUPPLIES = 6, 3
#: Share of the largest change of a level below which another level of its kind stands still.
STILL = 0.02
#: Share of the changes of a level that supplies must explain: for their signs and the size of the store.
EXPLAINED = 0.1
#: Parts of a record over which changes of a level are taken, at least and at most.
PARTS = (60, 600)
#: Words of a level that surrounds others, and of what leaves a store.
_AROUND = (
    "ambient amb tamb ta outdoor outside oat toa external surroundings environment env umgebung aussen raum "
    "room air"
)
_OUT = "out outflow outlet drain leak discharge abfluss ablauf cool cooling cooler kühl"


@dataclass(frozen=True)
class Supply:
    """A column that fills or empties a store."""

    channel: Channel
    outward: bool  # it empties the store where it is positive
    direct: bool  # it is the effort of the balance itself; otherwise it sets it
    certain: bool  # name or values say so


@dataclass(frozen=True)
class StoreFit:
    """Size and losses of a store by the values, in SI units."""

    size: float = 0.0  # for one unit of its supplies; 0: not shown
    loss: float = 0.0  # for one unit of the level, or the resistance of an electric store
    outside: float = np.nan  # level of the surroundings; nan: not shown
    share: float = 0.0  # of the changes of the level that the supplies explain
    total: float = 0.0  # of the squared changes of the level that supplies and losses explain


NONE = StoreFit()


@dataclass(frozen=True)
class Balance:
    """A store with its level."""

    kind: Kind
    level: Channel
    supplies: tuple[Supply, ...]
    around: Channel | None  # level of its surroundings
    fit: StoreFit
    seconds: float  # length of a record
    others: tuple[Signal, ...]  # further columns that could be a supply
    goal: Signal | None  # set point of the level
    source: str | None = None  # level of the store that fills this one, where no supply is logged
    exchange: float = 0.0  # with that store for one SI unit between the levels; 0: not shown

    @property
    def names(self) -> set[str]:
        """Addresses of the supplies."""
        return {supply.channel.signal.address for supply in self.supplies}

    @property
    def fitted(self) -> bool:
        """Whether the logs show how the supplies change the level."""
        return self.fit.share > EXPLAINED and self.fit.size > 0.0


def symbols_of(k: str, balance: Balance) -> Iterator[tuple[str, Channel, bool]]:
    """Yield the columns of a balance by their symbols, each with whether it is the level."""
    level, supply, *_ = balance.kind.symbols
    yield f"{level}{k}", balance.level, True
    for j, each in enumerate(balance.supplies, start=1):
        symbol = supply if each.direct else "u"
        yield f"{symbol}{k}" + (f"_{j}" if j > 1 else ""), each.channel, False
    if balance.around is not None:
        yield f"{level}_a", balance.around, False


def balances_of(experiments: Sequence[Sequence[Signal]]) -> list[Balance]:
    """Find the stores with their levels and supplies."""
    kinds = _kinds({signal.role for each in experiments for signal in each})
    drafts = [found for kind in kinds if (found := _of_kind(kind, experiments))]
    return max(drafts, key=lambda found: max(each.fit.share for each in found), default=[])


def _of_kind(kind: Kind, experiments: Sequence[Sequence[Signal]]) -> list[Balance]:
    """The balances of one kind."""
    levels = [s for s in max(experiments, key=len, default=[]) if s.role is kind.level]
    if not levels:
        return []
    around = _around(levels) if kind.around and len(levels) > 1 else None
    levels = _distinct(levels, around)
    moves = [float(np.ptp(level_channel(s).si(s.values))) for s in levels]
    kept = [s for s, m in zip(levels, moves, strict=True) if s is not around and m > STILL * max(moves)][
        :MOST
    ]
    if around is None and kind.around:
        around = next((s for s in levels if s not in kept), None)
    return [_balance(kind, level, around, kept, experiments) for level in kept]


def _distinct(levels: Sequence[Signal], around: Signal | None) -> list[Signal]:
    """The levels without second sensors of one: surroundings stay, then those whose unit is known."""
    found = list[Signal]()
    for level in sorted(levels, key=lambda each: (each is not around, each.unit is None)):
        if not any(copied(level, other) for other in found):
            found.append(level)
    return [level for level in levels if level in found]


def _around(levels: Sequence[Signal]) -> Signal | None:
    """The level that surrounds others by its name: of a room and the air outside, the air outside."""
    order = _AROUND.split()
    found = [
        (min(order.index(w) for w in words), s)
        for s in levels
        if (words := {*order} & {*words_of(s.address)})
    ]
    return min(found, key=lambda each: each[0], default=(0, None))[1]


def _kinds(roles: set[Role | None]) -> list[Kind]:
    """Kinds of balances that quantities may stand for; several only where no supply itself is logged."""
    direct = [kind for kind in DIRECT if {kind.level, kind.supply} <= roles]
    if direct:
        return direct[:1]
    if {Role.VELOCITY, Role.CURRENT} <= roles:
        return [SPEED]
    electric = [kind for kind in (CELL, CHARGE) if {kind.level, kind.supply} <= roles]
    return [*electric[:1], *(kind for kind in INDIRECT if kind.level in roles)]


def _balance(
    kind: Kind,
    level: Signal,
    around: Signal | None,
    levels: Sequence[Signal],
    experiments: Sequence[Sequence[Signal]],
) -> Balance:
    """A level with the supplies of the experiment that shows best how they change it."""
    channel = level_channel(level)
    beside = None if around is None else level_channel(around)
    tried = [_tried(kind, channel, beside, levels, signals) for signals in experiments]
    known = [each for each in tried if each is not None]
    names = max((each.names for each in known), key=len, default=set())
    same = [each for each in known if each.names == names]
    return max(same, key=lambda each: each.fit.share)


def _tried(
    kind: Kind, level: Channel, around: Channel | None, levels: Sequence[Signal], signals: Sequence[Signal]
) -> Balance | None:
    """The balance of a level in one experiment; None if the level is not in it."""
    here = {signal.address: signal for signal in signals}
    if level.signal.address not in here:
        return None
    own = Channel(here[level.signal.address], level.unit, level.certain)
    beside = None
    if around is not None and around.signal.address in here:
        beside = Channel(here[around.signal.address], around.unit, around.certain)
    direct = [s for s in signals if s.role is kind.supply and _near(level.signal, s, levels)]
    direct = [s for s in _measured(direct) if _unit_of(s) == _unit_of(_measured(direct)[0])][:SUPPLIES]
    indirect = [s for s in signals if s.role in kind.indirect or s.role is None]
    goal = next((s for s in signals if s.role is Role.SET_POINT and _alike(s, own)), None)
    seconds = float(own.signal.t[-1] - own.signal.t[0])
    known = [s for s in indirect if s.role is not None] or indirect
    rated = [_fitted(kind, own, beside, [supply_channel(s, own)], False) for s in ([] if direct else known)]
    if direct:
        rated = [_fitted(kind, own, beside, [supply_channel(s, own) for s in direct], True)]
    supplies, fit = max(rated, key=lambda pair: pair[1].share, default=((), NONE))
    used = [supply.channel.signal for supply in supplies]
    others = tuple(s for s in indirect if s not in used)
    return Balance(kind, own, supplies, beside or around, fit, seconds, others, goal)


def _near(level: Signal, other: Signal, levels: Sequence[Signal]) -> bool:
    """Whether a supply may be that of a level, by their numbers."""
    number, numbers = number_of(other.address), {number_of(each.address) for each in levels}
    return not number or number not in numbers or number == number_of(level.address)


def _measured(signals: Sequence[Signal]) -> list[Signal]:
    """Supplies without commands beside what was measured."""
    measured = [s for s in signals if not is_command(s.address)]
    return measured or list(signals)


def _unit_of(signal: Signal) -> Dimension | None:
    return None if signal.unit is None else dimension_of(signal.unit)


def _alike(signal: Signal, level: Channel) -> bool:
    return signal.unit is None or dimension_of(signal.unit) == dimension_of(level.unit)


def level_channel(signal: Signal) -> Channel:
    """Return a level in its unit."""
    if signal.unit is not None:
        return Channel(signal, "1" if signal.unit == "count" else signal.unit, True)
    most, middle = float(np.abs(signal.values).max()), float(np.median(signal.values))
    usual = {
        Role.TEMPERATURE: "K" if middle > 200.0 else "degC",
        Role.LEVEL: "m",
        Role.PRESSURE: "Pa" if most > BARS else "bar",
        Role.CHARGE: "%" if most > 1.5 else "1",
        Role.VELOCITY: "rpm" if most > 200.0 else "rad/s",
    }
    if is_gyro(signal.address):
        usual[Role.VELOCITY] = "deg/s" if most > DEGREES else "rad/s"
    return Channel(signal, usual.get(signal.role or Role.OTHER, "V"), False)


def supply_channel(signal: Signal, level: Channel) -> Channel:
    """Return a supply in its unit."""
    usual = {Role.POWER: "W", Role.FLOW: "m^3/s", Role.CURRENT: "A", Role.VOLTAGE: "V", Role.PRESSURE: "bar"}
    turning = dimension_of(level.unit) == dimension_of("rad/s")
    usual[Role.EFFORT] = "N m" if turning else "N"
    unit = signal.unit or usual.get(signal.role or Role.OTHER, "1")
    return Channel(signal, "1" if unit == "count" else unit, signal.unit is not None)


def _fitted(
    kind: Kind, level: Channel, around: Channel | None, channels: Sequence[Channel], direct: bool
) -> tuple[tuple[Supply, ...], StoreFit]:
    """Supplies with their signs, and what the values say of the store.

    The level changes by what flows in and out between two instants; both are taken over parts of the record,
    so that noise is not differentiated. A supply that switches often shows over shorter parts.
    """
    lengths = {max(2, min(len(level.signal.t), SAMPLES) // parts) for parts in PARTS}
    tried = [_fitted_over(k, kind, level, around, channels, direct) for k in sorted(lengths, reverse=True)]
    return max(tried, key=lambda found: found[1].share)


def _fitted_over(
    k: int, kind: Kind, level: Channel, around: Channel | None, channels: Sequence[Channel], direct: bool
) -> tuple[tuple[Supply, ...], StoreFit]:
    """Supplies and fit by changes over k samples."""
    t = level.signal.t[:SAMPLES]
    x = level.si(level.signal.values[: len(t)])
    flows = [channel.si(at(t, channel.signal.t, channel.signal.values)) for channel in channels]
    changes = x[k:] - x[:-k]
    # surroundings that are not logged have a level that does not change
    beside = [t[k:] - t[:-k]] if kind.around and around is None else []
    if kind.loses:
        outside = 0.0 if around is None else around.si(at(t, around.signal.t, around.signal.values))
        beside.append(over(t, x - outside, k))
    if kind.electric:
        beside += [flow[k:] - flow[:-k] for flow in flows[:1]]
    each, *_ = explained(changes, [over(t, flow, k) for flow in flows], beside)
    supplies = tuple(_supply(c, float(gain), direct, kind) for c, gain in zip(channels, each, strict=False))
    total = np.sum([-f if s.outward else f for f, s in zip(flows, supplies, strict=True)], axis=0)
    gains, share, explains = explained(changes, [over(t, total, k)], beside)
    gain, last = float(gains[0]), float(gains[-1])
    if gain <= 0.0 or share <= EXPLAINED:
        return tuple(replace(s, outward=_is_out(s.channel), certain=True) for s in supplies), NONE
    if kind.electric:
        drop = -last if supplies[0].outward else last
        return supplies, StoreFit(1.0 / gain, max(drop, 0.0), np.nan, share, explains)
    if not kind.loses or last >= 0.0:
        return supplies, StoreFit(1.0 / gain, 0.0, np.nan, share, explains)
    outside = float(gains[1]) / -last if kind.around and around is None else np.nan
    return supplies, StoreFit(1.0 / gain, -last / gain, outside, share, explains)


def _supply(channel: Channel, gain: float, direct: bool, kind: Kind) -> Supply:
    """A supply with its sign: by its name, otherwise by the values."""
    named = _is_out(channel) and kind.supply is not Role.CURRENT
    return Supply(channel, named or gain < 0.0, direct, not (gain < 0.0 and not named))


def _is_out(channel: Channel) -> bool:
    return bool({*_OUT.split()} & {*words_of(channel.signal.address)})
