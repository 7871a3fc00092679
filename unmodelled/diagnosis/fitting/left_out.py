"""Predictions of experiments that took no part in fitting: leave one out by one Newton step.

At the optimum of a fit, the normal equations without the windows of one experiment give the step to the
optimum without this experiment. One simulation of all windows, every experiment with the numbers fitted
without it, replaces one fit per experiment.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.fitting.residuals import Errors
from unmodelled.diagnosis.fitting.unknowns import Unknowns

#: Smallest number of parts that are left out or compared; fewer experiments are divided. Every experiment is
#: divided into as many blocks, of which a part has one, two, three or all.
FEWEST_PARTS = 6
#: Blocks of an experiment with numbers of its own: one is predicted with the numbers of the other.
HALVES = 2
#: Relative damping of the steps: numbers that only together are determined, such as the frictions of two
#: similar laws, must not move apart and be cut at their bounds, nor a number that all experiments share and
#: their own ones. Well determined numbers move 0.1 % less.
LEAST_DAMPING = 1e-3
#: Share of the curvature of an amplitude below which the other experiments do not determine it.
UNKNOWN_SHARE = 0.01


@dataclass(frozen=True, eq=False)
class LeftOut:
    """A fitted hypothesis that predicts each part of the data with numbers fitted without this part."""

    fitted: FittedHypothesis
    part: Indices  # number of the left-out part of every window, (windows,)
    values: Array  # fitted vectors without each part, (parts, entries), in units of the vector
    #: Square errors (2, windows, outputs) in noise variances: from measured starts, then from fitted ones.
    squares: Array

    @classmethod
    def of(cls, fitted: FittedHypothesis, part: Indices | None = None) -> LeftOut:
        """Leave out one part after the other; part of every window (windows,)."""
        recording, fit, unknowns = fitted.recording, fitted.fit, fitted.unknowns
        if part is None and fitted.is_own:
            part = parts(recording, HALVES * len(recording.runs))
        part = _known_by_others(fitted, parts(recording)) if part is None else part
        z = fitted.vector(unknowns)
        values = _values(fitted, part, z)
        moved, sigma = fitted.moved(recording)
        _, _, follow = fit.normal.reduced()
        change = (values[part] - z)[np.arange(len(part))[:, None], unknowns.entry]
        there = moved + (follow[:, :, :-1] @ change[:, :, None])[:, :, 0]
        numbers, chosen = _numbers(unknowns, values, part)
        sets, rows = numbers.shape[1], np.arange(len(part))
        starts = np.stack([np.zeros_like(moved), there], axis=1).repeat(sets, axis=1)
        r = Errors(unknowns, sigma, fit.substeps).of_numbers(np.tile(numbers, (1, 2, 1)), starts)
        squares = [np.einsum("wkj,wkj->wj", one, one) for one in (r[rows, chosen], r[rows, chosen + sets])]
        return cls(fitted, part, values, np.stack(squares))

    @property
    def count(self) -> int:
        """Return the number of parts; with own numbers that of experiments, each left out as a whole."""
        runs = len(np.unique(self.fitted.recording.owner))
        return runs if self.fitted.is_own else len(self.values)

    def score(self, runs: Sequence[int] | None = None) -> Array:
        """Return the mean (parts,) over outputs of `scores`, nats."""
        return np.asarray(self.scores(runs).mean(1))

    def scores(self, runs: Sequence[int] | None = None) -> Array:
        """Return the logarithm of the mean square error plus one, mean over starts: (parts, outputs), nats.

        The parts are those of `parts` for the given experiments, however the windows were left out: scores of
        hypotheses that were fitted to the same windows can be compared part by part.
        """
        squares, samples = self._blocks
        if runs is not None:
            mine = np.isin(np.unique(self.fitted.recording.owner), runs)
            squares, samples = squares[:, mine], samples[mine]
        width = FEWEST_PARTS // divided(len(samples))
        total = squares.reshape(2, -1, width, squares.shape[-1]).sum(2)
        count = samples.reshape(-1, width).sum(1)
        there = count > 0.0
        return np.asarray(np.log1p(total[:, there] / count[there, None]).mean(0))

    @cached_property
    def _blocks(self) -> tuple[Array, Array]:
        """Squares (2, experiments, blocks, outputs) and numbers of samples (experiments, blocks)."""
        block, recording = blocks(self.fitted.recording), self.fitted.recording
        count = FEWEST_PARTS * len(np.unique(recording.owner))
        columns = np.moveaxis(self.squares, 1, 2).reshape(-1, len(block))
        total: Array = np.stack([np.bincount(block, column, count) for column in columns])
        total = np.moveaxis(total.reshape(2, -1, count), 1, 2)
        samples = np.asarray(np.bincount(block, recording.steps, count), np.float64)
        return total.reshape(2, -1, FEWEST_PARTS, total.shape[2]), samples.reshape(-1, FEWEST_PARTS)


def divided(experiments: int, fewest: int = FEWEST_PARTS) -> int:
    """Return the number of parts of every experiment: 1, 2, 3 or 6."""
    return next((d for d in (1, 2, 3) if d * experiments >= fewest), FEWEST_PARTS)


def blocks(recording: Recording) -> Indices:
    """Return the block (windows,) of every window: each experiment has `FEWEST_PARTS` contiguous ones."""
    found = np.empty(len(recording.start), np.int64)
    for k, run in enumerate(np.unique(recording.owner)):
        mine = np.flatnonzero(recording.owner == run)
        mine = mine[np.argsort(recording.start[mine])]
        found[mine] = FEWEST_PARTS * k + FEWEST_PARTS * np.arange(len(mine)) // len(mine)
    return found


def parts(recording: Recording, fewest: int = FEWEST_PARTS) -> Indices:
    """Return the part (windows,) of every window: its experiment, or some blocks if experiments are few."""
    width = FEWEST_PARTS // divided(len(np.unique(recording.owner)), fewest)
    return _numbered(blocks(recording) // width)


def _numbered(part: Indices) -> Indices:
    return np.unique(part, return_inverse=True)[1].astype(np.int64)


def _known_by_others(fitted: FittedHypothesis, part: Indices) -> Indices:
    """Parts, of which those that alone determine an amplitude are divided into their blocks."""
    normal = fitted.fit.normal
    each = np.zeros((int(part.max()) + 1, len(normal.precision)))
    curvature, _, _ = normal.reduced()
    np.add.at(each, (part[:, None], normal.entry), np.diagonal(curvature, axis1=1, axis2=2))
    whole = each.sum(0)
    alone = (_shared_amplitudes(fitted) & (whole - each < UNKNOWN_SHARE * whole)).any(1)
    return _numbered(np.where(alone[part], int(part.max()) + 1 + blocks(fitted.recording), part))


def _values(fitted: FittedHypothesis, part: Indices, z: Array) -> Array:
    """Vectors (parts, entries) of fits without each part."""
    unknowns, normal = fitted.unknowns, fitted.fit.normal
    owner = unknowns.simulation.recording.owner
    each = [unknowns.each[k] for k in unknowns.unknown]
    start = np.array([u.start for u in each], bool)
    switch, own = _shared_amplitudes(fitted), np.array([u.own for u in each], bool) & ~start
    curvature, gradient, _ = normal.reduced()
    H = normal.summed(curvature, gradient)[0]
    whole, follow = np.diag(H), -np.linalg.pinv(H[np.ix_(start, start)]) @ H[np.ix_(start, ~start)]
    everything, _ = normal.step(LEAST_DAMPING, z, unknowns.bounds)
    found = []
    for k in range(int(part.max()) + 1):
        mine = part == k
        # an experiment with numbers of its own takes no part in fitting the shared ones
        others = ~np.isin(owner, owner[mine]) if own.any() else ~mine
        some = replace(normal, gram=normal.gram[others], entry=normal.entry[others])
        step = some.step(LEAST_DAMPING, z, unknowns.bounds)[0] - everything
        step[own] = 0.0
        if own.any():
            rest = ~mine & ~others
            H, g = normal.summed(curvature * rest[:, None, None], gradient * rest[:, None])
            seen = own & (np.diag(H) > UNKNOWN_SHARE * whole)
            step[seen] = -(g + H @ step)[seen] / np.diag(H)[seen]
        # where hidden states start is fitted to the predicted experiment, as the measured states are
        step[start] = follow @ step[~start]
        there = np.clip(z + step, *unknowns.bounds)
        left = np.diag(some.summed(curvature[others], gradient[others])[0])
        there[switch & (left < UNKNOWN_SHARE * whole)] = 0.0
        if own.any():
            there[own & ~seen & np.isin(np.arange(len(z)), normal.entry[mine])] = 0.0
        found.append(there)
    return np.stack(found)


def _shared_amplitudes(fitted: FittedHypothesis) -> Mask:
    """Entries (entries,) that are amplitudes of effects and shared by all experiments."""
    names = {n for e in fitted.hypothesis.effects for n in e.amplitudes}
    unknowns = [fitted.unknowns.each[k] for k in fitted.unknowns.unknown]
    return np.array([u.name in names and not u.own for u in unknowns], bool)


def _numbers(unknowns: Unknowns, values: Array, part: Indices) -> tuple[Array, Indices]:
    """Parameter sets (experiments, sets, numbers), and the set of every window."""
    owner = unknowns.simulation.recording.owner
    chosen = np.zeros(len(part), np.int64)
    parts_of: dict[int, list[int]] = {}
    for run in np.unique(owner).tolist():
        mine = np.unique(part[owner == run])
        chosen[owner == run] = np.searchsorted(mine, part[owner == run])
        parts_of[run] = mine.tolist()
    sets = max(map(len, parts_of.values()))
    all_numbers = unknowns.numbers(values)
    numbers = all_numbers[:, :1].repeat(sets, axis=1)
    for run, some in parts_of.items():
        numbers[run] = all_numbers[run][[*some, *[some[-1]] * (sets - len(some))]]
    return numbers, chosen
