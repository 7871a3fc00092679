"""Verdicts on claims, and statistical tests for orders, trends and equivalence.

A sample is one independent draw: a training from its own initial weights, a held-out run or a data set. Each
sample has one number: the caller reduces repeats within a draw to their median. Every change of a rule is a
row of docs/results/changed_rules.md.
"""

from collections.abc import Sequence
from math import comb, factorial

import numpy as np

from pipeline.chapters.leaves import median_interval
from unmodelled.base.arrays import Array

HOLDS, DIRECTION, FAILS = "holds", "holds in direction", "does not hold"
UNTESTED, TOO_FEW = "cannot be tested on these data", "too few repeats"
#: Level of the one-sided tests, as usual.
LEVEL = 0.05
#: Largest ratio of two errors that are about equally large; the ratio of the first rule of section 6.5.1.
ALIKE = 1.5
#: Relative difference below which repeats of a deterministic model differ by rounding alone.
ROUNDING = 1e-9


def order_verdict(larger: Array, smaller: Array, paired: bool = False) -> str:
    """Return the verdict on the claim that the numbers `larger` are larger than the numbers `smaller`.

    Independent samples are compared by a Mann-Whitney test, pairs by a Wilcoxon signed-rank test of their
    differences, both one-sided at 5 %. A deterministic model (least squares, an identified motor) always
    gives the same number: its copies count once, and the differences between the other numbers and this
    number are tested like pairs. The claim holds in direction if only the median supports it. There are too
    few repeats if even complete separation would not reach 5 %, as with four pairs, or with three numbers
    against three.

    Takes larger (samples,), smaller (samples,).
    """
    from scipy.stats import mannwhitneyu, wilcoxon

    if not paired:
        larger, smaller = _without_copies(larger), _without_copies(smaller)
    if paired or 1 in (len(larger), len(smaller)):
        difference = larger - smaller
        if too_few(len(difference)):
            return TOO_FEW
        if np.median(difference) <= 0.0:
            return FAILS
        return _decided(wilcoxon(difference, alternative="greater").pvalue)
    if 1.0 / comb(len(larger) + len(smaller), len(larger)) >= LEVEL:
        return TOO_FEW
    if np.median(larger) <= np.median(smaller):
        return FAILS
    return _decided(mannwhitneyu(larger, smaller, alternative="greater").pvalue)


def too_few(pairs: int) -> bool:
    """Tell whether no test of so many pairs can reach the level; numbers against a constant are pairs."""
    return 0.5**pairs >= LEVEL


def falling_verdict(levels: Array, values: Array) -> tuple[str, float]:
    """Return the verdict on the claim that values fall with rising levels, and Spearman's rank correlation.

    The test is exact, over all orders of the values, one-sided at 5 %.

    Takes levels (samples,), values (samples,).
    """
    from scipy.stats import permutation_test, spearmanr

    def correlation(order: Array) -> float:
        return float(spearmanr(levels, order).statistic)

    if 1.0 / factorial(len(levels)) >= LEVEL:
        return TOO_FEW, correlation(values)
    test = permutation_test(
        (values,), correlation, permutation_type="pairings", alternative="less", n_resamples=np.inf
    )
    # a correlation that is not a number, of values that are all alike, is no trend either
    verdict = _decided(test.pvalue) if test.statistic < 0.0 else FAILS
    return verdict, float(test.statistic)


def alike_verdict(samples: Sequence[Array]) -> tuple[str, float, list[float]]:
    """Return the verdict on the claim that errors are about equally large, the largest ratio, and its limits.

    The test is for equivalence, not for the lack of a difference. The claim holds if even the upper limit of
    the ratio between the largest and the smallest median is below `ALIKE`; this limit is the upper 95 % limit
    of the largest median divided by the lower 95 % limit of the smallest. The claim holds in direction if
    only the ratio of the medians is below `ALIKE`. Fewer than six repeats are too few, because no interval of
    a median reaches 95 % then.

    Takes samples (repeats,).
    """
    medians = [float(np.median(own)) for own in samples]
    largest, smallest = int(np.argmax(medians)), int(np.argmin(medians))
    (low, high), (lowest, highest) = (median_interval(samples[k]) for k in (largest, smallest))
    ratio, limits = medians[largest] / medians[smallest], [max(low / highest, 1.0), high / lowest]
    if 2.0 * 0.5 ** min(map(len, samples)) >= LEVEL:
        return TOO_FEW, ratio, limits
    return HOLDS if limits[1] < ALIKE else DIRECTION if ratio < ALIKE else FAILS, ratio, limits


def worst(*verdicts: str) -> str:
    """Return the verdict on a claim that consists of several claims: the worst of their verdicts."""
    return max(verdicts, key=[HOLDS, DIRECTION, TOO_FEW, FAILS].index)


def _decided(pvalue: float) -> str:
    return HOLDS if pvalue < LEVEL else DIRECTION


def _without_copies(values: Array) -> Array:
    """The values, or the first one where all others are equal to it."""
    return values[:1] if np.allclose(values, values[0], rtol=ROUNDING, atol=0.0) else values
