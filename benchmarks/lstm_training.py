"""A training step of the network of section 5.4.2: the compiled kernel against Keras, and against nn.LSTM.

As the text does it, 32 runs of up to 200 samples make a mini-batch, 32 units an LSTM. The kernel also gathers
its mini-batches from the data; the peers get theirs ready. Keras runs in a program of its own, see
`keras`.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import torch

from benchmarks import keras
from benchmarks.timing import side_by_side
from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequence import passes
from pipeline.cam_follower.sequence.arrays import room, views
from pipeline.cam_follower.sequence.kernel import gradient
from pipeline.cam_follower.sequence.layout import flattened, sizes
from pipeline.cam_follower.sequence.training import Draws, standardised
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from unmodelled.base.arrays import Array, Single
from unmodelled.base.threads import one_thread

BATCH, STEPS, BATCHES, LEAST = 32, 200, 10, 90
INPUTS = SequenceInputs(tuple(f"feature {k}" for k in range(8)), ("m", "H", "beta"))
PEER = "LSTM, Dense, Dropout, Dense in a tf.function, float32"


@dataclass(frozen=True)
class Task:
    """Random runs of `LEAST` to `STEPS` samples and a network that is scaled to them."""

    network: DetachmentNetwork
    runs: passes.Runs

    @classmethod
    def of(cls, runs: int) -> Task:
        """`runs` runs."""
        generator = np.random.default_rng(0)
        lengths = generator.integers(LEAST, STEPS + 1, runs)
        lengths[0] = STEPS
        features = generator.standard_normal((runs, STEPS, len(INPUTS.features)))
        settings, target = generator.standard_normal((runs, 3)), generator.standard_normal((runs, STEPS))
        sequences = Sequences(INPUTS, np.arange(runs), features, settings, target, lengths)
        network = DetachmentNetwork(INPUTS, generator=torch.Generator().manual_seed(0))
        network.scale_to(sequences)
        return cls(network, standardised(sequences, network))

    def share(self) -> Single:
        """(runs, steps) what every squared error counts."""
        real = np.arange(STEPS) < self.runs.lengths[:, None]
        return np.asarray(real / real.sum(), np.float32)


def run() -> dict[str, object]:
    """One core each. The peer is Keras without XLA, as it chooses itself where there is no GPU;
    `ratio_xla` is the ratio with it, `ratio_nn_lstm` that to torch's own LSTM and Adam.
    """
    single = Task.of(BATCH)
    ours, expected = _epoch(Task.of(BATCH * BATCHES)), _recurrent_gradient(single)
    found = {}
    with one_thread():
        found["nn_lstm"] = side_by_side(ours, _torch_step(single), steps=BATCHES)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        np.savez(folder / "given.npz", allow_pickle=False, **_given(single))
        for how in ("plain", "xla"):
            with keras.started("keras_lstm", folder, how) as peer:
                version = keras.answer(peer)
                _check_same_work(expected, np.load(folder / "gradient.npy"))
                found[how] = side_by_side(ours, partial(keras.step, peer), steps=BATCHES)
    others = {
        f"{name}_{how}": found[how][name] for how in ("xla", "nn_lstm") for name in ("ours", "peer", "ratio")
    }
    return {**found["plain"], **others, "peer_version": f"{version}, {PEER}", "threads": 1}


def _epoch(task: Task) -> Callable[[], object]:
    s, p = sizes(task.network), flattened(task.network)
    adam = passes.Adam(p, *(np.zeros_like(p) for _ in range(3)))
    draws = Draws(task.runs.lengths, BATCH, 0)
    loaded, work = room(task.runs.lengths, BATCH, s)
    return lambda: passes.epoch(
        adam, task.runs, draws.epoch(), draws.edges, s, loaded, work, 1e-3, 1.0, 0.05, 0, 0
    )


def _recurrent_gradient(task: Task) -> Array:
    """(hidden, 4 hidden) in the order of Keras: input, forget, candidate, output."""
    s = sizes(task.network)
    loaded, work = room(task.runs.lengths, BATCH, s)
    batch = passes.load(task.runs, np.argsort(-task.runs.lengths), loaded)
    slope = np.zeros(s.weights, np.float32)
    gradient(flattened(task.network), batch, s, work, np.float32(0.0), 0, slope)
    by_gate = views(slope, s).state.reshape(4, s.hidden, s.hidden)[[0, 1, 3, 2]]
    return np.concatenate(list(by_gate), axis=1).astype(np.float64)


def _torch_step(task: Task) -> Callable[[], object]:
    tau, q, target = (torch.from_numpy(a) for a in task.runs[:3])
    share, network = torch.from_numpy(task.share()), task.network
    optimiser = torch.optim.Adam(network.parameters(), lr=0.0)

    def step() -> None:
        optimiser.zero_grad()
        loss = (share * (network.scaled(tau, q) - target).square()).sum()
        loss.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()

    return step


def _given(task: Task) -> dict[str, Single]:
    """All that the Keras peer needs: mini-batch and weights in its layout."""
    w = {name: value.detach().numpy() for name, value in task.network.named_parameters()}
    weights = {
        "W_tau": w["lstm.weight_ih_l0"].T,
        "W_s": w["lstm.weight_hh_l0"].T,
        "b": w["lstm.bias_ih_l0"],
        "W_5": w["head.weight"].T,
        "b_5": w["head.bias"],
        "W_6": w["output.weight"].T,
        "b_6": w["output.bias"],
    }
    return {
        **weights,
        "tau": task.runs.tau,
        "q": task.runs.q,
        "target": task.runs.target,
        "share": task.share(),
    }


def _check_same_work(ours: Array, peer: Array) -> None:
    error = float(np.linalg.norm(peer - ours) / np.linalg.norm(ours))
    if not error < 1e-3:
        raise ArithmeticError(f"the peer's gradient differs from ours by {error:.1e} of its norm")
