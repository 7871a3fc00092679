"""Outputs that are computed from another output's samples or are a command, registers, and ends of ranges."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.linalg import lstsq
from threadpoolctl import threadpool_limits

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.result import LogFault
from unmodelled.logs.differentiate import noise
from unmodelled.logs.inspection.clipped import clipped_of
from unmodelled.logs.inspection.register import register_of
from unmodelled.logs.inspection.signal import Run, signals_of
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

#: Residual of a filter that computes an output from another one, at most [share of the filtered noise].
COPIED_NOISE = 0.1
#: Name of the problem that an output is computed from another one.
COPY = "copy"
#: Names of the problems that an output is an input, that a channel is a register, and that its sensor ends.
COMMAND, REGISTER, CLIPPED = "command", "register", "clipped"
#: Constant beside a multiple of an input that is told, as a share of the largest value.
MATTERS = 1e-3
#: Largest numbers of samples before and after that a filter reads: a low-pass remembers longer than a
#: smoothing filter looks ahead. Neither is more than this share of the shortest experiment.
BEFORE, AFTER, LONGEST_SHARE = 60, 20, 0.2
#: Largest number of predicted samples, and smallest number per tap.
MOST_PREDICTED, PER_TAP = 4000, 3
#: Smallest singular value of the source's samples that is used, as a share of the largest.
CONDITION = 1e-10
#: A sum of taps is zero below the first share of the sum of their sizes; taps below the second share of the
#: largest tap do not count for the span of the filter.
ZERO_SUM, SMALL_TAP = 0.01, 0.05


@dataclass(frozen=True)
class Copy:
    """An output that is computed from another one."""

    target: int  # number of the computed output
    source: int  # number of the output that it is computed from
    slope: bool  # whether it is the derivative of the source
    delay: float  # s
    span: int  # samples that the filter reads


def copies(logs: Logs) -> tuple[Copy, ...]:
    """Find outputs that a short linear filter of another output predicts down to rounding.

    A second sensor does not have the noise of the first one, so that the filtered noise remains in the
    residual. Of two outputs that predict each other, the later one is the copy.
    """
    found: dict[int, Copy] = {}
    with threadpool_limits(1):  # in matrices as small as these, threads mostly wait for each other
        every = [copy for source in range(len(logs.outputs)) for copy in _copies_of(logs, source)]
    for copy in every:
        back = found.get(copy.source)
        if copy.target in found or (
            back is not None and back.source == copy.target and back.delay >= copy.delay
        ):
            continue
        if back is not None and back.source == copy.target:
            del found[copy.source]
        found[copy.target] = copy
    return tuple(found.values())


def _copies_of(logs: Logs, source: int) -> Iterator[Copy]:
    """Yield the outputs that are computed from a source."""
    targets = [j for j in range(len(logs.outputs)) if j != source]
    filters = _filters(logs, source, targets)
    parts = [logs.y[logs.rows(i), source] for i in range(len(logs))]
    white = float(np.sqrt(np.mean([noise(part) ** 2 for part in parts]))) if filters else 0.0
    for target, taps, residual in filters:
        if residual < COPIED_NOISE * white * float(np.linalg.norm(taps)):
            yield from filter(None, [_copy(logs, source, target, taps)])


def _reach(logs: Logs) -> tuple[int, int]:
    """Return the numbers of samples that a filter reads before and after a sample."""
    longest = int(LONGEST_SHARE * np.diff(logs.offsets).min())
    return min(BEFORE, longest), min(AFTER, longest)


def _copy(logs: Logs, source: int, target: int, taps: Array) -> Copy | None:
    """Return kind and delay of a filter, from its response to a constant, a ramp and a parabola."""
    k = np.arange(len(taps)) - _reach(logs)[1]  # samples by which a tap is late
    period = logs.period
    large = np.flatnonzero(np.abs(taps) > SMALL_TAP * np.abs(taps).max())
    span = int(large[-1] - large[0] + 1)
    total, first, second = float(taps.sum()), float(k @ taps), float(k**2 @ taps)
    if abs(total) > ZERO_SUM * np.abs(taps).sum():
        return Copy(target, source, False, period * first / total, span)
    if abs(first) > ZERO_SUM * np.abs(k * taps).sum():
        return Copy(target, source, True, 0.5 * period * second / first, span)
    return None


def _filters(logs: Logs, source: int, targets: Sequence[int]) -> list[tuple[int, Array, float]]:
    """Return targets, taps that predict them from the source, early to late, and residual deviations."""
    before, after = _reach(logs)
    width, every = before + 1 + after, -(-len(logs.y) // MOST_PREDICTED)
    known, wanted = [], []
    for i in range(len(logs)):
        y = logs.y[logs.rows(i)]
        # a late tap reads an early sample
        known.append(sliding_window_view(y[:, source], width)[::every, ::-1])
        wanted.append(y[before : len(y) - after : every, targets])
    x, y = np.concatenate(known), np.concatenate(wanted)
    if not targets or len(y) < PER_TAP * width:
        return []
    x, y = x - logs.y[:, source].mean(), y - y.mean(axis=0)
    x = np.column_stack([x, np.full(len(x), x.std())])
    found = lstsq(x, y, cond=CONDITION, lapack_driver="gelsy")[0]
    left = np.sqrt(np.sum((y - x @ found) ** 2, axis=0) / (len(y) - width - 1))
    return [(j, found[:-1, n], float(left[n])) for n, j in enumerate(targets)]


def notes(logs: Logs, found: tuple[Copy, ...]) -> Iterator[LogFault]:
    """Yield a fault for every copy; it decides nothing."""
    for copy in found:
        name, of = logs.outputs[copy.target], logs.outputs[copy.source]
        yield LogFault(
            *((name,), COPY, None, ()),
            sentence=f"{name} is computed from {of}: {_how(copy)}. It is not a second sensor and was left "
            "out of the outputs.",
            decides=False,
        )


def command_notes(logs: Logs, found: Mapping[int, int], alone: bool) -> Iterator[LogFault]:
    """Yield a fault for every output that is an input; it decides where no other output is left."""
    rest = "Name the column with the measurement, then diagnose again." if alone else "It was left out."
    for output, command in found.items():
        name, of = logs.outputs[output], logs.inputs[command]
        factor, constant = np.polyfit(logs.u[:, command], logs.y[:, output], 1).tolist()
        plus = abs(constant) > MATTERS * float(np.abs(logs.y[:, output]).max())
        more = f" plus {constant:.3g}" if plus else ""
        said = f"{name} is the input {of} times {factor:.3g}{more} in all samples, and no measurement."
        yield LogFault((name,), COMMAND, None, (), sentence=f"{said} {rest}", decides=alone)


def register_notes(system: System, logs: Logs) -> Iterator[LogFault]:
    """Yield a fault, which decides, for every register that was not decoded as the logs were read."""
    columns = dict(zip((*logs.inputs, *logs.outputs), (*logs.u.T, *logs.y.T), strict=True))
    for signal in signals_of(system):
        found = register_of([columns[signal.name][logs.rows(i)] for i in range(len(logs))], signal)
        if found is not None:
            said = (
                f"{signal.name} jumps by {found.counts} counts where it would change its sign: {found.words}."
            )
            cure = "Log the signed number, or leave out cure: false in the mapping, then diagnose again."
            yield LogFault((signal.name,), REGISTER, None, (), sentence=f"{said} {cure}", decides=True)


def clipped_notes(system: System, logs: Logs) -> Iterator[LogFault]:
    """Yield a fault, which decides, for every input and position whose sensor ends too early."""
    columns = dict(zip((*logs.inputs, *logs.outputs), (*logs.u.T, *logs.y.T), strict=True))
    signals = signals_of(system)
    runs = [
        Run(name, logs.t[rows], {s.column: columns[s.name][rows] for s in signals}, signals, {})
        for name, rows in zip(logs.ids, map(logs.rows, range(len(logs))), strict=True)
    ]
    for signal in signals:
        found = clipped_of(runs, signal)
        if found is None or not found.cuts or not found.sure:
            continue
        ids = tuple(run.name for run, rows in zip(runs, found.rows, strict=True) if rows.any())
        sentence = (
            f"{signal.name} {found.share}, as a sensor whose range ends there: what lies beyond is unknown, "
            "and too little remains without these samples. Measure with a larger range, then diagnose again."
        )
        every = len(ids) == len(runs)
        yield LogFault((signal.name,), CLIPPED, None, () if every else ids, sentence=sentence, decides=True)


def _how(copy: Copy) -> str:
    kind = "difference" if copy.slope else "filter"
    over = f"{kind} over {copy.span} samples, " if copy.span > 1 else ""
    late = f"{abs(1e3 * copy.delay):.3g} ms {'late' if copy.delay >= 0.0 else 'early'}"
    return over + (late if abs(copy.delay) > 1e-6 else "without delay")
