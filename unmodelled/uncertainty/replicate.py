"""Repeated identification on many data sets, and the scatter of the estimates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.progress import Counter
from unmodelled.uncertainty.identify import Identification


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


@dataclass(frozen=True)
class EstimateScatter:
    """Scatter of the estimates from many data sets."""

    alphas: Array  # (R, k), one row per data set
    mean: Array  # (k,)
    std: Array  # (k,)
    correlation: Array  # (k, k); zero with a parameter that never changes
    at_bound: Array  # (k,), share of the data sets whose estimate lies on a bound
    converged: float  # share of the searches that converged

    def interval(self, level: float = 0.95) -> Array:
        """Return percentile intervals (k, 2) of the estimates."""
        if not 0.0 < level < 1.0:
            raise BadInput(f"level must lie between 0 and 1, got {level:g}")
        outside = 0.5 * (1.0 - level)
        return np.asarray(np.quantile(self.alphas, [outside, 1.0 - outside], axis=0).T)


def summarise_estimates(found: Sequence[Identification]) -> EstimateScatter:
    """Summarise the estimates from many data sets."""
    if len(found) < 2:
        raise BadInput(f"the scatter of estimates needs at least 2 data sets, got {len(found)}")
    alphas = np.array([f.alpha for f in found])
    mean, std = alphas.mean(0), alphas.std(0, ddof=1)
    standard = (alphas - mean) / np.where(std > 0.0, std, 1.0)
    correlation = standard.T @ standard / (len(alphas) - 1)
    np.fill_diagonal(correlation, 1.0)
    at_bound = np.mean([f.at_bound for f in found], axis=0)
    return EstimateScatter(
        alphas, mean, std, correlation, at_bound, float(np.mean([f.converged for f in found]))
    )
