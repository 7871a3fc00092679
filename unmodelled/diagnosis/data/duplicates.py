"""Samples that are there twice: whole experiments, and parts of an output, whose noise never repeats."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from unmodelled.base.arrays import Array, Indices
from unmodelled.diagnosis.data.remark import listed
from unmodelled.diagnosis.data.result import LogFault
from unmodelled.logs.differentiate import noise
from unmodelled.logs.inspection.frozen import NOISY
from unmodelled.logs.logs import Logs

#: Name of the problem that an output has the samples of another run, or of another time.
REPEATED = "repeated"
#: Samples that two parts have in common at least: of outputs with noise, ten are equal only once.
FEWEST_EQUAL = 10
#: Smallest share of different values of an output that no converter rounds to steps.
DIFFERENT = 0.9
#: Different experiments at least: one to fit, and one that is held out.
FEWEST_DIFFERENT = 2


def identical(logs: Logs) -> list[list[int]]:
    """Return the numbers of the experiments in groups of equal outputs and inputs."""
    found: dict[bytes, list[int]] = {}
    for i in range(len(logs)):
        rows = logs.rows(i)
        found.setdefault(logs.y[rows].tobytes() + logs.u[rows].tobytes(), []).append(i)
    return list(found.values())


def different(logs: Logs) -> Logs:
    """Return the logs with the first experiment of each group of identical ones."""
    groups = identical(logs)
    return logs if len(groups) == len(logs) else logs.among([group[0] for group in groups])


def duplicates(logs: Logs) -> tuple[LogFault, ...]:
    """Return a fault for every group of identical experiments; it decides if no two different ones remain."""
    groups = identical(logs)
    few = len(groups) < FEWEST_DIFFERENT
    return tuple(
        LogFault(
            channels=("experiments",),
            problem="identical",
            explains=None,
            experiments=tuple(logs.ids[i] for i in group),
            sentence=_sentence([logs.ids[i] for i in group], few),
            decides=few,
        )
        for group in groups
        if len(group) > 1
    )


def _sentence(ids: Sequence[str], few: bool) -> str:
    same = f"The logs of {', '.join(ids[:-1])} and {ids[-1]} are identical, sample by sample"
    if few:
        return (
            f"{same}: a model would be judged on the data that it was fitted to. Add the log of "
            "another experiment, then diagnose again."
        )
    return f"{same}: only {ids[0]} is used. Check the file names in experiments.csv."


@dataclass(frozen=True)
class _Part:
    """Samples of an output that stand in the logs before."""

    output: int
    run: int
    source: int  # the other run; the same one, where the samples are those of another time
    start: int  # first sample, from the start of the run
    source_start: int
    length: int  # samples


def repeated(logs: Logs) -> Iterator[LogFault]:
    """Yield a fault for every output that has the samples of another run, or of another time of a run.

    The noise of a sensor does not repeat, so that outputs without noise tell nothing. Where all outputs are
    repeated in another run, the two are recordings that overlap: no fault of a column.
    """
    found = [part for j in range(len(logs.outputs)) for part in _repeated(logs, j)]
    places = {(p.run, p.source, p.start - p.source_start): 0 for p in found}
    for run, source, shift in places:
        same = [p for p in found if (p.run, p.source, p.start - p.source_start) == (run, source, shift)]
        names = tuple(dict.fromkeys(logs.outputs[p.output] for p in same))
        noisy = sum(_is_noisy(logs, j) for j in range(len(logs.outputs)))
        overlap = run != source and len(names) == noisy and _inputs_repeat(logs, same[0])
        longest = max(same, key=lambda p: p.length)
        yield _fault(logs, longest, names, overlap)


def _fault(logs: Logs, part: _Part, names: tuple[str, ...], overlap: bool) -> LogFault:
    run, source, period = logs.ids[part.run], logs.ids[part.source], logs.period
    began, before = (period * each for each in (part.start, part.source_start))
    of = f"{source} from {before:.4g} s on" if run != source else f"the same run from {before:.4g} s on"
    said = f"{listed(names)} of {run} {'has' if len(names) == 1 else 'have'} the samples of {of}"
    said += f", from {began:.4g} s on for {part.length * period:.4g} s, noise included"
    alike: tuple[tuple[tuple[str, ...], str], ...] = ()
    cure = "Check which column belongs to which run, and cut the repeated part, then diagnose again."
    if overlap:
        cure = "The recordings overlap: cut them, so that no sample is in two runs."
    ids = tuple(dict.fromkeys((run, source)))
    return LogFault(names, REPEATED, None, ids, f"{said}. {cure}", not overlap, alike)


def _is_noisy(logs: Logs, output: int) -> bool:
    """Return whether an output has noise in most runs, and hardly ever shows a value twice."""
    parts = [logs.y[logs.rows(i), output] for i in range(len(logs))]
    own = [noise(part) > NOISY * float(np.ptp(part)) for part in parts]
    values = [len(np.unique(part)) / len(part) for part in parts]
    return bool(np.median(own) == 1.0 and np.median(values) > DIFFERENT)


def _inputs_repeat(logs: Logs, part: _Part) -> bool:
    mine, other = (logs.u[logs.rows(i)] for i in (part.run, part.source))
    first, second = mine[part.start :][: part.length], other[part.source_start :][: part.length]
    return bool(np.array_equal(first, second))


def _repeated(logs: Logs, output: int) -> Iterator[_Part]:
    """Yield parts of an output, the longest ones at equal distance from their sources."""
    if not _is_noisy(logs, output):
        return
    at, before = _equal_windows(logs.y[:, output], logs.offsets)
    owner, source = logs.owner[at], logs.owner[before]
    since, of = at - logs.offsets[owner], before - logs.offsets[source]
    places = np.column_stack([owner, source, since - of])
    for run, from_run, shift in np.unique(places, axis=0).tolist():
        mine = np.sort(since[(places == (run, from_run, shift)).all(axis=1)])
        stretches = np.split(mine, np.flatnonzero(np.diff(mine) > 1) + 1)
        longest = max(stretches, key=len)
        start, length = int(longest[0]), len(longest) + FEWEST_EQUAL - 1
        yield _Part(output, run, from_run, start, start - shift, length)


def _equal_windows(values: Array, offsets: Indices) -> tuple[Indices, Indices]:
    """Return the first samples of windows that stand in the values (samples,) before, and where they do.

    Windows in which two neighbours are equal, as at rest, or that reach into the next run, do not count.
    """
    windows = sliding_window_view(np.ascontiguousarray(values).view(np.uint64), FEWEST_EQUAL)
    weights = np.random.default_rng(0).integers(1, 2**63, FEWEST_EQUAL, dtype=np.uint64) | np.uint64(1)
    keys = np.zeros(len(windows), np.uint64)
    for k, weight in enumerate(weights):
        keys += windows[:, k] * weight  # modulo 2**64
    moving = sliding_window_view(np.diff(values) != 0.0, FEWEST_EQUAL - 1).all(axis=1)
    inside = np.ones(len(windows), np.bool_)
    for end in offsets[1:-1].tolist():
        inside[max(0, end - FEWEST_EQUAL + 1) : end] = False
    rows = np.flatnonzero(moving & inside)
    _, first, which = np.unique(keys[rows], return_index=True, return_inverse=True)
    again = rows != rows[first][which]
    return rows[again], rows[first][which][again]
