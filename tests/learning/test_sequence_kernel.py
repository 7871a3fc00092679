"""The compiled recurrent network is the one of torch, and the same however it came to be compiled."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import torch

from pipeline.cam_follower.sequence.activations import rectified, sigmoid, tanh
from pipeline.cam_follower.sequence.arrays import room, views
from pipeline.cam_follower.sequence.kernel import gradient
from pipeline.cam_follower.sequence.layout import flattened, restore, sizes
from pipeline.cam_follower.sequence.passes import load
from pipeline.cam_follower.sequence.products import add_product
from pipeline.cam_follower.sequence.recipe import SequenceRecipe
from pipeline.cam_follower.sequence.stack import scaled_output
from pipeline.cam_follower.sequences import SequenceInputs
from tests.learning.recurrent import FEW, INPUTS, beginning
from unmodelled.base.errors import BadInput
from unmodelled.base.threads import one_thread

TRAINING = """
from hashlib import sha256
from pipeline.cam_follower.sequence.layout import flattened
from pipeline.cam_follower.sequence.training import Training, train
from tests.learning.recurrent import beginning
start = beginning(dropout=0.05)
train(start, Training(batch=6, most=40))
print(sha256(flattened(start.network)).hexdigest())
"""


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    """Operations as small as these take longer in several."""
    with one_thread():
        yield


@pytest.mark.parametrize(
    ("n", "depth", "width"), [(4, 3, 32), (20, 32, 32), (12, 5, 20), (28, 32, 64), (8, 1, 4)]
)
@pytest.mark.parametrize("transposed", [False, True])
def test_tiles_make_a_product(n: int, depth: int, width: int, transposed: bool) -> None:
    generator = np.random.default_rng(0)
    a, b, out = (
        generator.standard_normal(shape).astype(np.float32)
        for shape in ((n, depth), (depth, width), (n, width))
    )
    expected = out.astype(np.float64) + a.astype(np.float64) @ b
    flat = np.concatenate([np.full(3, 7.0, np.float32), out.ravel(), np.full(5, 7.0, np.float32)])
    stored = (a.T if transposed else a).ravel()
    add_product(flat, 3, stored, 0, *((1, n) if transposed else (depth, 1)), b.ravel(), 0, n, depth, width)
    np.testing.assert_allclose(flat[3:-5].reshape(n, width), expected, rtol=2e-5, atol=1e-5)
    assert (flat[:3] == 7.0).all() and (flat[-5:] == 7.0).all()


def test_activations_are_accurate_in_single_precision() -> None:
    x = np.concatenate([np.linspace(-30, 30, 20001), np.logspace(-30, 1, 400), [0.0]]).astype(np.float32)
    one, two = x.copy(), x.copy()
    tanh(one)
    sigmoid(two)
    exact = x.astype(np.float64)
    np.testing.assert_allclose(one, np.tanh(exact), rtol=4e-7, atol=0.0)
    np.testing.assert_allclose(two, 0.5 + 0.5 * np.tanh(0.5 * exact), rtol=0.0, atol=2e-7)


def test_dropout_ignores_its_share_and_leaves_the_mean() -> None:
    x = np.ones(200_000, np.float32)
    rectified(x, np.float32(0.05), 12345)
    assert set(np.unique(x)) == {np.float32(0.0), np.float32(1.0) / np.float32(0.95)}
    # five standard deviations of a binomial
    assert abs((x == 0.0).mean() - 0.05) < 5 * np.sqrt(0.05 * 0.95 / len(x))
    neighbours = np.corrcoef(x[:-1], x[1:])[0, 1]
    other = np.ones_like(x)
    rectified(other, np.float32(0.05), 12346 + 0x9E3779B1)
    assert abs(neighbours) < 0.012 and abs(np.corrcoef(x, other)[0, 1]) < 0.012
    y = np.array([-2.0, 0.0, 3.0], np.float32)
    rectified(y, np.float32(0.0), 1)
    assert y.tolist() == [0.0, 0.0, 3.0]


@pytest.mark.parametrize("shape", [{}, {"hidden": 20, "head": 8}])
@pytest.mark.parametrize("inputs", [INPUTS, SequenceInputs(("F_dagger",))])
def test_the_gradient_is_that_of_torch(shape: dict[str, int], inputs: SequenceInputs) -> None:
    """Against nn.LSTM in double precision, on all runs, of different length, at once."""
    start = beginning(inputs=inputs, **shape)
    network, runs, s = start.network, start.runs, sizes(start.network)
    loaded, work = room(runs.lengths, len(runs.lengths), s)
    batch = load(runs, np.argsort(-runs.lengths), loaded)
    slope = np.zeros(s.weights, np.float32)
    loss = gradient(flattened(network), batch, s, work, np.float32(0.0), 0, slope)

    network.double()
    tau = torch.from_numpy(runs.tau[..., : len(inputs.features)]).double()
    error = network.scaled(tau, torch.from_numpy(runs.q).double()) - torch.from_numpy(runs.target)
    mask = torch.arange(runs.tau.shape[1]) < torch.from_numpy(runs.lengths)[:, None]
    expected = error[mask].square().mean()
    expected.backward()  # type: ignore[no-untyped-call]
    assert float(loss) == pytest.approx(expected.item(), rel=1e-5)
    for name, parameter in network.named_parameters():
        assert parameter.grad is not None
        if name == "lstm.bias_hh_l0":  # the sum of both biases is one weight
            parameter.data.zero_()
        else:
            parameter.data.copy_(parameter.grad)
    wanted = views(flattened(network.float()), s)
    for found, exact in zip(views(slope, s), wanted, strict=True):
        np.testing.assert_allclose(found, exact, rtol=1e-4, atol=1e-4 * np.abs(exact).max(initial=0.0))


def test_weights_survive_the_change_of_layout() -> None:
    start = beginning(hidden=8, head=12)
    other = beginning(seed=1, hidden=8, head=12).network
    restore(other, flattened(start.network))
    torch.testing.assert_close(other.state_dict(), start.network.state_dict())
    p = torch.from_numpy(flattened(start.network))[None]
    tau, q = (torch.from_numpy(a) for a in start.runs[:2])
    output = scaled_output(p, sizes(other), tau[None], q[None])[0]
    torch.testing.assert_close(output, other.eval().scaled(tau[..., :5], q), rtol=1e-4, atol=1e-6)


def test_a_size_that_vectors_do_not_fit_is_refused() -> None:
    with pytest.raises(BadInput, match="hidden must be a multiple of 4, got 30"):
        SequenceRecipe(INPUTS, FEW, hidden=30)


@pytest.mark.parametrize(("dropout", "samples"), [(1.0, 200), (-0.1, 200), (0.0, 0)])
def test_impossible_settings_are_refused(dropout: float, samples: int) -> None:
    with pytest.raises(BadInput, match="must be"):
        SequenceRecipe(INPUTS, FEW, dropout=dropout, samples=samples)


def trained(cache: Path) -> str:
    """A digest of the weights, trained by a process that keeps its compiled loops in `cache`."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache), "OMP_NUM_THREADS": "1"}
    result = subprocess.run(
        [sys.executable, "-c", TRAINING], env=environment, capture_output=True, text=True, check=True
    )
    return result.stdout


@pytest.mark.long
def test_a_training_that_compiles_ends_at_the_same_weights(tmp_path: Path) -> None:
    first = trained(tmp_path)
    kept = list(tmp_path.rglob("passes.epoch*.nb?"))
    assert kept and trained(tmp_path) == first
    for path in kept:  # as a process that was killed while it compiled leaves it
        path.unlink()
    assert trained(tmp_path) == first
