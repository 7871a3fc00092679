"""A training step through 300 integration steps: the compiled kernel against a Keras RNN of the same model.

TensorFlow asks for an older h5py than constraints.txt pins, so Keras runs in a program of its own
(`keras_peer.py`), with the Python that BENCH_KERAS_PYTHON names and else with this one:

    python3.11 -m venv keras && keras/bin/pip install keras tensorflow-cpu
    BENCH_KERAS_PYTHON=keras/bin/python make bench

Without constraints.txt the extra `bench` of pyproject.toml installs them beside the pipeline.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.slider_crank import BATCH, EPOCH, PERIOD, check_same_work, epoch, gradient, problem, settings
from benchmarks.timing import PeerMissing, side_by_side
from pipeline.learning.windows import Problem, Progress, weighting

Array = NDArray[np.float64]

HORIZON = 300
PEER = "RNN of a custom cell in a tf.function, float32"
PYTHON = os.environ.get("BENCH_KERAS_PYTHON", sys.executable)


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
            with _started(folder, how) as peer:
                version = _answer(peer)
                check_same_work(expected, np.load(folder / "gradient.npy"))
                step = partial(_step, peer)
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


@contextmanager
def _started(folder: Path, how: str) -> Iterator[subprocess.Popen[str]]:
    command = [PYTHON, str(Path(__file__).with_name("keras_peer.py")), str(folder), how]
    if subprocess.run([PYTHON, "-c", "import keras, tensorflow"], capture_output=True).returncode:
        raise PeerMissing(
            f"{PYTHON} has no Keras with TensorFlow: set BENCH_KERAS_PYTHON to a Python that has"
        )
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as peer:
        try:
            yield peer
        finally:
            if peer.stdin:
                peer.stdin.close()


def _step(peer: subprocess.Popen[str]) -> None:
    assert peer.stdin is not None
    peer.stdin.write("\n")
    peer.stdin.flush()
    _answer(peer)


def _answer(peer: subprocess.Popen[str]) -> str:
    assert peer.stdout is not None
    answer = peer.stdout.readline().strip()
    if not answer:
        raise RuntimeError("the Keras peer ended early; its own message stands above")
    return answer
