"""Stores that nothing logged fills: they exchange with the store beside them that something fills."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import replace

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.drafting.balances import NONE, PARTS, Balance, StoreFit
from unmodelled.drafting.channels import SAMPLES, Channel
from unmodelled.drafting.columns import Signal
from unmodelled.drafting.motion import at, explained, over
from unmodelled.drafting.units import dimension_of


def coupled(balances: Sequence[Balance], experiments: Sequence[Sequence[Signal]]) -> list[Balance]:
    """Return balances that share no supply; one without a supply exchanges with one that has a supply."""
    used = [supply.channel.signal.address for balance in balances for supply in balance.supplies]
    shared = {name for name in used if used.count(name) > 1}
    owners = [balance for balance in balances if shared & balance.names]
    drafts = [_linked([_owned(each, owner, shared) for each in balances], experiments) for owner in owners]
    scores = [sum(balance.fit.total for balance in draft) for draft in drafts]
    return drafts[int(np.argmax(scores))] if drafts else _linked(balances, experiments)


def _owned(balance: Balance, owner: Balance, shared: Set[str]) -> Balance:
    """A balance without the supplies that another one has."""
    if balance is owner or not shared & balance.names:
        return balance
    others = (*(supply.channel.signal for supply in balance.supplies), *balance.others)
    return replace(balance, supplies=(), fit=NONE, others=others)


def _linked(balances: Sequence[Balance], experiments: Sequence[Sequence[Signal]]) -> list[Balance]:
    """Balances of which those without a supply exchange with one that has a supply."""
    sources = [each for each in balances if each.supplies and each.kind.loses and not each.kind.turns]
    found = {id(balance): balance for balance in balances}
    for balance in balances:
        dimension = dimension_of(balance.level.unit)
        alike = [each for each in sources if dimension_of(each.level.unit) == dimension]
        if balance.supplies or not alike:
            continue
        source = max(alike, key=lambda each: abs(_correlation(each.level, balance.level)))
        tried = [_fits(source, balance, signals) for signals in experiments]
        known = [pair for pair in tried if pair is not None]
        own, other, exchange = max(known, key=lambda each: each[1].share, default=(source.fit, NONE, 0.0))
        found[id(source)] = replace(found[id(source)], fit=own)
        address = source.level.signal.address
        found[id(balance)] = replace(balance, fit=other, source=address, exchange=exchange)
    return [found[id(balance)] for balance in balances]


def _correlation(one: Channel, other: Channel) -> float:
    a, b = one.signal, other.signal
    return float(np.corrcoef(a.values, at(a.t, b.t, b.values))[0, 1])


def _fits(
    source: Balance, balance: Balance, signals: Sequence[Signal]
) -> tuple[StoreFit, StoreFit, float] | None:
    """Fits of a source and of a store beside it, and their exchange; None if values do not show them."""
    here = {signal.address: signal for signal in signals}
    channels = [source.level, balance.level, *(supply.channel for supply in source.supplies)]
    if any(channel.signal.address not in here for channel in channels):
        return None
    t = here[source.level.signal.address].t[:SAMPLES]
    x, y, *flows = (_values(channel, here, t) for channel in channels)
    flow = np.sum([-f if s.outward else f for f, s in zip(flows, source.supplies, strict=True)], axis=0)
    around = source.around
    known = around is not None and around.signal.address in here
    outside = _values(around, here, t) if around is not None and known else np.zeros_like(t)
    k = max(2, len(t) // PARTS[0])
    beside = [t[k:] - t[:-k]] if source.kind.around and not known else []
    between, lost = over(t, x - y, k), over(t, x - outside, k)
    gains, share, total = explained(x[k:] - x[:-k], [over(t, flow, k)], [*beside, lost, between])
    filled, part, whole = explained(y[k:] - y[:-k], [between], [*beside, over(t, y - outside, k)])
    if gains[0] <= 0.0 or gains[-1] >= 0.0 or filled[0] <= 0.0:
        return None
    size, exchange = 1.0 / float(gains[0]), -float(gains[-1] / gains[0])
    other = exchange / float(filled[0])
    own = StoreFit(size, max(-float(gains[-2]) * size, 0.0), source.fit.outside, share, total)
    loss = max(-float(filled[-1]) * other, 0.0)
    return own, StoreFit(other, loss, source.fit.outside, part, whole), exchange


def _values(channel: Channel, here: dict[str, Signal], t: Array) -> Array:
    signal = here[channel.signal.address]
    return channel.si(at(t, signal.t, signal.values))
