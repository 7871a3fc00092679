"""Runs and networks that tests of recurrent training begin with."""

from __future__ import annotations

import numpy as np
import pandas as pd
import torch

from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequence.training import Start, Training, standardised
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from unmodelled.base.campaign import Campaign

INPUTS = SequenceInputs(("sin(theta)", "cos(theta)", "omega", "F_dagger", "alpha"), ("m", "H", "beta"))
FEW = Training(batch=6, epochs=1, updates=1, most=6)


def made(runs: int = 11, seed: int = 0) -> Campaign:
    """Runs of 9 to 40 samples whose eps is what a leaky integrator makes of a negative force."""
    generator = np.random.default_rng(seed)
    lengths = generator.integers(9, 41, runs)
    parts = []
    for n in lengths:
        theta = np.cumsum(generator.uniform(0.1, 0.4, n))
        force = 3.0 + 8.0 * np.cos(theta + generator.uniform(0, 6)) + 0.3 * generator.standard_normal(n)
        eps = np.zeros(n)
        for k in range(1, n):
            eps[k] = 0.8 * eps[k - 1] + 1e-3 * max(0.0, -force[k])
        noise = generator.standard_normal((2, n))
        parts.append({"theta": theta, "omega": noise[0], "alpha": noise[1], "F_dagger": force, "eps": eps})
    signals = {name: np.concatenate([p[name] for p in parts]) for name in parts[0]}
    table = pd.DataFrame(
        {"exp": np.arange(runs) + 1, **{k: generator.random(runs) for k in ("m", "H", "beta")}}
    )
    return Campaign(table, signals, np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64), {})


def beginning(seed: int = 0, inputs: SequenceInputs = INPUTS, dropout: float = 0.0, **shape: int) -> Start:
    """A network, scaled to `made()`, of the given sizes."""
    sequences = Sequences.of(made(), inputs)
    network = DetachmentNetwork(
        inputs, dropout=dropout, generator=torch.Generator().manual_seed(seed), **shape
    )
    network.scale_to(sequences)
    return Start(network, standardised(sequences, network), seed)
