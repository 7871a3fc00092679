"""DeepSHAP through the LSTM: its axioms, and its values where they are known."""

from dataclasses import replace

import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from torch import Tensor

from pipeline.attribution.deep_shap import contributions, deep_shap, multipliers
from pipeline.attribution.recurrent import Recurrent, Trace
from pipeline.cam_follower.sequences import Sequences
from tests.attribution.problems import STATES, inputs_of, mean_phi, random_network, random_runs, rows

SEEDS = st.integers(0, 10_000)


@settings(max_examples=20, deadline=None)
@given(
    SEEDS,
    st.floats(0.01, 3.0),
    st.integers(1, 4),
    st.integers(0, 3),
    st.lists(st.integers(8, 15), min_size=1, max_size=4),
)
def test_attributions_add_up_to_the_output(
    seed: int, size: float, features: int, n_q: int, lengths: list[int]
) -> None:
    inputs = inputs_of(features, n_q)
    network = random_network(inputs, seed, size)
    runs, background = random_runs(inputs, [8, 5], seed + 1), random_runs(inputs, lengths, seed + 2)
    found = deep_shap(network, runs, background)
    references = network.predict(background)
    for a, output, length in zip(found, network.predict(runs), runs.lengths, strict=True):
        assert_allclose(a.output, output[:length], rtol=1e-9, atol=1e-12)
        assert_allclose(a.base, references[:, :length].mean(0), rtol=1e-9, atol=1e-12)
        assert_allclose(a.base + a.phi.sum(0), output[:length], rtol=1e-9, atol=1e-9 * size**2)
        assert a.relative_error < 1e-9


@settings(max_examples=12, deadline=None)
@given(SEEDS, st.floats(0.1, 2.0))
def test_forward_mode_equals_a_backward_sweep_per_step(seed: int, size: float) -> None:
    inputs = inputs_of(3, 2)
    network = Recurrent.of(random_network(inputs, seed, size))
    x = network.trace(random_runs(inputs, [9], seed + 1), 9)
    r = network.trace(random_runs(inputs, [9, 9, 9], seed + 2), 9)
    forward = contributions(network, x, r)[..., :3]
    backward = torch.stack([backward_sweep(network, x, r, k).sum(0) for k in range(9)])
    assert_allclose(forward, backward, rtol=1e-9, atol=1e-12)


def backward_sweep(network: Recurrent, x: Trace, r: Trace, last: int) -> Tensor:
    """phi_{i,j} at all steps j for the output at step `last`, (last + 1, references, features)."""
    m = multipliers(network, x, r)
    s, c = m.state[last], torch.zeros_like(m.state[last])
    phi = []
    for j in range(last, -1, -1):
        c = c + s * m.show[j]
        z = torch.cat([c, c, s, c], -1) * m.gates[j]
        phi.append((z @ network.W_tau.T) * (x.tau - r.tau)[j])
        s, c = z @ network.W_s.T, c * m.keep[j]
    return torch.stack(phi)


def test_close_to_a_reference_attributions_are_the_gradient() -> None:
    inputs = inputs_of(3, 2)
    network = random_network(inputs, 3)
    reference = random_runs(inputs, [12], 4)
    step = random_runs(inputs, [12], 5)
    tiny = 1e-6
    moved = {n: getattr(reference, n) + tiny * getattr(step, n) for n in ("features", "settings")}
    run = replace(reference, **moved)
    (found,) = deep_shap(network, run, reference)
    tau, q = (torch.from_numpy(a).requires_grad_() for a in (reference.features, reference.settings))
    network.eval()
    for k in (0, 5, 11):
        of_tau, of_q = torch.autograd.grad(network(tau, q)[0, k], (tau, q))
        expected = [*(of_tau.numpy() * step.features).sum((0, 1)), *(of_q.numpy() * step.settings)[0]]
        assert_allclose(found.phi[:, k] / tiny, expected, rtol=1e-4, atol=1e-6)


def test_values_of_a_linear_network() -> None:
    """Gates that do not listen, a candidate and a cell too small to bend, ReLU units that stay open."""
    inputs = inputs_of(3, 2)
    network = random_network(inputs, 0)
    n, tiny = STATES, 1e-5
    with torch.no_grad():
        network.lstm.weight_hh_l0.zero_()
        network.lstm.bias_ih_l0.zero_()
        gates, candidate = torch.arange(4 * n).view(4, n)[[0, 1, 3]], slice(2 * n, 3 * n)
        network.lstm.weight_ih_l0[gates.flatten()] = 0.0
        network.lstm.weight_ih_l0[candidate] *= tiny
        network.lstm.bias_hh_l0[candidate] = 0.0
        network.feature_mean.zero_()
        network.head.bias.fill_(100.0)
    run, background = random_runs(inputs, [10], 1), random_runs(inputs, [10, 10, 10], 2)
    (found,) = deep_shap(network, run, background)
    weights = {name: value.numpy() for name, value in network.state_dict().items()}
    opening, keeping, _, showing = 1 / (1 + np.exp(-weights["lstm.bias_hh_l0"].reshape(4, n)))
    to_output = weights["output.weight"][0] @ weights["head.weight"] * weights["target_scale"]
    change = run.features[0] - background.features.mean(0)
    W = weights["lstm.weight_ih_l0"][candidate] / weights["feature_scale"]
    c = np.zeros((3, n))
    for k in range(10):
        c = keeping * c + opening * (W * change[k]).T
        assert_allclose(found.phi[:3, k], (showing * c) @ to_output[:n], rtol=1e-6)
    of_settings = to_output[n:] / weights["setting_scale"] * (run.settings[0] - background.settings.mean(0))
    assert_allclose(found.phi[3:], np.repeat(of_settings[:, None], 10, 1), rtol=1e-9)


def test_what_equals_the_references_gets_nothing() -> None:
    inputs = inputs_of(3, 2)
    run, background = random_runs(inputs, [8], 1), random_runs(inputs, [8, 8], 2)
    background.features[..., 2] = run.features[..., 2]
    background.settings[:, 1] = run.settings[:, 1]
    (found,) = deep_shap(random_network(inputs, 0), run, background)
    assert_array_equal(found.phi[[2, 4]], 0.0)
    assert np.abs(found.phi[[0, 1, 3]]).max(1).min() > 1e-6


def test_references_count_as_long_as_they_last() -> None:
    inputs = inputs_of(2, 1)
    network, run = random_network(inputs, 0), random_runs(inputs, [9], 1)
    background = random_runs(inputs, [4, 12, 6], 2)
    (found,) = deep_shap(network, run, background)
    for first, last, lasting in ((0, 4, (0, 1, 2)), (4, 6, (1, 2)), (6, 9, (1,))):
        part = [deep_shap(network, cut(run, last), rows(background, i))[0] for i in lasting]
        assert_allclose(found.phi[:, first:last], mean_phi(part)[:, first:], rtol=1e-9, atol=1e-12)
    assert found.relative_error < 1e-9


def cut(runs: Sequences, steps: int) -> Sequences:
    features, target = runs.features[:, :steps], runs.target[:, :steps]
    return replace(runs, features=features, target=target, lengths=np.array([steps]))


def test_runs_do_not_change_each_other_nor_the_network() -> None:
    inputs = inputs_of(3, 0)
    network, background = random_network(inputs, 0), random_runs(inputs, [12, 9], 2)
    runs = random_runs(inputs, [5, 11, 8], 1)
    network.train()
    together = deep_shap(network, runs, background)
    assert network.training
    assert [a.run for a in together] == [7, 8, 9]
    assert together[1].names == ("x0", "x1", "x2")
    for i, a in enumerate(together):
        (alone,) = deep_shap(network, rows(runs, i), background)
        assert_allclose(a.phi, alone.phi, rtol=1e-9, atol=1e-12)
