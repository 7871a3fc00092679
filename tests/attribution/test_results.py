"""Shares, agreement of methods, and what is refused."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose
from pytest import approx

from pipeline.attribution.deep_shap import deep_shap
from pipeline.attribution.exact import exact_shapley
from pipeline.attribution.result import Attribution, agreement, relative_shares
from tests.attribution.problems import inputs_of, random_network, random_runs, rows
from unmodelled.base.errors import BadInput
from unmodelled.base.threads import one_thread

Method = Callable[..., list[Attribution]]
INPUTS = inputs_of(2, 1)


def attribution(phi: Sequence[Sequence[float]], run: int = 1, missing: float = 0.0) -> Attribution:
    """Of an output that is `missing` more than base and attributions."""
    values = np.array(phi, np.float64)
    base = np.full(values.shape[1], 0.5)
    names = tuple("abcdef"[: len(values)])
    return Attribution(run, names, values, base, base + values.sum(0) + missing)


def test_local_accuracy() -> None:
    a = attribution([[1, -2], [1, 2]], missing=0.1)
    assert_allclose(a.error, 0.1)
    assert a.relative_error == approx(0.1 / 2.1)
    assert attribution([[0, 0]]).relative_error == 0.0


def test_shares_add_magnitudes_over_steps_and_runs() -> None:
    runs = [attribution([[1, -2], [0, 1]]), attribution([[0], [4]], run=2)]
    assert relative_shares(runs) == {"a": approx(3 / 8), "b": approx(5 / 8)}
    assert relative_shares([attribution([[0, 0], [0, 0]])]) == {"a": 0.0, "b": 0.0}


def test_groups_add_attributions() -> None:
    a = attribution([[1, -2], [0, 1], [3, 3]]).grouped({"angle": ["c", "a"], "rest": ["b"]})
    assert a.names == ("angle", "rest")
    assert_allclose(a.phi, [[4, 1], [0, 1]])
    assert a.relative_error == 0.0


def test_agreement_ranks() -> None:
    reference = [attribution([[1, 2], [5, 3]]), attribution([[9, 8], [-1, 0]], run=2)]
    same = [attribution([[10, 20], [51, 30]]), attribution([[99, 88], [-7, 0]], run=2)]
    found = agreement(same, reference)
    assert_allclose([*found.shares, *found.trajectories], 1.0)
    turned = [attribution([[5, 3], [1, 2]]), attribution([[-1, 0], [9, 8]], run=2)]
    assert_allclose(agreement(turned, reference).shares, -1.0)


def test_agreement_with_what_is_constant_is_unknown() -> None:
    found = agreement([attribution([[0, 0], [0, 0]])], [attribution([[1, 2], [5, 3]])])
    assert np.isnan([*found.shares, *found.trajectories]).all()


def test_what_cannot_be_put_together() -> None:
    two, three = attribution([[1], [2]]), attribution([[1], [2], [3]])
    for faulty in (lambda: relative_shares([]), lambda: relative_shares([two, three])):
        with pytest.raises(ValueError, match="the same inputs"):
            faulty()
    with pytest.raises(ValueError, match="the same runs"):
        agreement([two], [attribution([[1], [2]], run=5)])


@pytest.mark.parametrize("method", [deep_shap, exact_shapley])
def test_refuses_what_cannot_be_explained(method: Method) -> None:
    network, runs = random_network(INPUTS, 0), random_runs(INPUTS, [6], 1)
    short, endless = random_runs(INPUTS, [5, 4], 2), random_runs(INPUTS, [6, 3], 2)
    endless.features[1, 2, 0] = np.nan
    wide, narrow = random_runs(inputs_of(3, 1), [6], 1), random_runs(inputs_of(2, 0), [6], 1)
    for explained, background, message in (
        (runs, rows(short), "background: it holds no run"),
        (runs, short, "background: its longest run has 5 steps, an explained one 6"),
        (rows(runs), runs, "runs: there is none to explain"),
        (wide, runs, "runs: the network reads the features x0, x1, got x0, x1, x2"),
        (runs, narrow, "background: the network reads the settings q0, got none"),
        (runs, endless, "experiment 8: the network's output is not a finite number at step 3"),
    ):
        with pytest.raises(BadInput, match=message):
            method(network, explained, background)


@pytest.mark.parametrize(
    ("group", "message"),
    [
        (["x1", "q0", "speed"], "groups: b names speed, the network reads x0, x1, q0"),
        (["x1", "x0"], "groups: x0 is in a and in b"),
        (["x1"], "groups: q0 is in no group"),
        ([], "groups: b is empty"),
        (["x1", "q0"], "groups: b holds both features and settings"),
    ],
)
def test_refuses_groups(group: list[str], message: str) -> None:
    network, runs = random_network(INPUTS, 0), random_runs(INPUTS, [6], 1)
    with pytest.raises(BadInput, match=message):
        exact_shapley(network, runs, runs, {"a": ["x0"], "b": group})


def test_threads_are_given_back() -> None:
    before = torch.get_num_threads()
    try:
        torch.set_num_threads(before + 1)
        with one_thread():
            assert torch.get_num_threads() == 1
        assert torch.get_num_threads() == before + 1
    finally:
        torch.set_num_threads(before)


def test_refuses_more_than_thirteen_groups() -> None:
    inputs = inputs_of(12, 2)
    network, runs = random_network(inputs, 0), random_runs(inputs, [2], 1)
    with pytest.raises(BadInput, match="groups: exact Shapley values take at most 13, got 14"):
        exact_shapley(network, runs, runs)
    names = (*inputs.features, *inputs.settings)
    groups = {"angle": names[:2], **{name: (name,) for name in names[2:]}}
    (found,) = exact_shapley(network, runs, runs, groups)
    assert len(found.names) == 13
