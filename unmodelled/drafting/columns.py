"""The columns of logs with their clocks, ranges, units and probable roles."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.drafting.names import Role, meaning_of
from unmodelled.drafting.units import factor_of
from unmodelled.logs.on_change import is_even, is_on_change
from unmodelled.logs.readers.reader import Table
from unmodelled.logs.time_units import in_seconds, seconds_of, unit_of_time

#: Units of time that recorders use, and usual sampling rates, Hz, of machines that move and of others.
TIMES, USUAL, SLOW = ("s", "ms", "us", "ns"), 100.0, 1.0
#: Lowest usual sampling rate, Hz, of other machines, and highest sampling rate that needs no question.
SLOWEST, FASTEST = 1.0 / 900.0, 1e4
#: Quantities of machines that move.
_MOVING = frozenset([Role.POSITION, Role.VELOCITY, Role.EFFORT, Role.GOAL])
#: Quantities that change slowly.
_SLOW = frozenset([Role.TEMPERATURE, Role.LEVEL, Role.PRESSURE, Role.CHARGE])
_SLOW |= {Role.FLOW, Role.VOLTAGE, Role.POWER}
#: Fewest rows of a table that is a log, and of values that a signal takes.
ROWS, VALUES = 20, 2


@dataclass(frozen=True)
class Timing:
    """The clock of the logs."""

    column: str | None = None  # None: the format has a clock, or there is none
    unit: str = "s"  # of the column
    rate: float | None = None  # assumed where there is no clock, Hz
    certain: bool = True  # file or name say so


@dataclass(frozen=True, eq=False)
class Signal:
    """A column that changes, in one experiment."""

    address: str  # by which a mapping finds it, with the name of an element of a list
    t: Array  # (samples,), s
    values: Array  # (samples,), in the unit
    unit: str | None  # by file or name
    role: Role | None  # by name or unit
    held: bool = False  # it is written when it changes, and was read at uniform instants
    factor: float = 1.0  # of the logged values beside the unit: 0.1 for `pos (0.1 deg)`

    @property
    def rate(self) -> float:
        """Sampling rate, Hz."""
        step = float(np.median(np.diff(self.t))) if len(self.t) > 1 else 0.0
        return 1.0 / step if step > 0.0 else 0.0


def timing_of(tables: Sequence[Table]) -> Timing:
    """Find the clock of the tables of an experiment."""
    logs = [table for table in tables if len(table) >= ROWS]
    if any(table.clock is not None for table in logs) or not logs:
        return Timing()
    base = max(logs, key=len)
    found = {name: score for name in base.columns if (score := _likeness(base, name)) > 0.0}
    if not found:
        return Timing(rate=_usual(base), certain=False)
    name = max(found, key=lambda each: found[each])
    given = meaning_of(name, base.units.get(name)).unit or unit_of_time(name, base.columns[name]) or ""
    step = float(np.median(np.abs(np.diff(base.columns[name]))))
    if (seconds := seconds_of(given)) is not None:
        # a name that tells a faster clock than machines are logged with may have another meaning
        # and a number beside the unit is no part of it
        plain = factor_of(name, base.units.get(name)) == 1.0
        sure = name in base.units or 1.0 / (step * seconds) < FASTEST
        return Timing(name, given, certain=plain and sure)
    rates = {unit: 1.0 / (step * (seconds_of(unit) or 1.0)) for unit in TIMES}
    # temperatures are logged every second to every quarter of an hour: of such rates, that of seconds
    usual = _usual(base)
    slowest = SLOWEST if usual == SLOW else usual
    unit = min(TIMES, key=lambda each: abs(np.log(rates[each] / np.clip(rates[each], slowest, usual))))
    return Timing(name, unit, certain=unit == "s" and 0.05 * usual < rates["s"] < FASTEST)


def _usual(table: Table) -> float:
    """Sampling rate that the quantities of a table are usually logged at, Hz."""
    roles = {meaning_of(name, table.units.get(name)).role for name in table.columns}
    return SLOW if roles & _SLOW and not roles & _MOVING else USUAL


def _likeness(table: Table, name: str) -> float:
    """How much a column looks like a clock: it grows, and its name, unit, place or evenness say so."""
    values = table.columns[name]
    steps = np.diff(values[np.isfinite(values)])
    if len(steps) < ROWS or not np.median(steps) > 0.0 or np.mean(steps >= 0.0) < 0.95:
        return 0.0
    meant = meaning_of(name, table.units.get(name))
    ticks = meant.unit == "count" and bool(np.all(steps == steps[0]))  # no encoder counts so evenly
    role = Role.TIME if ticks else meant.role
    if role not in (None, Role.TIME, Role.PART):
        return 0.0
    named = 4.0 * (role is Role.TIME)
    even = float(is_even(steps))
    first = float(next(iter(table.columns)) == name)
    return named + even + first if named or even else 0.0


def signals_in(tables: Sequence[Table], timing: Timing, values: int = VALUES) -> list[Signal]:
    """Return the columns of an experiment that change and are no clock."""
    found = []
    for table in tables:
        t = _clock(table, tables, timing)
        elements = {own: other for other, own in table.aliases.items() if _is_named(other)}
        for name, column in table.columns.items():
            rows = np.flatnonzero(np.isfinite(column) & np.isfinite(t))
            is_time = name == timing.column or name in table.origins
            if is_time or np.array_equal(column, t) or len(np.unique(column[rows])) < values:
                continue
            rows = rows[np.argsort(t[rows], kind="stable")]
            rows = rows[np.concatenate([[True], np.diff(t[rows]) > 0.0])]
            address = table.address(elements.get(name, name))
            held = is_on_change(t[rows], column[rows])
            # what a value that is written when it changes is called, `state`, is not what it means
            meant = meaning_of(address.removesuffix(".state") if held else address, table.units.get(name))
            if (len(rows) >= ROWS or held) and meant.role is not Role.TIME:
                factor = factor_of(address, table.units.get(name))
                own = factor * column[rows]
                found.append(Signal(address, t[rows], own, meant.unit, meant.role, held, factor))
    return _together(found)


def _together(signals: Sequence[Signal]) -> list[Signal]:
    """The signals; those that are held at uniform instants, as often as the fastest changes on average."""
    held = [signal for signal in signals if signal.held]
    if not held:
        return list(signals)
    end = max(signal.t[-1] for signal in held)
    period = min((signal.t[-1] - signal.t[0]) / (len(signal.t) - 1) for signal in held)
    return [_at_uniform(each, float(end), float(period)) if each.held else each for each in signals]


def _at_uniform(signal: Signal, end: float, period: float) -> Signal:
    first = np.ceil(signal.t[0] / period)
    t = period * np.arange(first, np.floor(end / period) + 1.0)
    return replace(signal, t=t, values=signal.values[np.searchsorted(signal.t, t, "right") - 1])


def _is_named(name: str) -> bool:
    """Whether a name ends with an element of a list by its name, not by its number."""
    return re.search(r"\[[^\[\]]*[^\d\[\]][^\[\]]*\]$", name) is not None


def _clock(table: Table, tables: Sequence[Table], timing: Timing) -> Array:
    """Time of every row, s, up to where it starts again; nan where there is none."""
    none = np.full(len(table), np.nan)
    if timing.rate is not None:
        return np.arange(len(table)) / timing.rate
    if timing.column is None:
        t = none if table.clock is None else table.clock
    else:
        name = timing.column
        columns = [each.columns[name] for each in (table, *tables) if name in each.columns]
        fitting = (column for column in columns if len(column) == len(table))
        t = in_seconds(next(fitting, none), seconds_of(timing.unit) or 1.0)
    known = t[np.isfinite(t)]
    again = np.flatnonzero(np.diff(t) < -0.5 * (np.ptp(known) if len(known) else 0.0))
    return np.where(np.arange(len(t)) > again[0], np.nan, t) if len(again) else t
