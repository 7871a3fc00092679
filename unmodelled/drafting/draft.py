"""A first mapping and a first system file for logs, with a question wherever something was guessed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from unmodelled.base.errors import BadInput
from unmodelled.drafting.columns import Signal, Timing, signals_in, timing_of
from unmodelled.drafting.files import Survey, survey
from unmodelled.drafting.joints import Joint, joints_of
from unmodelled.drafting.names import Role, meaning_of
from unmodelled.logs.clock import SHORTEST_LOG
from unmodelled.logs.readers.reader import Table
from unmodelled.logs.table import is_text

#: Parts into which a single long record is cut: as many as it allows, to hold some of them out.
PARTS = (8, 6, 4, 3, 2)


@dataclass(frozen=True)
class Draft:
    """Findings in logs.

    Attributes:
        survey: files of the experiments.
        timing: their clock.
        experiments: columns that change, of every experiment that was looked into.
        joints: moving positions.
        split_by: column whose runs of equal values are experiments; None: there is none.
        cut: length into which a single long record is cut, s; None: not cut.
        constants: names of values that a file holds once.
    """

    survey: Survey
    timing: Timing
    experiments: tuple[list[Signal], ...]
    joints: tuple[Joint, ...]
    split_by: str | None
    cut: float | None
    constants: tuple[str, ...]


def draft_of(logs: Path) -> Draft:
    """Look at logs and guess what a first model of the machine needs.

    Args:
        logs: file of a recorder, or folder with such files.

    Raises:
        BadInput: when no file can be read, or no position that moves is found.
    """
    found = survey(logs)
    timing = timing_of(next(iter(found.read.values())))
    signals = {place: signals_in(tables, timing) for place, tables in found.read.items()}
    joints = joints_of([each for each in signals.values() if each] or [[]])
    joints = _mostly_moving(joints, list(signals.values()))
    if not joints:
        names = sorted({signal.address for each in signals.values() for signal in each})[:8]
        listed = ", ".join(map(repr, names)) or "(none)"
        raise BadInput(
            f"{logs}: no moving position was found among the columns {listed}: write mapping.yaml "
            "and the system file by hand, see docs/own_data"
        )
    kept = _usable(found, signals, joints)
    first = found.read[next(iter(kept.read))]
    base = _table_of(first, joints[0].position.signal.address)
    split_by = _split_by(base)
    return Draft(
        kept,
        timing,
        tuple(signals[place] for place in kept.read),
        tuple(joints),
        split_by,
        _cut(signals[next(iter(kept.read))], joints) if len(kept.read) == 1 and split_by is None else None,
        tuple(table.address(name) for table in first if len(table) == 1 for name in table.columns),
    )


def _outputs(joints: Sequence[Joint]) -> set[str]:
    channels = [each for j in joints for each in (j.position, j.velocity) if each]
    return {channel.signal.address for channel in channels}


def _mostly_moving(joints: list[Joint], experiments: Sequence[Sequence[Signal]]) -> list[Joint]:
    """The joints that move in at least half of the experiments; all if none does."""
    names = [{signal.address for signal in signals} for signals in experiments]
    kept = [j for j in joints if 2 * sum(_outputs([j]) <= each for each in names) >= len(names)]
    return kept or joints[:1]


def _usable(found: Survey, signals: dict[Path, list[Signal]], joints: Sequence[Joint]) -> Survey:
    """The experiments in which all outputs change."""
    used, base = _outputs(joints), joints[0].position.signal.address
    left_out, read = dict(found.left_out), {}
    for place, each in signals.items():
        here = {signal.address: signal for signal in each}
        if not is_text(place.resolve().name):
            left_out[place] = "its name has a control character: rename it"
        elif still := sorted(used - here.keys()):
            left_out[place] = f"{still[0]} does not change while time increases"
        elif len(here[base].t) < SHORTEST_LOG:
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


def _split_by(table: Table) -> str | None:
    """A column that is named like a part of a campaign, and that keeps its value over many rows."""
    for name, cells in (*table.columns.items(), *table.texts.items()):
        values = np.asarray(cells)
        changes = int(np.count_nonzero(values[1:] != values[:-1]))
        if meaning_of(name).role is Role.PART and 0 < changes < len(values) / SHORTEST_LOG:
            return name
    return None


def _cut(signals: Sequence[Signal], joints: Sequence[Joint]) -> float | None:
    """Length of parts of a record in which all outputs change, s; None if there are none."""
    outputs = [signal for signal in signals if signal.address in _outputs(joints)]
    t = next(signal.t for signal in outputs if signal.address == joints[0].position.signal.address)
    for parts in PARTS:
        length = float(f"{(t[-1] - t[0]) / parts:.2g}")
        starts = t[0] + length * np.arange(round((t[-1] - t[0]) / length))
        inside = [[s.values[(s.t >= a) & (s.t < a + length)] for a in starts] for s in outputs]
        if len(starts) > 1 and all(
            len(v) > SHORTEST_LOG and np.ptp(v) > 0.0 for each in inside for v in each
        ):
            return length
    return None
