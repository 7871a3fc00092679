"""From columns of numbers to experiments on one uniform clock: checks, unwrapping, resampling."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput, Faults
from unmodelled.logs.alive import check_alive, check_size, is_dead
from unmodelled.logs.clock import (
    LONGEST_GAP,
    TOLERANCE,
    UNIFORM,
    Kind,
    check_time,
    common_period,
    parts,
    read_at,
    uniform_clock,
)
from unmodelled.logs.constants import logged, part_name, with_constants
from unmodelled.logs.inspection.inspect import inspected, sentences
from unmodelled.logs.measurements import Continued, M
from unmodelled.logs.preparation import prepare
from unmodelled.logs.recognition import NUMBER
from unmodelled.logs.table import SMALLEST, Columns, TextTable, check_header, check_texts
from unmodelled.systems.model import Input, Output, System

TURN = 2.0 * np.pi  # rad
#: Logs that a note names.
NAMED = 4
#: Distance by which a sample is moved, as a share of a period, from which differences of samples are rough.
ROUGH = 0.2
#: Longest gap, as a share of the record before it, over which states that no output shows go on. Nobody knows
#: what the inputs did in a longer one.
LONGEST_BRIDGE = 0.1


def units_of(system: System) -> dict[str, str]:
    """Return the columns that a log of a system must have, with the units in which they are logged."""
    return {"t": "s", **{s.column: s.column_unit for s in _signals(system)}}


def _signals(system: System) -> list[Input | Output]:
    return [*system.inputs, *system.outputs]


def in_si(log: Columns, system: System) -> Columns:
    """Return a log with all columns in SI units."""
    scaled = {s.column: s.logged for s in _signals(system) if s.logged is not None}
    values = {
        name: scaled[name].to_si(column) if name in scaled else column for name, column in log.values.items()
    }
    return replace(log, values=values)


def checked_in_si(log: Columns, system: System) -> Columns:
    """Return a log in SI units; refuse one without a usable clock, or whose outputs change too little."""
    faults = Faults()
    with faults.collected():
        check_time(log)
    with faults.collected():
        check_size(log, system)
    faults.check()
    return in_si(log, system)


def assembled(
    kind: type[M],
    system: System,
    table: TextTable,
    logs: Sequence[Columns],
    provenance: Mapping[str, Any],
    faults: Faults,
    cure: bool = True,
    clock: str = "s",
) -> M:
    """Return logs of a kind on one uniform clock, with states.

    `cure`: whether faults are cured; `clock`: unit of the clock as logged.
    """
    found = Faults()
    check_alive(system, logs, faults)
    with found.collected():
        experiments = _experiments(table, system)
        with_constants(system, experiments, _places(table.path, experiments))
    with found.collected():
        faults.check()
    found.check()
    seen = inspected(system, list(experiments["id"]), logs, cure)
    experiments, logs, cuts = _without_gaps(system, experiments, seen.logs)
    experiments, notes = with_constants(system, experiments, _places(table.path, experiments))
    experiments, period = experiments.reset_index(drop=True), common_period(logs)
    notes = [*notes, *sentences(seen.found, clock), *cuts]
    read = _measurements(kind, system, experiments, logs, period, notes, provenance)
    return prepare(system, replace(read, limits=seen.limits, clock=clock))


def _places(path: Path, experiments: pd.DataFrame) -> list[str]:
    """The beginnings of messages about the experiments, one per row of the table."""
    return [f"{path}: row {row}: column id" for row in experiments.index]


def _without_gaps(
    system: System, experiments: pd.DataFrame, logs: Sequence[Columns]
) -> tuple[pd.DataFrame, list[Columns], list[str]]:
    """Every log with gaps cut into experiments of their own; and notes."""
    rows, ids, found, notes, faults = list[int](), list[str](), list[Columns](), list[str](), Faults()
    for row, (name, log) in enumerate(zip(experiments["id"], logs, strict=True)):
        with faults.collected():
            pieces = parts(log)
            moving = [piece for piece in pieces if len(pieces) == 1 or _moving(piece, pieces, system)]
            if not moving:
                raise BadInput(f"{log.path}: column t: gaps leave no part in which an output changes")
            since = [float(b.values["t"][0] - a.values["t"][-1]) for a, b in pairwise(moving)]
            found += [moving[0], *(replace(b, since=s) for b, s in zip(moving[1:], since, strict=True))]
            rows += [row] * len(moving)
            ids += [name] if len(pieces) == 1 else [part_name(name, k) for k in range(1, len(moving) + 1)]
            if len(pieces) > 1:
                parts_of_it = f"{ids[-len(moving)]} to {ids[-1]}" if len(moving) > 1 else ids[-1]
                lost = len(log) - sum(map(len, moving))
                rest = (
                    f"; {lost} of its {len(log)} samples lie in parts that are too short, rest or have a "
                    "dead output, and were left out"
                )
                notes.append(
                    f"{name} was cut at gaps of more than {LONGEST_GAP:g} sampling periods: its parts are "
                    f"{parts_of_it}{rest if lost else ''}"
                )
    faults.check()
    return experiments.iloc[rows].assign(id=ids), found, notes


def _moving(piece: Columns, pieces: Sequence[Columns], system: System) -> bool:
    """Whether an output changes in a piece of a log, and none is dead there."""
    still = [o for o in system.outputs if np.ptp(piece.values[o.column]) < SMALLEST]
    moving = {o: [each for each in pieces if np.ptp(each.values[o.column]) >= SMALLEST] for o in still}
    dead = (bool(others) and is_dead(system, o, others, piece) for o, others in moving.items())
    return len(still) < len(system.outputs) and not any(dead)


def _experiments(table: TextTable, system: System) -> pd.DataFrame:
    """The table, with the numbers of its rows in the file as index."""
    constants, faults, rows = logged(system), Faults(), [row for row, _ in table.rows]
    if not rows:
        raise BadInput(f"{table.path}: row 1: column id: no experiments below it")
    with faults.collected():
        check_header(table.path, table.header, ["id", "file", *constants])
    found: dict[str, list[Any]] = {name: table.column(name) for name in table.header if name}
    with faults.collected():
        _check_ids(table.path, rows, found["id"])
    for constant in (each for each in system.operating_point if each.name in {*constants} & {*found}):
        with faults.collected():
            values = np.array(table.numbers(constant.name))
            found[constant.name] = list(values if constant.logged is None else constant.logged.to_si(values))
    faults.check()
    if "group" in found:  # an experiment without a group is one of its own
        found["group"] = [group or name for group, name in zip(found["group"], found["id"], strict=True)]
    for name in set(found) - {"id", "file", "group", *constants}:
        if all(NUMBER.fullmatch(cell) for cell in found[name]):
            found[name] = [float(cell) for cell in found[name]]
    experiments = pd.DataFrame(found, index=rows)
    check_texts(table.path, experiments, rows)
    return experiments


def _check_ids(path: Path, rows: Sequence[int], ids: Sequence[str]) -> None:
    """Refuse ids that are empty or there twice, a line for each."""
    first: dict[str, int] = {}
    faults = Faults()
    for row, name in zip(rows, ids, strict=True):
        if not name:
            faults.add(f"{path}: row {row}: column id: is empty")
        elif name in first:
            faults.add(f"{path}: row {row}: column id: {name!r} stands in row {first[name]} already")
        else:
            first[name] = row
    faults.check()


def _measurements(
    kind: type[M],
    system: System,
    experiments: pd.DataFrame,
    logs: Sequence[Columns],
    period: float,
    notes: list[str],
    provenance: Mapping[str, Any],
) -> M:
    ids = tuple(experiments["id"])
    clocks, moves = zip(*(uniform_clock(log.values["t"], period) for log in logs), strict=True)
    offsets = np.concatenate([[0], np.cumsum([len(clock) for clock in clocks])]).astype(np.int64)
    pairs = list(zip(logs, clocks, strict=True))
    y, u = np.empty((offsets[-1], len(system.outputs))), np.empty((offsets[-1], len(system.inputs)))
    notes = [*notes, *_moved(ids, logs, moves, period)]
    for j, output in enumerate(system.outputs):
        columns = [log.values[output.column] for log in logs]
        turning = [output.unit.strip() == "rad" and _wrapped(column) for column in columns]
        columns = [np.unwrap(v) if turns else v for v, turns in zip(columns, turning, strict=True)]
        y[:, j] = _read(columns, pairs, "cubic")
        if any(turning):
            notes.append(f"{output.name} was unwrapped")
    for j, item in enumerate(system.inputs):
        u[:, j] = _read([log.values[item.column] for log in logs], pairs, "linear")
    return kind.without_states(
        system,
        experiments,
        period=period,
        offsets=offsets,
        t=np.concatenate([period * np.arange(len(clock)) for clock in clocks]),
        y=y,
        u=u,
        notes=tuple(notes),
        provenance=provenance,
        delays=(0.0,) * len(system.inputs),
        continues=_continued(ids, logs, period),
    )


def _continued(ids: Sequence[str], logs: Sequence[Columns], period: float) -> tuple[Continued | None, ...]:
    """The experiment that every experiment continues, unless a long gap lies between; () if none does."""
    found, seconds = list[Continued | None](), 0.0
    for before, log in zip(["", *ids[:-1]], logs, strict=True):
        since = log.since if log.since is not None and log.since <= LONGEST_BRIDGE * seconds else None
        seconds = float(np.ptp(log.values["t"])) + (0.0 if since is None else seconds + since)
        found.append(None if since is None else Continued(before, max(1, round(since / period))))
    return tuple(found) if any(found) else ()


def _wrapped(angle: Array) -> bool:
    """Whether `angle` (n,), rad, stays within one turn, jumps by a turn at times, and is smooth otherwise."""
    steps = np.diff(angle)
    jumps = np.abs(steps) > np.pi
    smooth = np.abs(np.remainder(steps + np.pi, TURN) - np.pi)
    # less than a quarter turn per sample, or a jump by a turn could as well be motion
    return bool(jumps.any() and smooth.max() < 0.5 * np.pi and np.ptp(angle) < TURN * (1.0 + 1e-3))


def _read(columns: Sequence[Array], pairs: Sequence[tuple[Columns, Array]], kind: Kind) -> Array:
    """A column of every log at the instants of its uniform clock, one after the other."""
    return np.concatenate(
        [
            read_at(log.values["t"], values, clock, kind)
            for values, (log, clock) in zip(columns, pairs, strict=True)
        ]
    )


def _periods(ids: Sequence[str], periods: Sequence[float]) -> str:
    """Sampling periods (logs,), s, in words: two with the logs that have them, more as a range.

    Examples:
        >>> _periods(["a", "b", "c"], [0.1, 0.09, 0.1])
        '0.1 s but 0.09 s in b'
    """
    usual = float(np.median(periods))
    other = [k for k, each in enumerate(periods) if abs(each / usual - 1.0) > TOLERANCE]
    mine = [periods[k] for k in other]
    if not other or max(mine) > (1.0 + TOLERANCE) * min(mine) or 2 * len(other) >= len(ids):
        return f"{min(periods):.6g} to {max(periods):.6g} s"
    more = f" and {len(other) - NAMED} more" if len(other) > NAMED else ""
    return f"{usual:.6g} s but {mine[0]:.6g} s in {', '.join(ids[k] for k in other[:NAMED])}{more}"


def _moved(ids: Sequence[str], logs: Sequence[Columns], moves: Sequence[float], period: float) -> list[str]:
    """What happened to the clocks."""
    periods = [float(np.median(np.diff(log.values["t"]))) for log in logs]
    if max(periods) > (1.0 + TOLERANCE) * (1.0 + 1e-9) * min(periods):
        return [
            f"the sampling periods of the logs differ, {_periods(ids, periods)}: all logs were read every "
            f"{period:.6g} s by interpolation; check the clock of those that should have the same"
        ]
    moved = np.count_nonzero(np.array(moves) > UNIFORM)
    if not moved:
        return []
    worst = int(np.argmax(moves))
    rough = "; speeds from such stamps are rough, which looks like a gap: log the times of measurement"
    return [
        f"{moved} of {len(ids)} logs were put on a uniform clock of {period:.6g} s by interpolation; samples "
        f"moved by up to {100.0 * moves[worst]:.3g} % of a period ({ids[worst]})"
        + (rough if moves[worst] > ROUGH else "")
    ]
