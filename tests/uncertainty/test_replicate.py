"""Identification of many data sets: determinism, scatter and coverage."""

from __future__ import annotations

import time

import numpy as np
import pytest
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.identify import Identification, Settings, identify
from unmodelled.uncertainty.profile import profile
from unmodelled.uncertainty.replicate import coverage, replicate, summarise_estimates

Array = NDArray[np.float64]
TRUTH = np.array([0.9, 0.05])
COUNT = 25
BOX = np.array([[0.7, 1.3], [0.005, 0.3]])


def drawn(count: int, seed: int) -> list[Array]:
    """Data sets, the first of which do not depend on their number."""
    return [np.random.default_rng([seed, k]).normal(TRUTH[0], TRUTH[1], COUNT) for k in range(count)]


class Likelihood:
    """Of a normal sample."""

    def __init__(self, y: Array) -> None:
        self.y = y

    def __call__(self, alphas: Array) -> Array:
        mu, sigma = alphas[:, :1], alphas[:, 1:]
        return np.sum(-0.5 * ((self.y - mu) / sigma) ** 2 - np.log(sigma), axis=1)


def identify_one(y: Array, seed: int) -> Identification:
    return identify(Likelihood(y), BOX, Settings(population=8), seed)


def test_result_does_not_depend_on_the_number_of_workers() -> None:
    one, three = (replicate(drawn(7, 5), identify_one, seed=5, workers=w) for w in (1, 3))
    for a, b in zip(one, three, strict=True):
        assert a.alpha.tobytes() == b.alpha.tobytes()
        assert a.trace.tobytes() == b.trace.tobytes()
    assert len({a.alpha.tobytes() for a in one}) == 7
    more = replicate(drawn(9, 5), identify_one, seed=5, workers=2)
    assert [a.alpha.tolist() for a in more[:7]] == [a.alpha.tolist() for a in one]
    other = replicate(drawn(1, 6), identify_one, seed=6, workers=1)
    assert not np.array_equal(other[0].alpha, one[0].alpha)


@pytest.mark.long
def test_scatter_and_coverage_of_a_normal_sample() -> None:
    samples: dict[float, Array] = {}

    def remembering(y: Array, seed: int) -> Identification:
        found = identify_one(y, seed)
        samples[float(found.alpha[0])] = y
        return found

    found = replicate(drawn(120, 1), remembering, seed=1, workers=2)
    seen = summarise_estimates(found)
    expected = TRUTH[1] / np.sqrt([COUNT, 2.0 * COUNT])
    np.testing.assert_allclose(seen.std, expected, rtol=0.2)
    np.testing.assert_allclose(seen.mean, TRUTH, atol=4.0 * expected.max() / np.sqrt(120))
    assert abs(seen.correlation[0, 1]) < 0.3
    np.testing.assert_allclose(
        seen.interval(), np.quantile(seen.alphas, [0.025, 0.975], axis=0).T, rtol=1e-12
    )
    assert seen.converged == 1.0 and not seen.at_bound.any()
    intervals = [profile(Likelihood(samples[float(f.alpha[0])]), BOX, f.alpha).intervals for f in found[:60]]
    held = coverage(intervals, TRUTH)
    assert np.all((held > 0.85) & (held <= 1.0))


def test_coverage_counts_open_sides() -> None:
    intervals = [[[0.0, 1.0], [-np.inf, 0.5]], [[0.6, 1.0], [0.6, np.inf]], [[0.5, 0.5], [-np.inf, np.inf]]]
    np.testing.assert_allclose(coverage(intervals, [0.5, 0.55]), [2 / 3, 1 / 3])


def test_scatter_with_a_parameter_that_never_moves() -> None:
    found = [
        Identification(np.array([x, 1.0, -x]), 0.0, 1, np.zeros(1), x > 0.1, np.array([False, True, x > 0.3]))
        for x in (0.1, 0.2, 0.4, 0.3)
    ]
    seen = summarise_estimates(found)
    np.testing.assert_allclose(seen.correlation, [[1, 0, -1], [0, 1, 0], [-1, 0, 1]], atol=1e-12)
    np.testing.assert_allclose(seen.at_bound, [0.0, 1.0, 0.25])
    assert seen.converged == 0.75


def test_failure_of_one_data_set_ends_the_work() -> None:
    calls: list[int] = []

    def failing(y: Array, seed: int) -> Identification:
        calls.append(seed)
        time.sleep(1e-3)  # gives the thread that waits for the failure time to see it
        raise BadInput("data set cannot be used")

    with pytest.raises(BadInput, match="data set cannot be used"):
        replicate(drawn(2000, 0), failing, seed=0, workers=1)
    assert len(calls) < 2000


def test_impossible_numbers_are_refused() -> None:
    for count, workers in ((0, 1), (1, 0)):
        with pytest.raises(BadInput, match="at least 1"):
            replicate(drawn(count, 0), identify_one, seed=0, workers=workers)
    found = replicate(drawn(2, 0), identify_one, seed=0, workers=1)
    with pytest.raises(BadInput, match="level"):
        summarise_estimates(found).interval(1.0)
    with pytest.raises(BadInput, match="at least 2"):
        summarise_estimates(found[:1])
