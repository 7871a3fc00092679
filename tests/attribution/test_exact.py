"""Exact Shapley values against their definition, DeepSHAP against them, and both against the shap library."""

import importlib
import warnings
from collections.abc import Callable, Sequence
from itertools import permutations
from types import ModuleType

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from torch import Tensor, nn

from pipeline.attribution.deep_shap import deep_shap
from pipeline.attribution.exact import exact_shapley, shapley_weights
from pipeline.attribution.recurrent import Recurrent
from pipeline.attribution.result import Attribution
from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from tests.attribution.problems import STATES, inputs_of, mean_phi, random_network, random_runs, rows

SEEDS = st.integers(0, 10_000)
Method = Callable[..., list[Attribution]]


def twins(inputs: SequenceInputs, seed: int) -> DetachmentNetwork:
    """A network that treats the first two features alike, and the first two settings."""
    network = random_network(inputs, seed)
    with torch.no_grad():
        for values in (network.lstm.weight_ih_l0, network.feature_mean, network.feature_scale):
            values[..., 1] = values[..., 0]
        for values in (network.head.weight[:, STATES:], network.setting_mean, network.setting_scale):
            values[..., 1] = values[..., 0]
    return network


def alike(runs: Sequences) -> Sequences:
    """The runs with the second feature equal to the first, and the second setting."""
    for values in (runs.features, runs.settings):
        values[..., 1] = values[..., 0]
    return runs


def deaf(
    inputs: SequenceInputs, seed: int, features: Sequence[int], settings: Sequence[int]
) -> DetachmentNetwork:
    """A network that does not listen to some features and settings."""
    network = random_network(inputs, seed)
    with torch.no_grad():
        network.lstm.weight_ih_l0[:, list(features)] = 0.0
        network.head.weight[:, [STATES + j for j in settings]] = 0.0
    return network


@settings(max_examples=10, deadline=None)
@given(SEEDS)
def test_equals_the_mean_over_all_orders(seed: int) -> None:
    """Shapley's definition: what an input adds when inputs join one by one, over all orders."""
    inputs = inputs_of(2, 1)
    network = random_network(inputs, seed)
    run, background = random_runs(inputs, [7], seed + 1), random_runs(inputs, [7, 7], seed + 2)
    (found,) = exact_shapley(network, run, background)
    expected = np.zeros((3, 7))
    orders = [*permutations(range(3))]
    for order in orders:
        mixed = rows(background, 0, 1)
        before = network.predict(mixed).mean(0)
        for joining in order:
            if joining < 2:
                mixed.features[..., joining] = run.features[..., joining]
            else:
                mixed.settings[:] = run.settings
            after = network.predict(mixed).mean(0)
            expected[joining] += (after - before) / len(orders)
            before = after
    assert_allclose(found.phi, expected, rtol=1e-9, atol=1e-12)
    assert_allclose(found.base, network.predict(background).mean(0), rtol=1e-9, atol=1e-12)
    assert found.relative_error < 1e-9


def test_weights_of_the_coalitions() -> None:
    """Of two players: half of what one adds alone and half of what it adds to the other (eq. 5.20)."""
    assert_allclose(shapley_weights(2), [[-0.5, 0.5, -0.5, 0.5], [-0.5, -0.5, 0.5, 0.5]])
    weights = shapley_weights(13)
    assert_allclose(weights.sum(0)[[0, -1]], [-1, 1])
    assert_allclose(weights.sum(0)[1:-1], 0, atol=1e-15)


def test_gates_split_what_they_multiply_as_shapley_does() -> None:
    """One feature opens the input gate, the other makes the candidate; nothing bends their product."""
    inputs = inputs_of(2, 0)
    network = random_network(inputs, 0)
    n = STATES
    with torch.no_grad():
        network.lstm.weight_hh_l0.zero_()
        kept = network.lstm.weight_ih_l0[[0, 2 * n], [0, 1]].clone()
        network.lstm.weight_ih_l0.zero_()
        network.lstm.weight_ih_l0[0, 0], network.lstm.weight_ih_l0[2 * n, 1] = kept[0], 1e-4
        network.lstm.bias_ih_l0.zero_()
        network.lstm.bias_hh_l0[2 * n : 3 * n] = 0.0
        network.feature_mean.zero_()
        network.head.bias.fill_(100.0)
    run, background = random_runs(inputs, [6], 1), random_runs(inputs, [6, 6], 2)
    (found,), (expected,) = (method(network, run, background) for method in (deep_shap, exact_shapley))
    assert_allclose(found.phi, expected.phi, rtol=1e-6, atol=1e-12)
    assert np.abs(expected.phi).min() > 0


@pytest.mark.parametrize("method", [deep_shap, exact_shapley])
@settings(max_examples=10, deadline=None)
@given(SEEDS)
def test_inputs_alike_get_the_same(method: Method, seed: int) -> None:
    inputs = inputs_of(3, 3)
    run, background = alike(random_runs(inputs, [8], seed)), alike(random_runs(inputs, [9, 8], seed + 1))
    (found,) = method(twins(inputs, seed), run, background)
    assert_allclose(found.phi[0], found.phi[1], rtol=1e-9, atol=1e-12)
    assert_allclose(found.phi[3], found.phi[4], rtol=1e-9, atol=1e-12)
    assert np.abs(found.phi[0] - found.phi[2]).max() > 1e-6


@pytest.mark.parametrize(("method", "atol"), [(deep_shap, 0.0), (exact_shapley, 1e-13)])
def test_what_the_network_does_not_read_gets_nothing(method: Method, atol: float) -> None:
    inputs = inputs_of(4, 2)
    network = deaf(inputs, 0, [1, 2], [0])
    run, background = random_runs(inputs, [6], 1), random_runs(inputs, [7, 6], 2)
    (found,) = method(network, run, background)
    assert_allclose(found.phi[[1, 2, 4]], 0.0, rtol=0.0, atol=atol)
    assert np.abs(found.phi[[0, 3, 5]]).max(1).min() > 1e-6


def test_groups_that_the_network_does_not_read_get_nothing() -> None:
    inputs = inputs_of(4, 2)
    network = deaf(inputs, 0, [1, 2], [0])
    run, background = random_runs(inputs, [6], 1), random_runs(inputs, [6, 6], 2)
    groups = {"setting": ["q1"], "silent": ["x1", "x2"], "heard": ["x3", "x0"], "mute": ["q0"]}
    (grouped,) = exact_shapley(network, run, background, groups)
    phi = dict(zip(grouped.names, grouped.phi, strict=True))
    assert_allclose([phi["silent"], phi["mute"]], 0.0, atol=1e-13)
    assert np.abs(phi["heard"]).max() > 1e-6


def test_a_group_of_everything_that_counts_gets_the_whole_difference() -> None:
    inputs = inputs_of(2, 2)
    network = deaf(inputs, 0, [], [0, 1])
    run, background = random_runs(inputs, [6], 1), random_runs(inputs, [6, 6], 2)
    (found,) = exact_shapley(network, run, background, {"q": ["q0", "q1"], "x": ["x1", "x0"]})
    assert found.names == ("x", "q")
    assert_allclose(found.phi[0], found.output - found.base, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("method", "place", "together"),
    [
        (deep_shap, "pipeline.attribution.deep_shap.PART", (2, 32)),
        (exact_shapley, "pipeline.attribution.exact.ROWS", (1, 7, 1024)),
    ],
)
def test_a_background_is_the_mean_of_its_references(
    method: Method, place: str, together: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """However many are computed at a time."""
    inputs = inputs_of(3, 2)
    network, run = random_network(inputs, 0), random_runs(inputs, [8], 1)
    background = random_runs(inputs, [8, 10, 9, 8, 12], 2)
    single = [method(network, run, rows(background, i))[0] for i in range(5)]
    for count in together:
        monkeypatch.setattr(place, count)
        (found,) = method(network, run, background)
        assert_allclose(found.phi, mean_phi(single), rtol=1e-9, atol=1e-12)
        assert_allclose(found.base, np.mean([a.base for a in single], 0), rtol=1e-9)


def test_runs_and_references_of_any_length() -> None:
    inputs = inputs_of(2, 1)
    network, background = random_network(inputs, 0), random_runs(inputs, [5, 11], 2)
    long, short = exact_shapley(network, random_runs(inputs, [9, 4], 1), background)
    assert long.phi.shape == (3, 9) and short.phi.shape == (3, 4)
    alone = exact_shapley(network, random_runs(inputs, [9, 4], 1), rows(background, 1))[0]
    assert_allclose(long.phi[:, 5:], alone.phi[:, 5:], rtol=1e-9)
    deep = deep_shap(network, random_runs(inputs, [9, 4], 1), background)
    assert_allclose(deep[0].base, long.base, rtol=1e-9)


@pytest.fixture(scope="module")
def shap() -> ModuleType:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return importlib.import_module("shap")


def test_head_equals_deep_explainer(shap: ModuleType) -> None:
    """shap.DeepExplainer does support the ReLU network behind the LSTM, so settings can be compared."""
    inputs = inputs_of(2, 3)
    network = random_network(inputs, 4)
    run, background = random_runs(inputs, [6], 1), random_runs(inputs, [6] * 5, 2)
    background.features[:] = run.features
    (found,) = deep_shap(network, run, background)
    head = head_at(network, run, step=5)
    explainer = shap.DeepExplainer(head, torch.from_numpy(background.settings))
    expected = explainer.shap_values(torch.from_numpy(run.settings), check_additivity=False)
    assert_allclose(found.phi[2:, 5], expected[0, :, 0], rtol=1e-9)
    assert np.abs(found.phi[2:, 5]).min() > 1e-6


def head_at(network: DetachmentNetwork, run: Sequences, step: int) -> nn.Sequential:
    """The network at a step of a run, as a function of the settings alone."""
    recurrent = Recurrent.of(network)
    units = len(recurrent.b5)
    first, last = (nn.Linear(*sizes).double() for sizes in ((3, units), (units, 1)))
    with torch.no_grad():
        first.weight.copy_(recurrent.W5_q.T)
        s = recurrent.trace(run, step + 1).s[-1, 0]
        first.bias.copy_(recurrent.b5 + s @ recurrent.W5_s)
        last.weight.copy_(recurrent.W6[None])
        last.bias.copy_(recurrent.b6)
    return nn.Sequential(first, nn.ReLU(), last)


class AtStep(nn.Module):
    """The network's output at one step, the way shap wants it."""

    def __init__(self, network: DetachmentNetwork, step: int) -> None:
        super().__init__()
        self.network, self.step = network.eval(), step

    def forward(self, tau: Tensor, q: Tensor) -> Tensor:
        output: Tensor = self.network(tau, q)[:, self.step, None]
        return output


def test_gradient_explainer_agrees(shap: ModuleType) -> None:
    """Expected gradients share the axioms and are close for a network that bends little."""
    inputs = inputs_of(3, 2)
    network = random_network(inputs, 2, 0.4)
    run, background = random_runs(inputs, [6], 1), random_runs(inputs, [6] * 5, 2)
    data, x = ([torch.from_numpy(a) for a in (s.features, s.settings)] for s in (background, run))
    of_tau, of_q = shap.GradientExplainer(AtStep(network, 5), data).shap_values(x, nsamples=2000, rseed=0)
    gradients = np.concatenate([of_tau.sum((0, 1, 3)), of_q[0, :, 0]])
    (found,) = exact_shapley(network, run, background)
    assert_allclose(gradients, found.phi[:, 5], atol=0.1 * np.abs(found.phi[:, 5]).max())
