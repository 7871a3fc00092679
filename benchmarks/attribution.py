"""Attributions of every step of a run: DeepSHAP in one forward sweep against shap's expected gradients."""

from __future__ import annotations

import numpy as np
import shap
import torch
from torch import Tensor, nn

from benchmarks.timing import side_by_side
from pipeline.attribution.deep_shap import deep_shap
from pipeline.attribution.exact import exact_shapley, shapley_weights
from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from unmodelled.base.threads import one_thread

REFERENCES, STEPS, FEATURES, SETTINGS = 10, 100, 8, 3
PEER = f"shap {shap.__version__}, GradientExplainer with as many samples as references"


@one_thread()
def run() -> dict[str, float]:
    """An LSTM of 32 units, 8 features, 3 settings, 100 steps, 10 references, float64, one thread.

    `ratio_exact`: exact Shapley values, against one pass of all 2048 coalitions through the whole network.
    """
    inputs = SequenceInputs(tuple("abcdefgh"[:FEATURES]), tuple("xyz"[:SETTINGS]))
    generator = np.random.default_rng(0)
    network = DetachmentNetwork(inputs, generator=torch.Generator().manual_seed(0)).double().eval()
    runs, background = _walks(inputs, 1, generator), _walks(inputs, REFERENCES, generator)
    (x, r) = ([torch.from_numpy(a) for a in (s.features, s.settings)] for s in (runs, background))
    explainer = shap.GradientExplainer(_Outputs(network), r)
    result = side_by_side(
        lambda: deep_shap(network, runs, background),
        lambda: explainer.shap_values(x, nsamples=REFERENCES, rseed=0),
        rounds=3,
    )
    np.testing.assert_allclose(
        exact_shapley(network, runs, background)[0].phi, _plain(network, x, r), rtol=1e-6, atol=1e-12
    )
    exact = side_by_side(
        lambda: exact_shapley(network, runs, background), lambda: _plain(network, x, r), rounds=3
    )
    return {**result, **{f"{name}_exact": exact[name] for name in ("ours", "peer", "ratio")}, "threads": 1}


def _walks(inputs: SequenceInputs, runs: int, generator: np.random.Generator) -> Sequences:
    features = 0.2 * np.cumsum(generator.standard_normal((runs, STEPS, FEATURES)), 1)
    settings, target = generator.standard_normal((runs, SETTINGS)), np.zeros((runs, STEPS))
    return Sequences(inputs, np.arange(runs), features, settings, target, np.full(runs, STEPS))


class _Outputs(nn.Module):
    """The network as shap takes it: one output per step."""

    def __init__(self, network: DetachmentNetwork) -> None:
        super().__init__()
        self.network = network

    def forward(self, tau: Tensor, q: Tensor) -> Tensor:
        output: Tensor = self.network(tau, q)
        return output


@torch.no_grad()
def _plain(network: DetachmentNetwork, x: list[Tensor], r: list[Tensor]) -> Tensor:
    """(players, steps) Shapley values, all coalitions through the whole network."""
    values = []
    for bits in torch.split(torch.arange(2 ** (FEATURES + SETTINGS)), 64):
        present = (bits[:, None, None] >> torch.arange(FEATURES + SETTINGS) & 1).bool()
        tau = torch.where(present[..., None, :FEATURES], x[0], r[0]).flatten(0, 1)
        q = torch.where(present[..., FEATURES:], x[1], r[1]).flatten(0, 1)
        values.append(network(tau, q).view(len(bits), REFERENCES, STEPS).mean(1))
    return shapley_weights(FEATURES + SETTINGS) @ torch.cat(values)
