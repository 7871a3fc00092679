"""A first mapping and a first system file for logs, with a question wherever something was guessed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from unmodelled.base.errors import BadInput
from unmodelled.drafting.balances import Balance, balances_of, symbols_of
from unmodelled.drafting.channels import Channel
from unmodelled.drafting.columns import Signal, Timing, signals_in, timing_of
from unmodelled.drafting.coupling import coupled
from unmodelled.drafting.files import Survey, survey
from unmodelled.drafting.joints import MOST, STILL, Joint, joints_of
from unmodelled.drafting.kinds import HEAT, TANK
from unmodelled.drafting.lines import numbered
from unmodelled.drafting.names import ACTING, FORCES, Role, meaning_of
from unmodelled.drafting.units import is_position
from unmodelled.logs.clock import SHORTEST_LOG
from unmodelled.logs.readers.reader import Table
from unmodelled.logs.table import is_text
from unmodelled.systems.syntax import shown

#: Parts into which a single long record is cut: as many as it allows, to hold some of them out.
PARTS = (8, 6, 4, 3, 2)
#: Columns that a message names.
NAMES = 4
#: Experiments that a diagnosis should have.
WANTED = 12


@dataclass(frozen=True)
class Used:
    """A column that the drafted files use."""

    symbol: str  # in the drafted files
    channel: Channel
    kind: str  # quantity, for the table of the columns
    output: bool = True
    against: bool = False  # logged with the other sign


@dataclass(frozen=True)
class Draft:
    """Findings in logs."""

    survey: Survey
    timing: Timing
    experiments: tuple[list[Signal], ...]  # columns that change, of every experiment looked into
    joints: tuple[Joint, ...]
    positions: tuple[Channel, ...]  # of the joints and of what rests, in the order of the columns
    balances: tuple[Balance, ...]  # of a machine without moving positions
    split_by: str | None  # column whose runs of equal values are experiments
    cut: float | None  # length of the parts of a single long record, s
    constants: tuple[str, ...]  # names of values that a file holds once

    @property
    def used(self) -> list[Used]:
        """Columns that the drafted files use, the first output first."""
        return used_by(self.joints, self.balances)


def used_by(joints: Sequence[Joint], balances: Sequence[Balance]) -> list[Used]:
    """Return the columns that joints and balances use, the first output first."""
    found = []
    for k, joint in numbered(joints):
        found.append(Used(f"q{k}", joint.position, "position"))
        found += [Used(f"w{k}", joint.velocity, "speed")] if joint.velocity else []
        against = joint.trusted and joint.fit.gain < 0.0 and not joint.servo
        kind = "commanded position" if joint.servo else "drive"
        found += [Used(f"u{k}", joint.drive, kind, False, against)] if joint.drive else []
        second = joint.against and replace(joint.against, scale=1.0)
        found += [Used(f"u{k}_2", second, "drive, other chamber", False, against)] if second else []
    for k, balance in numbered(balances):
        for symbol, channel, is_level in symbols_of(k, balance):
            found.append(Used(symbol, channel, (channel.signal.role or Role.OTHER).value, is_level))
    found = [replace(each, kind="supply") if each.kind == Role.OTHER.value else each for each in found]
    return list({each.symbol: each for each in found}.values())


def draft_of(logs: Path, most: int = MOST) -> Draft:
    """Look at logs and guess what a first model of the machine, of at most so many joints, needs."""
    found = survey(logs)
    timing = timing_of(next(iter(found.read.values())))
    signals = {place: signals_in(tables, timing) for place, tables in found.read.items()}
    joints, balances = _parts([_sampled(each) for each in signals.values() if each] or [[]], most)
    outputs = [each for each in used_by(joints, balances) if each.output]
    if not outputs:
        names = sorted({signal.address for each in signals.values() for signal in each})
        listed = (", ".join(map(shown, names[:NAMES])) or "(none)") + (", ..." if len(names) > NAMES else "")
        raise BadInput(
            f"{logs}: no moving position and no level was found among the columns {listed}: write both "
            "files by hand, see docs/own_data"
        )
    names = [each.channel.signal.address for each in outputs]
    moved = [joint.position.signal.address for joint in joints] or names
    kept = _usable(found, signals, timing, names, moved)
    first, here = found.read[next(iter(kept.read))], signals[next(iter(kept.read))]
    used = {each.channel.signal.address for each in used_by(joints, balances)}
    split_by = _split_by([_table_of(tables, names[0]) for tables in kept.read.values()], used)
    return Draft(
        kept,
        timing,
        tuple(signals[place] for place in kept.read),
        tuple(joints),
        tuple(_positions([signals_in(tables, timing, values=1) for tables in kept.read.values()], joints)),
        tuple(balances),
        split_by,
        _cut(here, moved) if len(kept.read) == 1 and split_by is None else None,
        tuple(table.address(name) for table in first if len(table) == 1 for name in table.columns),
    )


def _sampled(signals: Sequence[Signal]) -> list[Signal]:
    """The signals without those that have too few samples for an output, if others have enough."""
    enough = [len(signal.t) >= SHORTEST_LOG for signal in signals]
    acts = [signal.role in ACTING | {Role.GOAL} for signal in signals]
    if not any(long and not act for long, act in zip(enough, acts, strict=True)):
        return list(signals)
    return [s for s, long, act in zip(signals, enough, acts, strict=True) if long or act]


def _positions(experiments: Sequence[Sequence[Signal]], joints: Sequence[Joint]) -> Iterator[Channel]:
    """Positions of joints, and those that rest at one place in all logs, in the order of the columns."""
    own = {joint.position.signal.address: joint.position for joint in joints}
    widest = max((float(np.ptp(channel.signal.values)) for channel in own.values()), default=0.0)
    values: dict[str, list[float]] = {}
    for signal in (each for signals in experiments for each in signals):
        values.setdefault(signal.address, []).extend((signal.values.min(), signal.values.max()))
    for signal in experiments[0] if own else ():
        if signal.address in own:
            yield own[signal.address]
        elif signal.role is Role.POSITION and np.ptp(values[signal.address]) <= STILL * widest:
            like = next(iter(own.values()))
            unit = signal.unit if signal.unit is not None and is_position(signal.unit) else None
            yield replace(like, signal=signal) if unit is None else Channel(signal, unit, True)


def _parts(experiments: Sequence[Sequence[Signal]], most: int) -> tuple[list[Joint], list[Balance]]:
    """The moving positions of a machine; the balances of one that has none."""
    roles = {signal.role for signals in experiments for signal in signals}
    acting = roles & (FORCES - {Role.DUTY})
    filled = not acting and any({kind.level, kind.supply} <= roles for kind in (HEAT, TANK))
    first = filled or Role.POSITION not in roles
    joints = [] if first else joints_of(experiments, most)
    # positions that rest, or are logged too seldom to show a motion, hide no speed and no level
    balances = [] if joints else coupled(balances_of(experiments), experiments)
    return joints if joints or balances else joints_of(experiments, most), balances


def _usable(
    found: Survey,
    signals: dict[Path, list[Signal]],
    timing: Timing,
    outputs: Sequence[str],
    moved: Sequence[str],
) -> Survey:
    """The experiments that have all outputs, and in which a position or level changes; others may rest."""
    left_out, read = dict(found.left_out), {}
    for place, each in signals.items():
        here = {signal.address: signal for signal in each}
        missing = {*outputs} - here.keys()
        if missing:
            missing -= {signal.address for signal in signals_in(found.read[place], timing, values=1)}
        moving = [here[name] for name in moved if name in here]
        if not is_text(place.resolve().name):
            left_out[place] = "its name has a control character: rename it"
        elif missing:
            left_out[place] = f"{min(missing)} has no values while time increases"
        elif not moving:
            verb = "does" if len(moved) == 1 else "do"
            left_out[place] = f"{', '.join(moved[:NAMES])} {verb} not change while time increases"
        elif max(len(signal.t) for signal in moving) < SHORTEST_LOG:
            left_out[place] = f"fewer than {SHORTEST_LOG} samples"
        else:
            read[place] = found.read[place]
    if not read:
        first, reason = next(iter(left_out.items()))
        raise BadInput(f"{first}: no file can be used, this one because {reason}")
    if len(read) == len(found.read):
        return found
    return found.only(read, left_out)


def _table_of(tables: Sequence[Table], address: str) -> Table:
    return next(t for t in tables for name in (*t.columns, *t.aliases) if t.address(name) == address)


def _split_by(tables: Sequence[Table], used: Set[str]) -> str | None:
    """A column that numbers or names parts of a campaign; of several, one whose count suits a diagnosis."""
    found: dict[str, int] = {}
    for table in tables:
        for name, cells in (*table.columns.items(), *table.texts.items()):
            # texts as objects, or every cell would become as long as the longest
            parts = _stretches(np.asarray(cells, None if name in table.columns else object))
            if parts > 1 and table.address(name) not in used and _is_part(name, table):
                found[name] = max(found.get(name, 0), parts)
    return min(found, key=lambda name: abs(np.log(found[name] / WANTED)), default=None)


def _is_part(name: str, table: Table) -> bool:
    """Whether a column is called a part, or counts one by one where nothing else tells what it is."""
    role = meaning_of(name, table.units.get(name)).role
    if role is not None or name not in table.columns:
        return role is Role.PART
    values = table.columns[name]
    return (
        len(np.unique(values)) > 2
        and bool(np.all(np.isin(np.diff(values), (0.0, 1.0))))
        and values[0] in (0, 1)
    )


def _stretches(values: np.ndarray) -> int:
    """Number of stretches of equal values; 0 if a usual one is too short for an experiment."""
    ends = np.flatnonzero(values[1:] != values[:-1]) + 1
    lengths = np.diff([0, *ends, len(values)])
    return len(lengths) if np.median(lengths) >= SHORTEST_LOG else 0


def _cut(signals: Sequence[Signal], names: Sequence[str]) -> float | None:
    """Length of parts of a record in which all positions or levels change, or else one, s; None: no parts."""
    moving = [signal for signal in signals if signal.address in names]
    t = moving[0].t
    for enough in (all, any):
        for parts in PARTS:
            length = float(f"{(t[-1] - t[0]) / parts:.2g}")
            starts = t[0] + length * np.arange(round((t[-1] - t[0]) / length))
            inside = [[s.values[(s.t >= a) & (s.t < a + length)] for s in moving] for a in starts]
            if len(starts) > 1 and all(
                min(map(len, part)) > SHORTEST_LOG and enough(np.ptp(v) > 0.0 for v in part)
                for part in inside
            ):
                return length
    return None
