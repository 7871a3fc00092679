"""Maximum likelihood in a box, on likelihoods whose maximum is known; of one and of many data sets."""

import time
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.uncertainty.ascent import Objective, climb
from unmodelled.uncertainty.box import Box
from unmodelled.uncertainty.identify import Identification, Settings, identify
from unmodelled.uncertainty.profile import profile
from unmodelled.uncertainty.replicate import estimate_intervals, replicate

SAMPLE = np.random.default_rng(4).normal(0.9, 0.05, 60)
BOX = np.array([[0.7, 1.3], [0.005, 0.3]])

#: Means, then standard deviations, of two normal parameters.
TRUTH = np.array([0.91, 0.55, 0.081, 0.046])
RESPONSE_BOX = np.array([[0.7, 1.3], [0.4, 1.15], [0.005, 0.3], [0.005, 0.3]])


@dataclass(frozen=True)
class Likelihood:
    """Log-likelihood of a sample under a mean and a standard deviation."""

    y: Array

    def __call__(self, alphas: Array) -> Array:
        mu, sigma = alphas[:, :1], alphas[:, 1:]
        return np.sum(-0.5 * ((self.y - mu) / sigma) ** 2 - np.log(sigma) - 0.5 * np.log(2 * np.pi), axis=1)


gaussian = Likelihood(SAMPLE)


def linear_response(seed: int, count: int = 108) -> Objective:
    """Log-likelihood of data y_l = a_l theta_1 + b_l theta_2 with normal thetas, drawn at the truth."""
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(0.3, 1.0, count), rng.uniform(0.1, 1.2, count)
    y = a * rng.normal(TRUTH[0], TRUTH[2], count) + b * rng.normal(TRUTH[1], TRUTH[3], count)

    def objective(alphas: Array) -> Array:
        mu1, mu2, sigma1, sigma2 = (column[:, None] for column in alphas.T)
        variance = (sigma1 * a) ** 2 + (sigma2 * b) ** 2
        away = y - mu1 * a - mu2 * b
        return np.sum(-0.5 * away**2 / variance - 0.5 * np.log(2 * np.pi * variance), axis=1)

    return objective


def two_hills(alphas: Array) -> Array:
    """A lower maximum near 0.25, a higher one near 0.75."""
    x = alphas[:, 0]
    return np.log(np.exp(-0.5 * ((x - 0.25) / 0.1) ** 2) + 2.0 * np.exp(-0.5 * ((x - 0.75) / 0.1) ** 2))


def test_mean_and_standard_deviation_of_a_sample() -> None:
    found = identify(gaussian, BOX)
    expected = np.array([SAMPLE.mean(), SAMPLE.std()])
    np.testing.assert_allclose(found.alpha, expected, rtol=5e-4)
    assert found.log_likelihood == pytest.approx(gaussian(expected[None])[0], abs=1e-4)
    assert found.converged
    assert not found.at_bound.any()


def test_parameters_that_made_the_data_are_recovered() -> None:
    estimates = []
    for seed in range(8):
        objective = linear_response(seed)
        found = identify(objective, RESPONSE_BOX, seed=seed)
        assert found.converged
        assert found.log_likelihood >= objective(TRUTH[None])[0]
        estimates.append(found.alpha)
    error = np.abs(np.mean(estimates, 0) - TRUTH)
    assert np.all(error < 4.0 * np.std(estimates, 0, ddof=1) / np.sqrt(len(estimates)))
    assert np.all(error < [0.02, 0.02, 0.01, 0.015])


def test_noise_and_a_floor_do_no_harm() -> None:
    smooth = linear_response(3)

    def rough(alphas: Array) -> Array:
        return np.maximum(smooth(alphas), -100.0) + 1e-6 * np.sin(1e7 * alphas.sum(1))

    expected, found = identify(smooth, RESPONSE_BOX), identify(rough, RESPONSE_BOX)
    assert found.log_likelihood == pytest.approx(expected.log_likelihood, abs=1e-3)
    np.testing.assert_allclose(found.alpha, expected.alpha, rtol=2e-3)


def test_seed_decides_the_result() -> None:
    first, again, other = (identify(gaussian, BOX, seed=s) for s in (1, 1, 2))
    assert first.alpha.tobytes() == again.alpha.tobytes()
    assert first.trace.tobytes() == again.trace.tobytes()
    assert first.evaluations == again.evaluations
    assert not np.array_equal(first.trace, other.trace)
    np.testing.assert_allclose(first.alpha, other.alpha, rtol=1e-3)


@pytest.mark.parametrize("high", [1.3, 1.0])
def test_an_optimum_outside_of_the_bounds_ends_on_them_and_equal_bounds_hold(high: float) -> None:
    found = identify(gaussian, np.array([[1.0, high], [0.005, 0.3]]))
    assert found.at_bound.tolist() == [high > 1.0, False]
    assert found.alpha[0] == 1.0
    assert found.alpha[1] == pytest.approx(np.sqrt(np.mean((SAMPLE - 1.0) ** 2)), rel=5e-4)


def test_search_stays_inside_of_the_bounds_and_counts() -> None:
    batches: list[Array] = []

    def watched(alphas: Array) -> Array:
        batches.append(alphas.copy())
        return gaussian(alphas)

    found = identify(watched, BOX, Settings(population=20))
    every = np.vstack(batches)
    assert np.all((BOX[:, 0] <= every) & (every <= BOX[:, 1]))
    assert found.evaluations == len(every)
    assert found.log_likelihood == gaussian(every).max()
    best = np.maximum.accumulate([gaussian(b).max() for b in batches])
    np.testing.assert_array_equal(found.trace, best[: len(found.trace)])
    assert len(batches[0]) == 32


def test_generations_that_run_out_are_reported() -> None:
    found = identify(gaussian, BOX, Settings(generations=2))
    assert not found.converged
    assert len(found.trace) == 3


def test_global_maximum_is_found_next_to_a_local_one() -> None:
    box = np.array([[0.0, 1.0]])
    near, _ = climb(two_hills, Box(box), np.array([0.2]))
    assert near.alpha[0] == pytest.approx(0.25, abs=0.01)
    assert identify(two_hills, box).alpha[0] == pytest.approx(0.75, abs=0.01)


def test_climb_gets_over_kinks() -> None:
    def roof(alphas: Array) -> Array:
        return -20.0 * np.abs(alphas[:, 0] - 0.3) - 30.0 * np.abs(alphas[:, 1] - 0.6 * alphas[:, 0])

    peak, _ = climb(roof, Box(np.array([[0.0, 1.0], [0.0, 1.0]])), np.array([0.9, 0.1]))
    np.testing.assert_allclose(peak.alpha, [0.3, 0.18], atol=1e-4)


def test_climb_stays_where_no_neighbour_is_finite() -> None:
    def needle(alphas: Array) -> Array:
        return np.where(np.abs(alphas[:, 0] - 0.5) < 1e-5, 1.0, np.nan)

    peak, _ = climb(needle, Box(np.array([[0.0, 1.0]])), np.array([0.5]))
    assert peak.log_likelihood == 1.0


@pytest.mark.parametrize("hole", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_avoided(hole: float) -> None:
    def objective(alphas: Array) -> Array:
        return np.where(alphas[:, 0] > 0.88, hole, gaussian(alphas))

    found = identify(objective, BOX)
    assert np.isfinite(found.log_likelihood)
    assert 0.878 < found.alpha[0] <= 0.88


def test_hopeless_log_likelihoods_are_refused() -> None:
    with pytest.raises(BadInput, match="not finite at any of 32 points"):
        identify(lambda a: np.full(len(a), np.nan), BOX)
    with pytest.raises(BadInput, match="is -7 at all of 32 points"):
        identify(lambda a: np.full(len(a), -7.0), BOX)


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        ([[0.0, 1.0], [2.0, 1.0]], "parameter 2"),
        ([[0.0, np.inf], [0.0, 1.0]], "parameter 1"),
        ([[0.5, 0.5], [1.0, 1.0]], "every parameter is held fixed: free one"),
    ],
)
def test_impossible_bounds_are_refused(bounds: list[list[float]], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        identify(gaussian, np.array(bounds))


@pytest.mark.parametrize("wrong", [{"population": 4}, {"generations": 0}, {"tolerance": 0.0}])
def test_impossible_settings_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(BadInput, match=next(iter(wrong))):
        Settings(**wrong)  # type: ignore[arg-type]


@given(st.lists(st.floats(0.0, 1.0), min_size=3, max_size=3))
def test_unit_cube_and_box_belong_together(unit: list[float]) -> None:
    box = Box(np.array([[-2.0, 5.0], [1.0, 1.0], [0.001, 0.3], [0.5, 1.0]]))
    alpha = box.to_alpha(unit)
    assert np.all((box.bounds[:, 0] <= alpha) & (alpha <= box.bounds[:, 1]))
    np.testing.assert_allclose(box.to_unit(alpha), unit, atol=1e-12)
    assert alpha[2] == pytest.approx(0.001 * 300.0 ** unit[1])
    assert alpha[3] == pytest.approx(0.5 + 0.5 * unit[2])


def test_pinned_parameters_do_not_move() -> None:
    box = Box(RESPONSE_BOX).pinned({1: 0.5, 3: 0.02})
    assert box.free.tolist() == [True, False, True, False]
    np.testing.assert_allclose(box.to_alpha([0.0, 1.0]), [0.7, 0.5, 0.3, 0.02])


NORMAL = np.array([0.9, 0.05])
COUNT = 25


def drawn(count: int, seed: int) -> list[Array]:
    """Data sets, the first of which do not depend on their number."""
    return [np.random.default_rng([seed, k]).normal(NORMAL[0], NORMAL[1], COUNT) for k in range(count)]


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
    alphas = np.array([f.alpha for f in found])
    expected = NORMAL[1] / np.sqrt([COUNT, 2.0 * COUNT])
    np.testing.assert_allclose(alphas.std(0), expected, rtol=0.2)
    np.testing.assert_allclose(alphas.mean(0), NORMAL, atol=4.0 * expected.max() / np.sqrt(120))
    assert abs(np.corrcoef(alphas.T)[0, 1]) < 0.3
    low, high = np.quantile(alphas, [0.025, 0.975], axis=0)
    np.testing.assert_allclose(estimate_intervals(found).T, [low, high], rtol=1e-12)
    assert all(f.converged and not f.at_bound.any() for f in found)
    intervals = [profile(Likelihood(samples[float(f.alpha[0])]), BOX, f.alpha).intervals for f in found[:60]]
    low, high = np.moveaxis(np.asarray(intervals), -1, 0)
    held = np.mean((low <= NORMAL) & (high >= NORMAL), axis=0)
    assert np.all((held > 0.85) & (held <= 1.0))


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
    with pytest.raises(BadInput, match="at least 2"):
        estimate_intervals(replicate(drawn(1, 0), identify_one, seed=0, workers=1))
