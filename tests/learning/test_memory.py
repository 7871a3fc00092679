"""Models of chapter 2's overview: NARX and recurrent networks along a run, and Gaussian processes."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from sklearn.gaussian_process.kernels import RBF
from torch import Generator, Tensor

from pipeline.cam_follower import gaussian_process, one_step
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.conditions import Bench
from pipeline.cam_follower.dataset import Dataset
from pipeline.cam_follower.dynamics import Dynamics, raw_inputs
from pipeline.cam_follower.gaussian_process import GaussianProcess
from pipeline.cam_follower.memory import Narx, Recurrent
from pipeline.cam_follower.relu_ode import BlackBox
from unmodelled.base.campaign import Campaign

PERIOD, SAMPLES, TRAIN = 0.01, 200, [np.arange(20)]


@pytest.fixture(scope="module")
def delayed(small_campaign: Campaign) -> Dataset:
    """Runs of a shaft whose drive follows the voltage through a lag of five samples."""
    bench = Bench.of(CamFollower(), small_campaign.experiments)
    q = bench.conditions(small_campaign.experiments)
    n, theta, omega = len(small_campaign), [], []
    a, w, drive = torch.zeros(n), torch.zeros(n), torch.zeros(n)
    for _ in range(SAMPLES):
        theta.append(a)
        omega.append(w)
        drive = drive + 0.2 * (8.0 * q.V - drive)
        a, w = a + PERIOD * w, w + PERIOD * (drive - 4.0 * w + 20.0 * a.sin())
    offsets = torch.arange(n + 1) * SAMPLES
    return Dataset(bench, torch.stack(theta, 1).ravel(), torch.stack(omega, 1).ravel(), offsets, q, PERIOD)


def build(kind: str, dataset: Dataset, seed: int) -> Dynamics:
    scale, generator = torch.ones(2, 7), Generator().manual_seed(seed)
    if kind == "narx":
        return Narx(dataset.bench, scale, generator, hidden=8, lags=3)
    return Recurrent(dataset.bench, scale, generator, hidden=6)


def inputs(dataset: Dataset, theta: Tensor, omega: Tensor) -> Tensor:
    return raw_inputs(theta, omega, dataset.conditions[torch.arange(3)])


@pytest.mark.parametrize("kind", ["narx", "rnn"])
def test_a_free_run_is_the_recursion_of_the_text(kind: str, delayed: Dataset) -> None:
    model, q = build(kind, delayed, 0), delayed.conditions[torch.arange(3)]
    start = torch.full((2, 3), 0.4), torch.full((2, 3), 3.0)
    theta, omega, _ = model.simulate(*start, q, 6, PERIOD)
    a, w = start
    seen = [inputs(delayed, a, w)] * 3  # before the start: the first state
    h = torch.zeros(2, 3, 6)
    for k in range(6):
        seen = [inputs(delayed, a, w), *seen[:2]]
        if isinstance(model, Narx):  # eq. 2.9
            changing = [each[..., :3] for each in seen[1:]]
            out = model.network(torch.cat([seen[0], *changing], -1))
        else:  # eq. 2.10
            assert isinstance(model, Recurrent)
            net = model.network
            h = torch.tanh(seen[0] @ net.W_i + h @ net.W_h + net.b_h)
            out = (h @ net.W_o + net.b_o)[..., 0]
        a, w = a + PERIOD * w, w + PERIOD * BlackBox.OUTPUT * out
        torch.testing.assert_close(theta[..., k + 1], a)
        torch.testing.assert_close(omega[..., k + 1], w)


@pytest.mark.long
def test_a_memory_learns_what_a_black_box_cannot(delayed: Dataset) -> None:
    """In one state, machines accelerate differently: the drive has lagged for a shorter or a longer time."""
    errors = {}
    for name, kind in {
        "f_bb": lambda bench, scale, generator: BlackBox(bench, scale, generator, 16),
        "narx": lambda bench, scale, generator: Narx(bench, scale, generator, 16, 6),
        "rnn": lambda bench, scale, generator: Recurrent(bench, scale, generator, 16),
    }.items():
        model = one_step.fit(kind, delayed, TRAIN, 0, 400, 0.01, 64, 1, warm_up=6, horizon=10)
        theta, omega = delayed.initial_state(torch.arange(20, 24)[None])
        with torch.no_grad():
            found = model.simulate(
                theta, omega, delayed.conditions[torch.arange(20, 24)], SAMPLES - 1, PERIOD
            )[1]
        errors[name] = float((found[0] - delayed.omega.view(-1, SAMPLES)[20:24]).square().mean())
    assert errors["narx"] < 0.5 * errors["f_bb"] and errors["rnn"] < 0.5 * errors["f_bb"], errors


def test_a_gaussian_process_predicts_by_the_kernel_of_scikit_learn(delayed: Dataset) -> None:
    model = gaussian_process.fit(
        lambda bench, batch: GaussianProcess(bench, batch, 60), delayed, [*TRAIN, np.arange(5, 15)], 0, 50
    )
    theta, omega = delayed.theta[None, 50:80], delayed.omega[None, 50:80]
    q = delayed.conditions[delayed.owner()[50:80]]
    found = model.acceleration(theta.expand(2, -1), omega.expand(2, -1), q)
    for k in range(2):
        at = (raw_inputs(theta, omega, q)[0] / model.scale[k]).double().numpy()
        kernel = RBF(1.0)(at, model.at[k].numpy())
        expected = kernel @ model.weights[k, :, 0].numpy() + float(model.mean[k])
        np.testing.assert_allclose(found[k].numpy(), expected, rtol=1e-5, atol=1e-4)


def test_a_gaussian_process_recovers_a_planted_acceleration(delayed: Dataset) -> None:
    n, generator = len(delayed.lengths), np.random.default_rng(0)
    theta, omega = (torch.tensor(generator.uniform(0.0, high, (n, SAMPLES))).float() for high in (6.0, 20.0))
    omega[:, 1::2] = omega[:, ::2] + PERIOD * (30.0 * theta[:, ::2].sin() - 4.0 * omega[:, ::2])
    planted = Dataset(
        delayed.bench, theta.ravel(), omega.ravel(), delayed.offsets, delayed.conditions, delayed.period
    )
    # only every other sample follows from the one before
    start = planted.theta[::2], planted.omega[::2], (planted.omega[1::2] - planted.omega[::2]) / PERIOD
    owner = torch.arange(n).repeat_interleave(SAMPLES // 2)
    pairs = Dataset(
        delayed.bench,
        torch.stack([start[0], start[0]], 1).ravel(),
        torch.stack([start[1], start[1] + PERIOD * start[2]], 1).ravel(),
        torch.arange(len(owner) + 1) * 2,
        delayed.conditions[owner],
        PERIOD,
    )
    model = gaussian_process.fit(
        lambda bench, batch: GaussianProcess(bench, batch, 300), pairs, [np.arange(len(owner) // 2)], 0, 150
    )
    rest = torch.arange(len(owner) // 2, len(owner))
    found = model.acceleration(start[0][None, rest], start[1][None, rest], pairs.conditions[rest])
    assert float((found[0] - start[2][rest]).std() / start[2][rest].std()) < 0.05
