"""Repeated identification on many data sets, and the scatter of the estimates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import ExitStack

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.progress import Counter
from unmodelled.uncertainty.identify import Identification

LEVEL = 0.95  # of the percentile intervals


def replicate(
    data: Sequence[Array],
    identify_one: Callable[[Array, int], Identification],
    seed: int,
    workers: int,
    description: str | None = None,
) -> list[Identification]:
    """Identify each of many data sets (L,); with data of an identified model, the parametric bootstrap.

    The result does not depend on `workers`, because every data set has its own seed. The workers are threads;
    compiled objectives run in parallel if they release Python's global lock (`nogil`).
    """
    count = len(data)
    if count < 1 or workers < 1:
        raise BadInput(f"data sets and workers must be at least 1 each, got {count} and {workers}")
    seeds = [int(own.generate_state(1)[0]) for own in np.random.SeedSequence(seed).spawn(count)]
    with ExitStack() as stack:
        counter = stack.enter_context(Counter(count, description)) if description else None
        pool = stack.enter_context(ThreadPoolExecutor(workers))
        jobs = [pool.submit(identify_one, y, own) for y, own in zip(data, seeds, strict=True)]
        try:
            for done, job in enumerate(as_completed(jobs), start=1):
                job.result()
                if counter:
                    counter.update(done)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [job.result() for job in jobs]


def estimate_intervals(found: Sequence[Identification]) -> Array:
    """Return percentile intervals (k, 2) of the estimates from many data sets."""
    if len(found) < 2:
        raise BadInput(f"the scatter of estimates needs at least 2 data sets, got {len(found)}")
    outside = 0.5 * (1.0 - LEVEL)
    return np.asarray(np.quantile([f.alpha for f in found], [outside, 1.0 - outside], axis=0).T)
