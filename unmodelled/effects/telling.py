"""Numbers of an effect as a person says them: in the words of the trade and the units of the logs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from unmodelled.base.wording import amounts
from unmodelled.effects.added import Added
from unmodelled.effects.law import Told
from unmodelled.systems.model import Input, Logged, Output, System
from unmodelled.systems.units import LoggedUnit

PLAIN = Told()
#: How often a wave comes in a turn, in words.
_TIMES = {"1": "once", "2": "twice"}


@dataclass(frozen=True)
class Said:
    """A number of an effect as a person says it."""

    symbol: str  # the said number in terms of the law's, such as "2*delta"
    words: str  # of the trade; "" where the symbol says all
    values: tuple[float, ...]  # in `unit`
    unit: str
    whole: float | None = None  # value of which the said one is a part, in `unit`
    instead: float | None = None  # value of the system file, in `unit`


def said(added: Added, name: str, values: Sequence[float]) -> Said:
    """Return values, given in SI units, of a number of an effect as a person says them."""
    told, unit = added.told.get(name, PLAIN), LoggedUnit(added.units[name], 1.0, 0.0)
    if told.unit:
        unit = LoggedUnit(told.unit, 1.0, 0.0)
    elif name in added.signals:
        unit = unit_of(added.system, added.signals[name], told.level) or unit
    shown = tuple((told.factor * value + told.shift - unit.offset) / unit.factor for value in values)
    whole, instead = (None if v is None else v / unit.factor for v in (told.whole, told.instead))
    return Said(told.symbol.format(name), told.words, shown, unit.text, whole, instead)


def told_wave(added: Added, name: str, values: Mapping[str, float], digits: int) -> str:
    """Return amplitude, frequency and phase of a wave in words, by the name of the amplitude of its sine.

    Values are in SI units; the amplitude has so many digits, the phase whole degrees.
    """
    wave, sine = added.waves[name], values[name]
    cosine, times = values[wave.cosine], wave.times if isinstance(wave.times, float) else values[wave.times]
    size = said(added, name, (math.hypot(sine, cosine),))
    top = round(math.degrees(math.atan2(sine, cosine)) / times) % (360.0 / times)
    often = _TIMES.get(f"{times:.3g}", f"{times:.3g} times")
    return f"{amounts(size.values, size.unit, digits)[0]} {often} per turn, largest at {top:.0f}\u00a0deg"


def scale(added: Added, name: str) -> tuple[str, str, float, float] | None:
    """Return how a person says a number that the law has in SI units; None for one that is said as it is."""
    number = said(added, name, (0.0, 1.0))
    zero, one = number.values
    plain = (number.symbol, number.unit) == (name, added.units[name])
    return None if plain else (number.symbol, number.unit, one - zero, zero)


def unit_of(system: System, signal: str, level: bool) -> LoggedUnit | None:
    """Return the unit in which a person writes values of a signal, or None if no column shows the signal."""
    column = _column(system, signal)
    if column is None:
        return None
    return column.as_written if level else column.as_difference


def _column(system: System, signal: str) -> Logged | None:
    """The input of that name, or the output that shows the signal, its own name first."""
    items: tuple[Input | Output, ...] = (*system.inputs, *system.outputs)
    named = [item for item in items if item.name == signal]
    if named:
        return named[0]
    known = {state.name for state in system.states} | set(system.signals)
    shows = [o for o in system.outputs if signal in known and o.expression == system.expression(signal)]
    return shows[0] if shows else None
