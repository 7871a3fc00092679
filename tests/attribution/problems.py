"""Small detachment networks with random weights, and random runs for them."""

from collections.abc import Sequence

import numpy as np
import torch

from pipeline.attribution.result import Attribution
from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from unmodelled.base.arrays import Array

STATES, UNITS = 5, 6


def inputs_of(features: int, settings: int) -> SequenceInputs:
    return SequenceInputs(tuple(f"x{i}" for i in range(features)), tuple(f"q{i}" for i in range(settings)))


def random_network(inputs: SequenceInputs, seed: int, size: float = 1.0) -> DetachmentNetwork:
    """Weights and biases are normal with the standard deviation `size`; statistics are not 0 and 1."""
    generator = torch.Generator().manual_seed(seed)
    network = DetachmentNetwork(inputs, hidden=STATES, head=UNITS, dropout=0.5).double()
    with torch.no_grad():
        for weights in network.parameters():
            weights.copy_(size * torch.randn(weights.shape, generator=generator, dtype=torch.float64))
        for name, statistic in network.named_buffers():
            value = torch.rand(statistic.shape, generator=generator, dtype=torch.float64)
            statistic.copy_(value + 0.5 if name.endswith("scale") else value)
    return network


def random_runs(inputs: SequenceInputs, lengths: Sequence[int], seed: int) -> Sequences:
    """Random walks, zero after their end."""
    generator = np.random.default_rng(seed)
    n, steps = np.array(lengths, np.int64), max(lengths)
    features = np.cumsum(generator.standard_normal((len(n), steps, len(inputs.features))), 1)
    features[np.arange(steps) >= n[:, None]] = 0.0
    settings = generator.standard_normal((len(n), len(inputs.settings)))
    return Sequences(inputs, np.arange(len(n)) + 7, features, settings, np.zeros((len(n), steps)), n)


def rows(runs: Sequences, *chosen: int) -> Sequences:
    return runs.of_runs(np.array(chosen, np.int64))


def mean_phi(attributions: Sequence[Attribution]) -> Array:
    return np.asarray(np.mean([a.phi for a in attributions], axis=0))
