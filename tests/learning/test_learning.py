"""Every model of conf/model trains and simulates; plants are recovered; kernels equal their reference."""

from functools import partial
from pathlib import Path

import hydra
import numpy as np
import pytest
import torch

from pipeline import splits
from pipeline.__main__ import PROGRAM
from pipeline.cam_follower import free_run, one_step
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.conditions import Bench
from pipeline.cam_follower.dataset import Dataset
from pipeline.cam_follower.dynamics import Dynamics
from pipeline.cam_follower.held_out import explore, simulate_tests
from pipeline.cam_follower.motor import Motor
from pipeline.cam_follower.recipe import DrivetrainRecipe, load
from pipeline.cam_follower.relu_ode import Hybrid
from pipeline.cam_follower.sampler import Sampler, input_scale
from unmodelled.base.arrays import Indices
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.base.threads import one_thread
from unmodelled.learning.checkpoint import save

DRIVETRAIN = "/training@_here_: drivetrain\n"
MODELS = [name for name, file in PROGRAM.groups()["model"].items() if DRIVETRAIN in file.read_text()]
TRUTH = np.array([0.0045, 0.29, 0.075, 0.85, 0.2, 6.0])


def recipe(name: str, steps: int = 20) -> DrivetrainRecipe:
    small = [f"profile.steps={steps}", "profile.hybrid_steps=5"]
    config = PROGRAM.compose("train", [f"model={name}", *small])
    result = hydra.utils.instantiate(config["model"])
    assert isinstance(result, DrivetrainRecipe)
    return result


def trained(name: str, dataset: Dataset, folds: list[Indices], seed: int) -> Dynamics:
    found = recipe(name)
    return found.fit(found.dynamics, dataset, folds, seed)


@pytest.fixture(scope="module")
def planted(small_campaign: Campaign) -> Dataset:
    """The small campaign's settings, driven by a motor whose parameters are known."""
    mechanism = CamFollower()
    template = Dataset.of(small_campaign, mechanism)
    motor = Motor(template.bench, 1)
    motor.parameters_.data[:] = torch.tensor(TRUTH)
    motor.substeps = 10
    n = len(small_campaign)
    zero = torch.zeros(1, n)
    theta, omega, _ = motor.simulate(zero, zero, template.conditions, 250, 0.01)
    signals = {"theta": theta[0].ravel().numpy(), "omega": omega[0].ravel().numpy()}
    signals["t"] = np.tile(np.arange(251) * 0.01, n)
    campaign = Campaign(small_campaign.experiments, signals, np.arange(n + 1) * 251, {"data": "virtual"})
    return Dataset.of(campaign, mechanism)


@pytest.mark.long
@pytest.mark.parametrize("name", MODELS)
def test_every_model_trains_saves_loads_and_simulates(
    name: str, planted: Dataset, small_campaign: Campaign, tmp_path: Path
) -> None:
    folds = splits.interpolation(small_campaign.experiments, folds=2)
    stack = [f.train for f in folds for _ in range(2)]
    model = trained(name, planted, stack, seed=0)
    save(model, tmp_path / "model.pt", {"folds": ["a"], "repeats": 2})
    again, about = load(tmp_path / "model.pt", recipe(name).dynamics, planted)
    assert about == {"folds": ["a"], "repeats": 2}
    exp = small_campaign.experiments["exp"].to_numpy()
    first, second = (simulate_tests(m, planted, folds, 2, exp).errors for m in (model, again))
    assert first.equals(second)
    assert np.isfinite(first["omega_mse"]).all()
    assert len(first) == 2 * sum(len(f.test) for f in folds)
    force = explore(model, planted, folds, 2, exp)
    assert len(force) == 4 * len(exp)
    assert np.isfinite(force["f_min"]).all()


@pytest.mark.long
@pytest.mark.parametrize("name", MODELS)
def test_a_stack_equals_its_members(name: str, planted: Dataset) -> None:
    """A batched simulation gives what each model gives alone."""
    model = trained(name, planted, [np.arange(10), np.arange(10, 25)], seed=0)
    theta, omega = planted.initial_state(torch.arange(4).expand(2, -1))
    q = planted.conditions[torch.arange(4)]
    together = model.acceleration(theta + 1.0, omega + 5.0, q)
    swapped = model.acceleration(theta.flip(0) + 1.0, omega.flip(0) + 5.0, q)
    torch.testing.assert_close(together, swapped)
    one = model.acceleration(theta[:, :1] + 1.0, omega[:, :1] + 5.0, planted.conditions[torch.arange(1)])
    torch.testing.assert_close(together[:, :1], one, rtol=1e-5, atol=1e-4)


@pytest.mark.long
@pytest.mark.parametrize("name", ["f_h2", "motor", "best"])
def test_the_same_seed_gives_the_same_model(name: str, planted: Dataset) -> None:
    folds = [np.arange(12)]
    first, second = (trained(name, planted, folds, seed=3).state_dict() for _ in range(2))
    for key, value in first.items():
        assert torch.equal(value, second[key]), key


def test_the_planted_motor_is_recovered(planted: Dataset) -> None:
    model = free_run.fit(Motor, planted, [np.arange(26)], seed=0, starts=8)
    found = model.parameters_[0].numpy()
    # all torques and the inertia may scale together a little: only the follower's small load fixes the scale
    np.testing.assert_allclose(found[:3], TRUTH[:3], rtol=0.05)
    np.testing.assert_allclose(found[1] / found[2], TRUTH[1] / TRUTH[2], rtol=0.02)
    omega = np.linspace(1.0, 25.0, 20)
    torque = [p[3] - p[4] * np.exp(-omega / p[5]) for p in (found, TRUTH)]
    np.testing.assert_allclose(torque[0], torque[1], rtol=0.05)


def test_a_start_that_stalls_does_not_trap_the_identification(planted: Dataset) -> None:
    """From a motor too weak to turn, the screen still finds the way out."""
    runs = np.arange(26)
    task = free_run.problem(planted, runs, 2.0, 2, 0.15)
    weak = np.array([0.01, 0.05, 0.5, 2.5, 0.1, 5.0])
    stalled = float((task.residual(free_run.unit(weak)) ** 2).sum())
    found = free_run.identify(task, weak, np.random.default_rng(0), starts=32)
    assert float((task.residual(free_run.unit(found)) ** 2).sum()) < 0.5 * stalled


def test_the_compiled_residual_equals_the_torch_reference(planted: Dataset) -> None:
    runs = np.arange(8)
    task = free_run.problem(planted, runs, 2.0, 2, 1e9)
    parameters = TRUTH * 1.1
    motor = Motor(planted.bench, 1).double()
    motor.parameters_.data[:] = torch.tensor(parameters)
    start = [x.double() for x in planted.initial_state(torch.arange(8)[None])]
    theta, omega, _ = motor.simulate(start[0], start[1], planted.conditions[torch.arange(8)], 320, 0.01)
    ours = task.residual(free_run.unit(parameters)).reshape(task.shape)
    for j in range(8):
        samples = slice(int(planted.offsets[j]), int(planted.offsets[j]) + task.shape[1])
        angle = np.maximum.accumulate(planted.theta[samples].double().numpy())
        reference = np.interp(angle, np.maximum.accumulate(theta[0, j].numpy()), omega[0, j].numpy())
        expected = (reference - planted.omega[samples].double().numpy()) * task.weight[j]
        # the kernel interpolates between substeps, the reference between samples
        np.testing.assert_allclose(ours[j], expected, atol=2e-3)


def test_the_identification_leaves_torch_its_threads(planted: Dataset) -> None:
    # a parallel kernel of numba gives torch all cores, and beside another process trainings wait for them
    task = free_run.problem(planted, np.arange(4), 1.0, 2, 0.15)
    with one_thread():
        task.residual(free_run.unit(TRUTH))
        assert torch.get_num_threads() == 1


def test_scalers_see_training_data_only(planted: Dataset) -> None:
    inputs = torch.randn(len(planted.theta), 3)
    fold = np.arange(5)
    before = input_scale(inputs, planted, [fold])
    outside = planted.samples_of(np.arange(5, 30))
    inputs[outside] *= 100.0
    assert torch.equal(before, input_scale(inputs, planted, [fold]))


def test_the_sampler_draws_training_windows_only(planted: Dataset) -> None:
    folds = [np.array([3, 5]), np.array([7, 8, 9])]
    sampler = Sampler(planted, folds, torch.Generator().manual_seed(0))
    runs, first = sampler.draw(500, horizon=20)
    for fold, row, start in zip(folds, runs, first, strict=True):
        assert set(row.tolist()) == set(fold.tolist())
        assert torch.equal(planted.owner()[start], row)
        assert torch.equal(planted.owner()[start + 20], row)


def test_a_checkpoint_of_another_model(planted: Dataset, tmp_path: Path) -> None:
    model = trained("f_h1", planted, [np.arange(5)], seed=0)
    save(model, tmp_path / "model.pt", {})
    with pytest.raises(BadInput, match="is a checkpoint of SoftHybrid, another model"):
        load(tmp_path / "model.pt", recipe("f_h2").dynamics, planted)
    with pytest.raises(BadInput, match="does not fit"):
        load(tmp_path / "model.pt", partial(recipe("f_h1").dynamics, hidden=7), planted)


def test_training_lowers_the_one_step_error(planted: Dataset) -> None:
    def error(steps: int) -> float:
        model = one_step.fit(partial(Hybrid, hidden=16), planted, [np.arange(20)], 0, steps, 0.01, 100, 1)
        now = planted.samples_of(np.arange(20))
        now = now[planted.owner()[now] == planted.owner()[now + 1]]
        q = planted.conditions[planted.owner()[now]]
        step = model.acceleration(planted.theta[None, now], planted.omega[None, now], q) * planted.period
        return float((planted.omega[now] + step - planted.omega[now + 1]).detach().square().mean())

    assert error(400) < 0.1 * error(1)


def test_an_unknown_cam_is_refused(small_campaign: Campaign) -> None:
    bench = Bench.of(CamFollower(), small_campaign.experiments)
    other = small_campaign.experiments.assign(H=0.05)
    with pytest.raises(BadInput, match=r"no cam with \(H, beta\)"):
        bench.conditions(other)
