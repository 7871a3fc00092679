"""Attributions against those of the shap library, where it has any for this network."""

import importlib
import warnings
from types import ModuleType

import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose
from torch import Tensor, nn

from pipeline.attribution.deep_shap import deep_shap
from pipeline.attribution.exact import exact_shapley
from pipeline.attribution.recurrent import Recurrent
from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequences import Sequences
from tests.attribution.problems import inputs_of, random_network, random_runs


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
