"""Identification repeated on many data sets: how estimates scatter, how often intervals hold the truth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unmodelled.base.errors import BadInput
from unmodelled.base.progress import Counter
from unmodelled.uncertainty.identify import Identification

Array = NDArray[np.float64]


def replicate(
    data: Sequence[Array],
    identify_one: Callable[[Array, int], Identification],
    seed: int,
    workers: int,
    description: str | None = None,
) -> list[Identification]:
    """Identify each of many data sets; drawn from an identified model, this is the parametric bootstrap.

    The result does not depend on `workers`: every data set has its own seed. The workers are threads, as an
    objective holds its data and compiled code in closures; compiled objectives should release the interpreter
    (`nogil`) to run side by side.

    Args:
        data: the data sets.
        identify_one: identifies one, with a seed for its search.
        seed: of all searches.
        workers: data sets that are identified side by side.
        description: of the work, for a progress bar; without it there is none.

    Returns:
        One identification a data set, in their order.

    Raises:
        BadInput: when there is no data set, or workers is not positive.
    """
    count = len(data)
    if count < 1 or workers < 1:
        raise BadInput(f"data sets and workers must be at least 1, got {count} and {workers}")
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
class Scatter:
    """How the estimates of many data sets scatter.

    Attributes:
        alphas: (R, k) one estimate a data set.
        mean, std: (k,) of the estimates.
        correlation: (k, k) of the estimates; zero with one that never moves.
        at_bound: (k,) share of the data sets whose estimate lies on a bound.
        converged: share of the searches that converged.
    """

    alphas: Array
    mean: Array
    std: Array
    correlation: Array
    at_bound: Array
    converged: float

    def interval(self, level: float = 0.95) -> Array:
        """(k, 2) percentile intervals that hold the share `level` of the estimates.

        Raises:
            BadInput: when level is not between 0 and 1.
        """
        if not 0.0 < level < 1.0:
            raise BadInput(f"level must lie between 0 and 1, got {level:g}")
        outside = 0.5 * (1.0 - level)
        return np.asarray(np.quantile(self.alphas, [outside, 1.0 - outside], axis=0).T)


def scatter(found: Sequence[Identification]) -> Scatter:
    """What many identifications have in common.

    Raises:
        BadInput: when there are fewer than two.
    """
    if len(found) < 2:
        raise BadInput(f"the scatter of estimates needs at least 2 data sets, got {len(found)}")
    alphas = np.array([f.alpha for f in found])
    mean, std = alphas.mean(0), alphas.std(0, ddof=1)
    standard = (alphas - mean) / np.where(std > 0.0, std, 1.0)
    correlation = standard.T @ standard / (len(alphas) - 1)
    np.fill_diagonal(correlation, 1.0)
    at_bound = np.mean([f.at_bound for f in found], axis=0)
    return Scatter(alphas, mean, std, correlation, at_bound, float(np.mean([f.converged for f in found])))


def coverage(intervals: ArrayLike, truth: ArrayLike) -> Array:
    """(k,) share of intervals (R, k, 2) that hold the true parameters (k,); an open side is infinite."""
    low, high = np.moveaxis(np.asarray(intervals, float), -1, 0)
    return np.asarray(np.mean((low <= truth) & (truth <= high), axis=0))
