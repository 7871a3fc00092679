"""The compiled training of a recurrent network is the one of torch; it converges or says that it did not."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import torch

from pipeline.cam_follower.sequence.stack import train_stack
from pipeline.cam_follower.sequence.training import Course, Draws, Training, train
from pipeline.cam_follower.sequences import Sequences
from tests.learning.recurrent import FEW, INPUTS, beginning, made
from unmodelled.base.threads import one_thread


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    """Operations as small as these take longer in several."""
    with one_thread():
        yield


def test_kernel_and_torch_train_alike() -> None:
    """Same first weights and draws, no dropout: the same losses, as long as rounding has not grown."""
    training = Training(batch=6, epochs=2, updates=1, most=24, clip=0.5, falls=99)
    seeds = (0, 1, 2)
    compiled = [beginning(seed) for seed in seeds]
    courses = [train(start, training) for start in compiled]
    stacked = [beginning(seed) for seed in seeds]
    others = train_stack(stacked, training, "cpu")
    for one, other, course, expected in zip(compiled, stacked, courses, others, strict=True):
        assert course.updates == expected.updates == 24 and len(course.losses) == 6
        np.testing.assert_allclose(course.losses, expected.losses, rtol=1e-3)
        torch.testing.assert_close(one.network.state_dict(), other.network.state_dict(), rtol=0, atol=2e-3)
    assert len({course.losses[0] for course in courses}) == 3


def test_dropout_of_kernel_and_torch_costs_alike() -> None:
    standing = Training(batch=11, rate=0.0, epochs=60, updates=1, most=60)
    start = beginning()
    train(start, replace(standing, rate=0.01))
    without = train(start, standing).losses[0]
    start.network.dropout.p = 0.3
    one, other = train(start, standing).losses[0], train_stack([start], standing, "cpu")[0].losses[0]
    assert one > 1.5 * without
    assert one - without == pytest.approx(other - without, rel=0.1)


def test_training_converges_on_a_planted_relation() -> None:
    training = Training(batch=6, epochs=10, updates=40, falls=4, patience=1)
    start = beginning()
    course = train(start, training)
    assert course.converged and not course.diverged
    assert course.losses[-1] < 0.02 * course.losses[0]
    assert course.rates[0] == 0.01 and course.rates[-1] == 0.01 / 8
    sequences = Sequences.of(made(), INPUTS)
    error = (start.network.predict(sequences) - sequences.target)[sequences.mask]
    assert np.sqrt(np.mean(error**2)) < 0.15 * sequences.target[sequences.mask].std()


def test_the_rate_falls_where_the_loss_does_not() -> None:
    course = Course(Training(rate=1.0, epochs=2, updates=4, tolerance=0.1, patience=2, falls=2))
    rates = []
    #: mean of a check: 8, 4 (better), 3.9 and 3.8 (not by a tenth: fall), 1 (better), 0.95 and 2 (fall)
    for mean in (8.0, 4.0, 3.9, 3.8, 1.0, 0.95, 2.0):
        for _ in range(2):
            assert not course.over
            course.after_epoch(mean, 2)
        rates.append(course.rate)
    assert rates == [1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 0.25]
    assert course.rates == [1.0, 1.0, 1.0, 1.0, 0.5, 0.5, 0.5]
    assert course.converged and course.over and course.updates == 28


def test_a_training_that_does_not_converge_ends_and_says_so() -> None:
    course = Course(replace(FEW, most=3))
    while not course.over:
        course.after_epoch(1.0 / (1 + course.updates), 1)
    assert course.updates == 3 and not course.converged


@pytest.mark.parametrize("compiled", [True, False])
def test_a_diverged_network_keeps_its_last_finite_weights(compiled: bool) -> None:
    start = beginning()
    start.runs.target[3, 0] = np.inf
    course = train(start, FEW) if compiled else train_stack([start], FEW, "cpu")[0]
    assert course.diverged and course.over and not course.converged
    torch.testing.assert_close(start.network.state_dict(), beginning().network.state_dict())


def test_every_run_is_drawn_once_an_epoch_longest_first() -> None:
    lengths = np.random.default_rng(0).integers(5, 40, 75)
    draws, same = Draws(lengths, 32, 7), Draws(lengths, 32, 7)
    assert draws.edges.tolist() == [0, 25, 50, 75]
    first, second = draws.epoch(), draws.epoch()
    for order in (first, second):
        assert sorted(order) == list(range(75))
        for a, b in zip(draws.edges, draws.edges[1:], strict=False):
            assert (np.diff(lengths[order[a:b]]) <= 0).all()
    assert set(first[:25]) != set(second[:25])
    np.testing.assert_array_equal(same.epoch(), first)
