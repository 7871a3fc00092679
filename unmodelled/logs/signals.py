"""Signals of a system from columns of a file: their units, and their values on another clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from unmodelled.base.arrays import Array, Indices
from unmodelled.base.errors import Faults, closest
from unmodelled.logs.cells import LARGEST
from unmodelled.logs.clock import LONGEST_GAP, read_at
from unmodelled.logs.mapping import LogMapping, Signal
from unmodelled.logs.on_change import is_even, is_on_change, steps_alike
from unmodelled.logs.record import Found, Record, check_coarse, in_order
from unmodelled.systems.model import Input, Output, System
from unmodelled.systems.units import LoggedUnit, parse_logged

#: Share of a turn beyond which two samples of an angle are a jump of a wrapped one.
HALF = 0.5
#: Share of gaps among the steps of an input's clock from which it has no period.
FEW_GAPS = 0.02
#: Samples from which on a smooth command is told from steps, and error of a spline through every other one,
#: as a share of that of straight lines, below which a command is smooth.
FEWEST_SMOOTH, SMOOTHER = 20, 0.5


@dataclass(frozen=True)
class Channel:
    """An input or output of the system, and the signal of the files that it is."""

    item: Input | Output
    kind: str  # between samples: "cubic", "linear" or "hold"
    signal: Signal

    def series(
        self, record: Record, base: Found, t: Array, rows: Indices, instants: Array
    ) -> tuple[Array, str]:
        """Return values (instants,) in the unit of the system, and how they were read.

        The experiment has some rows (rows,), in the order of time, of the table of `base`, with times t, s.
        """
        found, raw = record.numbers(self.signal.column)
        values = self._converted(record, found, raw)
        known = found.entries(values, self.signal.column.hold)
        if found.table is base.table:
            own_t, own = t[rows][known[rows]], values[rows][known[rows]]
            how = "has empty cells, and was read between the others"
        else:
            clock = record.clock(found.table)
            usable = np.flatnonzero(np.isfinite(clock) & known)
            if not len(usable):
                return np.full(len(instants), np.nan), ""
            order, _, repeated = in_order(clock, usable, self.signal.column.hold)
            check_coarse(str(record.path), repeated, len(usable))
            own_t, own = clock[order], values[order]
            how = f"of another clock was read at the instants of {base.name}"
        if np.array_equal(own_t, instants):
            return own, ""
        if not self.signal.column.hold:
            return self._read(own_t, own, instants), how
        means = isinstance(self.item, Input) and self.item.hold
        found_values = over_steps(own_t, own, instants) if means else self._read(own_t, own, instants)
        return found_values, "holds from row to row: no row means that nothing changed"

    def _read(self, t: Array, values: Array, instants: Array) -> Array:
        """Values between samples; none beyond the ends, and none in a gap, save of an input that is held."""
        if len(t) < 2:
            return np.full(len(instants), values[0] if len(t) and self.kind == "hold" else np.nan)
        before = np.searchsorted(t, instants, "right") - 1
        if self.kind == "hold":
            return np.where(before >= 0, values[np.maximum(before, 0)], np.nan)
        turn = self._turn()
        if turn is not None and np.any(np.abs(np.diff(values)) > HALF * turn):
            values = np.unwrap(values, period=turn)
        curved = self.kind == "cubic" or _smooth(t, values)
        found = read_at(t, values, instants, "cubic" if curved else "linear")
        beyond = (instants < t[0]) | (instants > t[-1])
        steps = np.diff(t)
        gaps = steps > LONGEST_GAP * np.median(steps)
        between = np.clip(before, 0, len(steps) - 1)
        # commands that are sent when they change have no period, and are known in between
        if self.kind == "cubic" or gaps.mean() < FEW_GAPS:
            beyond |= gaps[between] & (instants > t[between])
        return np.where(beyond, np.nan, found)

    def _turn(self) -> float | None:
        """One turn in the unit of the column; None for what is no angle."""
        if self.item.unit.strip() != "rad":
            return None
        return 2.0 * np.pi / (self.item.logged.factor if self.item.logged else 1.0)

    def _converted(self, record: Record, found: Found, raw: Array) -> Array:
        """Values in the unit of the system's column."""
        values = self.signal.factor * raw + self.signal.offset
        text = self.signal.unit
        if text is None and self.signal.factor in (1.0, -1.0):
            text = _known(found.unit)
        if text is None:
            return self._checked(record, values)
        unit, own = parse_logged(text)
        wanted, logged = parse_logged(self.item.column_unit)
        if unit.dimension != wanted.dimension:
            raise self.signal.column.node.wrong(
                f"{record.path}: {self.signal.column.name!r} is in {text!r}, and the system file has "
                f"{self.item.column_unit!r}: write the right 'unit', or a 'scale' that converts it"
            )
        one = LoggedUnit("", 1.0, 0.0)
        return self._checked(record, (logged or one).from_si((own or one).to_si(values)))

    def _checked(self, record: Record, values: Array) -> Array:
        """The values; refuse what a scale lifts beyond any measurement."""
        if np.any(np.abs(values) >= LARGEST):
            raise self.signal.column.node.wrong(
                f"{record.path}: {self.signal.column.name!r} times its scale is above {LARGEST:g}, beyond "
                "any measurement: correct the scale"
            )
        return values


def over_steps(t: Array, values: Array, instants: Array) -> Array:
    """Return means (instants,), from each instant to the next one, of values that hold from row to row.

    A relay that switches between two instants acts in the mean. There is no mean where a value is missing.

    Examples:
        >>> over_steps(np.array([0.0, 1.5]), np.array([2.0, 4.0]), np.array([0.0, 1.0, 2.0])).tolist()
        [2.0, 3.0, 4.0]
    """
    last = np.maximum(np.searchsorted(t, instants, "right") - 1, 0)
    known = np.isfinite(values)

    def until(each: Array) -> Array:
        """The integral of steps from the first row to each instant."""
        before = np.concatenate([[0.0], np.cumsum(each[:-1] * np.diff(t))])
        return np.asarray(before[last] + each[last] * (instants - t[last]))

    seconds = np.diff(instants)
    means = np.diff(until(np.where(known, values, 0.0))) / seconds
    lost = (np.diff(until((~known).astype(np.float64))) > 0.0) | (instants[:-1] < t[0])
    end = values[last[-1:]] if len(instants) and instants[-1] >= t[0] else np.full(len(instants[-1:]), np.nan)
    return np.concatenate([np.where(lost, np.nan, means), end])


def _smooth(t: Array, values: Array) -> bool:
    """Whether a spline through every other sample tells the rest much better than straight lines."""
    if len(t) < FEWEST_SMOOTH:
        return False
    left_out = values[1:-1:2]
    curved = read_at(t[::2], values[::2], t[1:-1:2], "cubic")
    straight = read_at(t[::2], values[::2], t[1:-1:2], "linear")
    return bool(np.sum((curved - left_out) ** 2) < SMOOTHER**2 * np.sum((straight - left_out) ** 2))


def _known(unit: str | None) -> str | None:
    """The unit that a file gives, if it is one."""
    try:
        return unit if unit and parse_logged(unit) else None
    except ValueError:
        return None


def channels_of(system: System, mapping: LogMapping) -> list[Channel]:
    """Return the outputs and inputs of a system with their signals, the first output first."""
    faults, found = Faults(), dict[str, Channel]()
    items: list[Input | Output] = [*system.outputs, *system.inputs]
    for item in items:
        signal = mapping.signals.get(item.column)
        if signal is None:
            where = mapping.node.entries()["signals"].where
            near = closest(item.column, mapping.signals)
            faults.add(f"{where}: the column {item.column!r} of the system file is missing{near}")
            continue
        held = signal.column.hold or (isinstance(item, Input) and item.hold)
        kind = "hold" if held else "cubic" if isinstance(item, Output) else "linear"
        found.setdefault(item.column, Channel(item, kind, signal))
    faults.check()
    return list(found.values())


def as_written(record: Record, channels: Sequence[Channel]) -> tuple[list[Channel], list[str]]:
    """Return the channels of a record, and the names of those that its rows show to be written on change.

    A mapping decides by `hold`. Where it does not, the first output tells: rows at uneven times, each a digit
    of the sensor from the row before, have no period. Then all signals hold that are written in this way.
    """
    first = leading(channels)
    t, values = _rows(record, first)
    uneven = is_on_change(t, values) and steps_alike(values) and not is_even(np.diff(t))
    if first.signal.column.given or not uneven:
        return list(channels), []
    held = [c for c in channels if not c.signal.column.given and is_on_change(*_rows(record, c))]
    return [_held(c) if c in held else c for c in channels], [c.item.name for c in held]


def _held(channel: Channel) -> Channel:
    """The channel, whose value holds until the next row."""
    column = replace(channel.signal.column, hold=True)
    return replace(channel, kind="hold", signal=replace(channel.signal, column=column))


def _rows(record: Record, channel: Channel) -> tuple[Array, Array]:
    """Times, s, and values (samples,) of the rows of a channel, in the order of time."""
    found, values = record.numbers(channel.signal.column)
    t = record.clock(found.table)
    usable = np.flatnonzero(np.isfinite(t) & np.isfinite(values))
    order = in_order(t, usable, hold=True)[0] if len(usable) else usable
    return t[order], values[order]


def leading(channels: Sequence[Channel]) -> Channel:
    """Return the channel whose clock counts: the first output, if it can be one that is sampled."""
    outputs = [channel for channel in channels if isinstance(channel.item, Output)]
    return next((channel for channel in outputs if not channel.signal.column.hold), channels[0])
