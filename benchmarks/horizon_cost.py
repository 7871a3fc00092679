"""The cost of a longer horizon: time of a mini-batch against its number N of integration steps."""

from __future__ import annotations

import statistics
from functools import partial

import numpy as np

from benchmarks.slider_crank import epoch, problem, settings
from benchmarks.timing import compared, seconds
from unmodelled.learning.windows import Progress

HORIZONS = (1, 10, 30, 100, 300)
STEPS = 6000  # of every horizon: 6000 / N mini-batches
PEER = "the same number of steps in windows of N = 10"


def run() -> dict[str, float]:
    """Slider-crank, F = eta(d, v) with 32 hidden units, batch 200, Euler, one thread.

    ours and peer: seconds of all steps with N = 300 and N = 10. slope: of log time of a mini-batch over
    log N, 1 where a horizon costs as many times more as it is longer. steepest: the largest between
    neighbours, for the fixed cost of a mini-batch may hide what grows faster. Medians over the rounds.
    """
    work = {}
    for N in HORIZONS:
        task = problem(N, STEPS // N)
        work[N] = partial(epoch, task, settings(N), Progress.start(task.model, 0))
        work[N]()
    rounds = [{N: seconds(work[N]) for N in HORIZONS} for _ in range(5)]
    slopes = [_slopes(times) for times in rounds]
    return {
        **compared([(times[300], times[10]) for times in rounds]),
        "slope": statistics.median(slope for slope, _ in slopes),
        "steepest": statistics.median(steepest for _, steepest in slopes),
        "threads": 1,
    }


def _slopes(times: dict[int, float]) -> tuple[float, float]:
    """Over all horizons, and the largest between neighbours."""
    N = np.log(list(times))
    per_batch = np.log([time / (STEPS // N) for N, time in times.items()])
    return float(np.polyfit(N, per_batch, 1)[0]), float(np.max(np.diff(per_batch) / np.diff(N)))
