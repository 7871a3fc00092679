"""Samples between the changes of an input that is logged more rarely than the outputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from unmodelled.base.arrays import Indices
from unmodelled.logs.logs import Logs

#: Fewest samples between the changes of an input that is logged rarely, fewest changes of a run, and smallest
#: distance of two changes, in their median; also the share of bends of a straight course at this distance.
FEWEST_BETWEEN, FEWEST_CHANGES, REGULAR = 5, 20, 0.6
#: Change of a slope, as a share of the largest one, that stamps with few digits make, and fewest slopes of a
#: run that far apart, of a motion that was read from a slower clock: a triangle has two.
SAME_SLOPE, FEWEST_SLOPES = 0.01, 10


def straight_pace(logs: Logs, item: int) -> float:
    """Return how many samples an input runs straight at a time, as if read from a slower clock; else 1."""
    slopes = [np.diff(logs.u[logs.rows(i), item]) for i in range(len(logs))]
    steps = [slope / (SAME_SLOPE * float(np.abs(slope).max(initial=1e-300))) for slope in slopes]
    bends = [np.flatnonzero(np.abs(np.diff(step)) > 1.0) for step in steps]
    bends = [at[np.diff(at, prepend=-2) > 1] for at in bends]  # a bend between two samples shows at both
    if (pace := regular_pace(bends)) is None:
        return 1.0
    often = float(np.mean(np.abs(np.concatenate([np.diff(at) for at in bends]) - pace) <= 1.0))
    few = any(len(np.unique(step[at].round())) < FEWEST_SLOPES for step, at in zip(steps, bends, strict=True))
    return 1.0 if few or often < REGULAR else pace


def regular_pace(changes: Sequence[Indices]) -> float | None:
    """Return the samples between changes (changes,) that are rare and regular in all runs, else None."""
    if any(len(at) < FEWEST_CHANGES for at in changes):
        return None
    pace = float(np.median(np.concatenate([np.diff(at) for at in changes])))
    regular = min(int(np.diff(at)[1:].min()) for at in changes) >= REGULAR * pace
    return pace if pace >= FEWEST_BETWEEN and regular else None
