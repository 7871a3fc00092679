"""A training step through 300 integration steps: the compiled kernel against a Keras RNN of the same model.

Keras runs in a program of its own, see `keras`.
"""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks import keras
from benchmarks.slider_crank import BATCH, EPOCH, PERIOD, check_same_work, epoch, gradient, problem, settings
from benchmarks.timing import side_by_side
from unmodelled.base.arrays import Array
from unmodelled.learning.windows import Problem, Progress, weighting

HORIZON = 300
PEER = "RNN of a custom cell in a tf.function, float32"


def run() -> dict[str, object]:
    """Slider-crank, F = eta(d, v) with 32 hidden units, N = 300, batch 200, Euler, one thread each.

    Without XLA, as Keras itself chooses where there is no GPU; `ratio_xla` is the ratio with it.
    """
    single, windows = problem(HORIZON, batches=1), settings(HORIZON)
    long = problem(HORIZON, EPOCH)
    state = Progress.start(long.model, 0)
    expected = gradient(single, windows)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        np.savez(folder / "given.npz", allow_pickle=False, **_given(single))
        found = {}
        for how in ("plain", "xla"):
            with keras.started("keras_rnn", folder, how) as peer:
                version = keras.answer(peer)
                check_same_work(expected, np.load(folder / "gradient.npy"))
                step = partial(keras.step, peer)
                found[how] = side_by_side(lambda: epoch(long, windows, state), step, steps=EPOCH)
    xla = {f"{name}_xla": found["xla"][name] for name in ("ours", "peer", "ratio")}
    return {**found["plain"], **xla, "peer_version": f"{version}, {PEER}", "threads": 1}


def _given(task: Problem) -> dict[str, Array]:
    """All that the peer needs: windows, weights, parameters."""
    data, model = task.data, task.model
    system, (network,) = model.structure.system, model.structure.networks
    ni, nh = len(network.inputs), network.hidden
    parts = np.split(model.weights[0].detach().numpy(), np.cumsum([ni * nh, nh, nh]))
    shaped = zip(("W_h", "b_h", "W_o", "b_o"), parts, ((ni, nh), (nh,), (nh, 1), (1,)), strict=True)
    first, steps = np.arange(BATCH)[:, None], np.arange(HORIZON)
    p = dict(zip((q.name for q in system.parameters), model.physics()[0].detach().numpy(), strict=True))
    return {
        **{name: part.reshape(shape) for name, part, shape in shaped},
        **{name: np.asarray(p[name]) for name in ("m1", "m2", "l1", "l2", "g")},
        "xi": model.xi[0].detach().numpy(),
        "unit": model.unit.numpy(),
        "scale": model.scale[0].numpy(),
        "gain": model.gain[0, 0].numpy(),
        "period": np.asarray(PERIOD),
        "x0": data.x[:BATCH],
        "x": data.x[first + steps + 1],
        "u": data.u[first + steps],
        "C_x": weighting(data, task.runs[0], HORIZON),
    }
