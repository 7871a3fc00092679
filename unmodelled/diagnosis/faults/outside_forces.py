"""Outside forces: pushes, contacts and other efforts that act for a while and that no law explains."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from unmodelled.base.arrays import Array, Mask
from unmodelled.base.wording import level_name
from unmodelled.diagnosis.data.levels import levels
from unmodelled.diagnosis.data.remark import listed, quantity
from unmodelled.diagnosis.data.result import LogFault
from unmodelled.diagnosis.where.corrections import Corrections
from unmodelled.logs.logs import Logs
from unmodelled.logs.time_units import on_clock

#: Name of the fault in diagnosis.json.
OUTSIDE_FORCE = "outside_force"
#: Probability that the largest correction of an ordinary experiment is called unusual, at each port.
BY_CHANCE = 1e-3
#: By how much it must exceed that of the ordinary experiment, at least.
LEAST_FACTOR = 2.0
#: Windows that an outside force lasts at least: a shorter one may be a fault of a sensor.
SHORTEST = 3
#: Windows between two stretches that are one, and the largest share of an experiment.
PAUSE, MOST = 5, 0.5
#: Standard deviation of normal values by the median of their distances from the median.
NORMAL = 1.4826
#: Stretches of an experiment that a sentence lists: those of the largest efforts.
LISTED = 3


@dataclass(frozen=True)
class _Stretch:
    """A part of an experiment, s since its start, with the largest correction at a port in it, SI."""

    port: str
    run: int
    start: float
    end: float
    effort: float
    square: float


def outside_forces(corrections: Corrections, alarm: bool = True) -> LogFault | None:
    """Return when ports need far more effort for a while than ever in the ordinary experiment.

    The largest correction is about the same in ordinary experiments. Where that of a few experiments is
    larger by more than chance, at a motion and at inputs that ordinary experiments have, too, and the rest of
    them is ordinary, no law of the machine explains it. Without `alarm`, the sentence is a plain remark.
    """
    found, shares = list[_Stretch](), list[float]()
    for k, place in enumerate(corrections.places):
        if place.kind == "port" and (stretches := list(_stretches(corrections, k))):
            found += stretches
            whole = float(np.sum(_size(corrections, k) ** 2))
            shares.append(sum(stretch.square for stretch in stretches) / whole)
    if not found:
        return None
    logs = corrections.recording.logs
    units = {port.name: port.unit for port in corrections.model.system.ports}
    return LogFault(
        channels=tuple(dict.fromkeys(stretch.port for stretch in found)),
        problem=OUTSIDE_FORCE,
        explains=max(shares),
        experiments=tuple(logs.ids[run] for run in sorted({stretch.run for stretch in found})),
        sentence=_sentence(units, logs, found, alarm),
        decides=False,
    )


def _size(corrections: Corrections, k: int) -> Array:
    """Sizes of the corrections at a place; none in the short windows at the ends, which are noisier."""
    steps = corrections.recording.steps
    return np.where(corrections.seen[:, k] & (steps == steps.max()), np.abs(corrections.value[:, k]), 0.0)


def _stretches(corrections: Corrections, k: int) -> Iterator[_Stretch]:
    """Parts of unusual experiments in which the correction at a place exceeds the ordinary largest one."""
    recording, size = corrections.recording, _size(corrections, k)
    largest = np.array([size[recording.owner == run].max() for run in recording.runs])
    ordinary, count = float(np.median(largest)), len(largest)
    if count < 3 or not ordinary > 0.0:
        return
    apart = np.log(np.maximum(largest / ordinary, 1e-12))
    spread = NORMAL * float(np.median(np.abs(apart))) * np.sqrt(1.0 + 1.0 / count)
    above = max(float(stdtrit(count - 1, 1.0 - BY_CHANCE)) * spread, np.log(LEAST_FACTOR))
    runs = [run for run, peak in zip(recording.runs, apart, strict=True) if peak > above]
    known = _known(corrections, k, runs) if runs else np.empty(0, np.bool_)
    for run in runs:
        yield from _of_run(corrections, k, run, size, ordinary, ordinary * float(np.exp(above)), known)


def _known(corrections: Corrections, k: int, runs: Sequence[int]) -> Mask:
    """Mask, shape (windows,), of motions and inputs within the range of those outside of some experiments."""
    coordinates, places = corrections.coordinates, corrections.places
    at = [places[k], *(place for place in places if place.kind == "actuator")]
    values = np.array([coordinate.values for place in at for coordinate in coordinates.of(place)])
    others = values[:, ~np.isin(corrections.recording.owner, runs)]
    low, high = others.min(1, keepdims=True), others.max(1, keepdims=True)
    return np.asarray(((values >= low) & (values <= high)).all(0))


def _of_run(
    corrections: Corrections, k: int, run: int, size: Array, ordinary: float, unusual: float, known: Mask
) -> Iterator[_Stretch]:
    recording, logs = corrections.recording, corrections.recording.logs
    mine = np.flatnonzero(recording.owner == run)
    mine = mine[np.argsort(recording.start[mine])]
    value, size = corrections.value[mine, k], size[mine]
    high = np.flatnonzero(size > ordinary)
    parts = np.split(high, np.flatnonzero(np.diff(high) > PAUSE) + 1)
    if sum(part[-1] + 1 - part[0] for part in parts) > MOST * len(mine):
        return
    first = recording.start[mine] - logs.offsets[run]
    last = first + recording.steps[mine]
    for part in parts:
        peak = part[np.argmax(size[part] * known[mine[part]])]
        if len(part) >= SHORTEST and size[peak] > unusual and known[mine[peak]]:
            start, end = logs.period * float(first[part[0]]), logs.period * float(last[part[-1]])
            square = float(np.sum(size[part] ** 2))
            yield _Stretch(corrections.places[k].name, run, start, end, float(value[peak]), square)


def _sentence(units: Mapping[str, str], logs: Logs, found: Sequence[_Stretch], alarm: bool) -> str:
    """When and where, with amounts, and what to do about it."""
    runs, each = sorted({stretch.run for stretch in found}), []
    for run in runs:
        mine = sorted((s for s in found if s.run == run), key=lambda s: -abs(s.effort))
        told = [
            f"{quantity(s.effort, units[s.port])} at {s.port} from {on_clock(s.start, logs.clock)} "
            f"to {on_clock(s.end, logs.clock)}"
            for s in sorted(mine[:LISTED], key=lambda s: s.start)
        ]
        if len(mine) > LISTED:
            told.append(f"{len(mine) - LISTED} times more")
        each.append(f"{logs.ids[run]} needs {listed(told)}")
    if not alarm:
        return f"{'; '.join(each)}, more than other experiments need, and too little to make a gap"
    of = [level_name(name, level) for name, level, rows in levels(logs.experiments) if rows.tolist() == runs]
    these = f"These are the experiments in which {listed(of)}: " if of else ""
    it = "what they share may need it. Otherwise it" if of else "It"
    return (
        f"{'; '.join(each)}: other experiments have such motions and inputs, but none needs so much. "
        f"{these}{it} looks like an outside force, such as a push or a contact. "
        "Leave these times out (t_from, t_to), or log the force as an input, then diagnose again."
    )
