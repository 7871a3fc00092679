"""Least squares over experiments against solvers that know nothing of how they were summed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from unmodelled.diagnosis.search.least_squares import Columns, Products

Array = NDArray[np.float64]
FREE = np.inf
STATES, SAMPLES, WINDOWS = 2, 15, 3


@dataclass(frozen=True)
class Drawn:
    """Windows of some experiments, three each, whose errors two columns and chance make."""

    seed: int = 0
    experiments: int = 4
    columns: int = 4
    planted: float = 2.0

    @property
    def owner(self) -> NDArray[np.int64]:
        return np.repeat(np.arange(self.experiments), WINDOWS)

    def arrays(self) -> tuple[Array, Array, Array, Array]:
        """Columns, errors, change by the starts, and how far these are moved."""
        rng = np.random.default_rng(self.seed)
        count = len(self.owner)
        columns = rng.normal(size=(count, self.columns, SAMPLES))
        columns[:, 1] += 0.5 * columns[:, 0]
        starts = 3.0 * rng.normal(size=(count, STATES, SAMPLES))
        moved = rng.normal(size=(count, STATES))
        planted = np.r_[self.planted, -self.planted, np.zeros(self.columns - 2)]
        r = rng.normal(size=(count, SAMPLES)) - np.einsum("wks,k->ws", columns, planted)
        return columns, r, starts, moved

    def products(
        self, low: float = -FREE, high: float = FREE, which: Sequence[int] | None = None
    ) -> Products:
        """Of all columns unless given."""
        columns, r, starts, moved = self.arrays()
        chosen = list(range(self.columns)) if which is None else list(which)
        bounds = np.full(len(chosen), low), np.full(len(chosen), high)
        return Columns.of(columns[:, chosen], r, starts, moved, self.owner, np.stack(bounds)).alone


def whole(columns: Array, r: Array, starts: Array, moved: Array) -> tuple[Array, Array]:
    """Matrix and right-hand side of all that is unknown: coefficients, and then the starts of every window,
    which their spread holds back."""
    count = len(r)
    A = np.zeros((count, SAMPLES + STATES, columns.shape[1] + count * STATES))
    for w in range(count):
        own = columns.shape[1] + w * STATES + np.arange(STATES)
        A[w, :SAMPLES, : columns.shape[1]] = columns[w].T
        A[w, :SAMPLES, own] = starts[w]
        A[w, SAMPLES:, own] = np.eye(STATES)
    b = np.concatenate([r, moved], axis=1)
    return A.reshape(-1, A.shape[2]), b.ravel()


def solution(A: Array, b: Array, low: Array, high: Array) -> tuple[Array, float]:
    """Coefficients within bounds, and by how much half the sum of squares falls beyond what starts do."""
    k, rest = len(low), A.shape[1] - len(low)
    bounds = np.r_[low, np.full(rest, -FREE)], np.r_[high, np.full(rest, FREE)]
    found = lsq_linear(A, -b, bounds, tol=1e-14, lsmr_tol=1e-14)
    return found.x[:k], lsq_linear(A[:, k:], -b).cost - found.cost


@pytest.mark.parametrize("seed", range(3))
def test_starts_are_eliminated(seed: int) -> None:
    drawn = Drawn(seed)
    found, fall = drawn.products().solved()
    expected, most = solution(*whole(*drawn.arrays()), np.full(4, -FREE), np.full(4, FREE))
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert fall == pytest.approx(most, rel=1e-6)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("bound", [(0, 0.0, 1.5), (1, -0.5, FREE), (2, 0.0, 0.0)])
def test_a_bound_holds_and_the_others_make_up_for_it(seed: int, bound: tuple[int, float, float]) -> None:
    drawn = Drawn(seed)
    low, high = np.full(4, -FREE), np.full(4, FREE)
    low[bound[0]], high[bound[0]] = bound[1:]
    gram = drawn.products().gram
    found, fall = Products(gram, low, high).solved()
    # `lsq_linear` wants an interval
    expected, most = solution(*whole(*drawn.arrays()), low - 1e-9, high + 1e-9)
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert low[bound[0]] <= found[bound[0]] <= high[bound[0]]
    assert fall == pytest.approx(most, rel=1e-6)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.05, 2.0))
def test_bounds_always_hold_and_the_fall_is_what_it_says(seed: int, tight: float) -> None:
    drawn = Drawn(seed, experiments=2)
    products = drawn.products(-0.5 * tight, tight)
    found, fall = products.solved()
    assert (-0.5 * tight <= found).all() and (found <= tight).all()
    A, b = whole(*drawn.arrays())
    rest = lsq_linear(A[:, 4:], -b - A[:, :4] @ found).cost
    assert fall == pytest.approx(lsq_linear(A[:, 4:], -b).cost - rest, rel=1e-6, abs=1e-6)
    assert fall == pytest.approx(solution(A, b, products.low, products.high)[1], rel=1e-6, abs=1e-6)


def test_a_column_that_is_not_there_gets_nothing() -> None:
    columns, r, starts, moved = Drawn().arrays()
    columns[:, 2] = 0.0
    free = np.full(4, FREE)
    products = Columns.of(columns, r, starts, moved, Drawn().owner, np.stack([-free, free])).alone
    found, fall = products.solved()
    assert found[2] == 0.0
    without, least = Drawn().products(which=[0, 1, 3]).solved()
    np.testing.assert_allclose(found[[0, 1, 3]], without)
    assert fall == pytest.approx(least)


def test_columns_that_are_alike_share() -> None:
    columns, r, starts, moved = Drawn().arrays()
    columns[:, 3] = columns[:, 0]
    free = np.full(4, FREE)
    products = Columns.of(columns, r, starts, moved, Drawn().owner, np.stack([-free, free])).alone
    found, fall = products.solved()
    alone, least = Drawn().products(which=[0, 1, 2]).solved()
    assert found[0] + found[3] == pytest.approx(alone[0], rel=1e-5)
    assert fall == pytest.approx(least, rel=1e-6)


def test_some_columns_count_in_some_experiments_only() -> None:
    drawn, members = Drawn(), np.array([1, 3])
    columns, r, starts, moved = drawn.arrays()
    columns[~np.isin(drawn.owner, members), 2:] = 0.0
    free = np.full(4, FREE)
    expected = Columns.of(columns, r, starts, moved, drawn.owner, np.stack([-free, free])).alone
    before = drawn.products()
    found = before.only(2, members)
    np.testing.assert_allclose(found.gram, expected.gram, atol=1e-12)
    np.testing.assert_allclose(found.solved()[0], expected.solved()[0])
    np.testing.assert_array_equal(before.gram, drawn.products().gram)


@pytest.mark.parametrize("sets", [[[2], [3]], [[2, 3]]])
def test_further_columns_are_as_if_all_came_together(sets: list[list[int]]) -> None:
    drawn = Drawn()
    columns, r, starts, moved = drawn.arrays()
    free = np.full((2, 2), [[-FREE], [FREE]])
    shared = Columns.of(columns[:, :2], r, starts, moved, drawn.owner, free)
    chosen = np.array(sets, np.int64)
    bounds = np.full((2, *chosen.shape), [[[-1.0]], [[2.0]]])
    each = zip(sets, shared.beside(columns[:, chosen], bounds), strict=True)
    for further, found in each:
        expected = drawn.products(which=[0, 1, *further])
        np.testing.assert_allclose(found.gram, expected.gram, rtol=1e-9, atol=1e-9)
        np.testing.assert_array_equal(found.low, [-FREE, -FREE, *[-1.0 for _ in further]])
        np.testing.assert_array_equal(found.high, [FREE, FREE, *[2.0 for _ in further]])


def test_a_prior_holds_back() -> None:
    products = Drawn().products()
    prior = replace(products, precision=np.array([0.0, 1e12, 5.0, 0.0]))
    gram = products.gram.sum(0)
    H = gram[:-1, :-1] + np.diag([0.0, 1e12, 5.0, 0.0])
    np.testing.assert_allclose(prior.solved()[0], -np.linalg.solve(H, gram[:-1, -1]), rtol=1e-6, atol=1e-9)


def test_a_coefficient_for_every_experiment() -> None:
    drawn = Drawn(experiments=3)
    columns, r, starts, moved = drawn.arrays()
    A, b = whole(columns, r, starts, moved)
    part = A[:, [0, 1, *range(4, A.shape[1])]]
    window = np.repeat(drawn.owner, SAMPLES + STATES)
    own = [np.where(window == i, A[:, 2], 0.0) for i in range(3)]
    full = np.column_stack([part[:, :2], *own, part[:, 2:]])
    expected, most = solution(full, b, np.full(5, -FREE), np.full(5, FREE))
    found, fall = drawn.products(which=[0, 1, 2]).split(2).solved()
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert fall == pytest.approx(most, rel=1e-6)
    alone = drawn.products(which=[0]).split(0).solved()[0]
    for i in range(3):
        mine = drawn.owner == i
        low = np.full(1, -FREE)
        single = whole(columns[mine][:, :1], r[mine], starts[mine], moved[mine])
        assert alone[i] == pytest.approx(solution(*single, low, -low)[0][0], rel=1e-6)


def test_experiments_that_are_left_out_say_nothing() -> None:
    drawn = Drawn()
    columns, r, starts, moved = drawn.arrays()
    kept = drawn.owner != 2
    free = np.full(4, FREE)
    bounds = np.stack([-free, free])
    rest = Columns.of(columns[kept], r[kept], starts[kept], moved[kept], drawn.owner[kept], bounds).alone
    np.testing.assert_allclose(drawn.products().solved(np.array([2]))[0], rest.solved()[0])


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 8), st.integers(2, 5))
def test_a_gain_in_other_experiments_is_never_more_than_in_the_same(
    seed: int, experiments: int, folds: int
) -> None:
    products = Drawn(seed, experiments).products()
    assert products.gain(folds) <= products.solved()[1] * (1.0 + 1e-9)


def test_gains_of_what_is_there_and_of_chance() -> None:
    there, chance = [], []
    for seed in range(60):
        drawn = Drawn(seed, experiments=6)
        there.append(drawn.products(which=[0, 1]).gain(4))
        more = drawn.products(which=[0, 1, 2]).gain(4)
        chance.append(more - there[-1])
    assert min(there) > 100.0
    # in the same experiments it would be 0.5, the mean of half of chi square
    assert -1.5 < np.mean(chance) < 0.0
    assert max(chance) < 8.0


def test_a_single_experiment_has_no_others() -> None:
    products = Drawn(experiments=1).products()
    assert products.gain(4) == products.solved()[1] > 50.0
