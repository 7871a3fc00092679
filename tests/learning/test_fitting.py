"""Every hybrid model of conf/model trains; plants are recovered; killed trainings go on; failures stay
alone.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import hydra
import numpy as np
import pandas as pd
import pytest
import torch
from omegaconf import OmegaConf

from pipeline.__main__ import PROGRAM
from pipeline.rigs.pendulum import PendulumCampaign
from pipeline.rigs.slider_crank import SliderCrankCampaign
from unmodelled.base.errors import BadInput
from unmodelled.learning import fitting
from unmodelled.learning.augmented import AugmentedRecipe
from unmodelled.learning.fit import Fit
from unmodelled.learning.held_out import free_runs, learned_efforts, measured_samples
from unmodelled.learning.on_device import train_on
from unmodelled.learning.resume import checkpoint_beside
from unmodelled.learning.splits import leave_one_out
from unmodelled.learning.structures import one_per_port, physics_only
from unmodelled.learning.windows import Progress, Windows
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

ROOT = Path(__file__).parents[2]
#: Models of any system build on one of these files of conf/training/.
TRAINING = re.compile(r"/training@_here_: (one_step|multi_step|shooting)\n")
MODELS = [name for name, file in PROGRAM.groups()["model"].items() if TRAINING.search(file.read_text())]
#: Models that the quick tests train: none, one and two networks, one step at a time and over windows.
QUICK = {"physics", "black_box", "nnap_split"}
TINY = ["epochs=2", "recurrent_epochs=2", "window_epochs=2", "shooting_epochs=4"]


@pytest.fixture(scope="module")
def slider(tmp_path_factory: pytest.TempPathFactory) -> tuple[System, Logs]:
    folder = tmp_path_factory.mktemp("slider") / "logs"
    SliderCrankCampaign(profiles=[1, 6], samples=340).write(folder, 0)
    system = read_system(ROOT / "systems" / "slider_crank.yaml")
    return system, read_logs(folder, system)


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory: pytest.TempPathFactory) -> tuple[System, Logs]:
    folder = tmp_path_factory.mktemp("pendulum") / "logs"
    PendulumCampaign(runs=4, duration=3.0).write(folder, 0)
    system = read_system(ROOT / "systems" / "pendulum.yaml")
    return system, read_logs(folder, system)


def fitted_to(recipe: AugmentedRecipe, data: tuple[System, Logs], out: Path, seed: int = 0) -> Fit:
    """Fit to all but one experiment, with a checkpoint beside `out` as the command line keeps it."""
    system, logs = data
    checkpoint = checkpoint_beside(out)
    found = recipe.fit(system, logs, leave_one_out(logs.experiments), seed=seed, checkpoint=checkpoint)
    found.save(out)
    checkpoint.unlink(missing_ok=True)
    return found


def recipe_of(name: str) -> AugmentedRecipe:
    overrides = [f"model={name}", *(f"++profile.{change}" for change in TINY)]
    config: Any = PROGRAM.compose("train", overrides)
    found = hydra.utils.instantiate(OmegaConf.create(OmegaConf.to_container(config, resolve=False))["model"])
    assert isinstance(found, AugmentedRecipe)
    return found


def fitted(recipe: AugmentedRecipe, data: tuple[System, Logs], out: Path, seed: int = 0) -> pd.DataFrame:
    fitted_to(recipe, data, out, seed)
    return pd.read_parquet(out / "history.parquet").drop(columns="seconds")


PLAIN = AugmentedRecipe(one_per_port(hidden=8), Windows(5, 6, batch=64), method="rk4", hold=1.0)


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.long) for name in MODELS]
)
def test_every_model_trains_saves_loads_and_simulates(
    name: str, slider: tuple[System, Logs], tmp_path: Path
) -> None:
    recipe, (system, logs) = recipe_of(name), slider
    history = fitted(recipe, slider, tmp_path)
    assert np.isfinite(history["loss"]).all()
    assert len(history) == 4 * recipe.windows.epochs
    model, about = recipe.load(system, tmp_path)
    folds = leave_one_out(logs.experiments)
    assert about["folds"] == [f.name for f in folds]
    tests = {fold.name: fold.test for fold in folds}
    errors = free_runs(model, logs, tests, 1, recipe.integration(system, logs.period)).errors
    assert set(errors["state"]) == {"theta", "omega"}
    assert np.isfinite(errors["rmse"]).all()
    efforts = learned_efforts(model, logs, {fold.name: fold.train for fold in folds}, 1)
    assert len(efforts) == logs.offsets[-1]


def test_inputs_that_the_system_holds_are_held(slider: tuple[System, Logs]) -> None:
    system, one = slider[0], slider[0].inputs[0]
    held = replace(system, inputs=(replace(one, hold=True),))
    assert PLAIN.integration(system, 0.01).hold == 1.0
    assert PLAIN.integration(held, 0.01).hold == 0.0
    both = replace(system, inputs=(replace(one, hold=True), replace(one, name="other")))
    with pytest.raises(BadInput, match=f"inputs: {one.name} hold their values .* give all inputs"):
        PLAIN.integration(both, 0.01)


@pytest.mark.long
def test_friction_that_the_model_leaves_out_is_learned_and_damping_identified(
    pendulum: tuple[System, Logs], tmp_path: Path
) -> None:
    """The planted Coulomb friction of 0.06 N m, with J unknown by 30 %."""
    system, logs = pendulum
    wrong = system.with_values({"J": 0.026, "b": 0.015})
    recipe = replace(
        PLAIN,
        networks=one_per_port(hidden=16, inputs=["omega"]),
        windows=Windows(20, 40, rate=0.01, physics_rate=0.01),
        identify=("J",),
    )
    model = fitted_to(recipe, (wrong, logs), tmp_path).model
    J = model.physics()[:, 0].detach().numpy()
    np.testing.assert_allclose(J, 0.02, rtol=0.03)
    omega = torch.tensor([[-3.0], [-1.0], [1.0], [3.0]]).double().expand(len(J), -1, -1)
    effort = model.efforts_of(omega)[..., 0].mean(0).detach().numpy()
    np.testing.assert_allclose(effort, [-0.06, -0.06, 0.06, 0.06], atol=0.012)


def test_a_killed_training_goes_on_to_the_same_result(
    pendulum: tuple[System, Logs], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = replace(PLAIN, identify=("b",), spread=0.5)
    whole = fitted(recipe, pendulum, tmp_path / "whole")
    monkeypatch.setattr(fitting, "INTERVAL", 0.0)
    train, steps = Windows.train, iter(range(100))

    def killed(self: Windows, problem: Any, stack: list[Progress]) -> Any:
        for done in train(self, problem, stack):
            yield done
            if next(steps) == 1:
                raise KeyboardInterrupt

    monkeypatch.setattr(Windows, "train", killed)
    with pytest.raises(KeyboardInterrupt):
        fitted(recipe, pendulum, tmp_path / "part")
    checkpoint = tmp_path / ".part.checkpoint"
    assert checkpoint.exists() and not (tmp_path / "part" / "model.pt").exists()
    again = fitted(recipe, pendulum, tmp_path / "part")
    assert not checkpoint.exists()
    pd.testing.assert_frame_equal(again, whole)
    states = [torch.load(tmp_path / f / "model.pt", weights_only=True)["state"] for f in ("whole", "part")]
    assert all(torch.equal(states[0][key], states[1][key]) for key in states[0])


@pytest.mark.parametrize("content", [b"", b"nonsense", None])
def test_a_checkpoint_of_another_training_is_not_taken(
    content: bytes | None, pendulum: tuple[System, Logs], tmp_path: Path
) -> None:
    whole = fitted(PLAIN, pendulum, tmp_path / "one")
    checkpoint = tmp_path / ".two.checkpoint"
    if content is None:
        torch.save({"class": "Progress", "state": {}, "about": {"identity": "another"}}, checkpoint)
    else:
        checkpoint.write_bytes(content)
    pd.testing.assert_frame_equal(fitted(PLAIN, pendulum, tmp_path / "two"), whole)


def test_a_diverging_fold_is_reported_and_leaves_the_others_alone(
    pendulum: tuple[System, Logs],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    whole = fitted(PLAIN, pendulum, tmp_path / "whole")
    start = Progress.start

    def blown_up(model: Any, member: int) -> Progress:
        progress = start(model, member)
        if member == 2:
            progress.weights[:] = 1e300
        return progress

    monkeypatch.setattr(Progress, "start", blown_up)
    history = fitted(PLAIN, pendulum, tmp_path / "part")
    assert "fold run3, repeat 0: diverged" in capsys.readouterr().err
    assert (tmp_path / "part" / "fit.json").read_text().count("run3") == 2  # a fold, and diverged
    rest = whole[whole["fold"] != "run3"].reset_index(drop=True)
    pd.testing.assert_frame_equal(history.reset_index(drop=True), rest)


def test_torch_on_a_device_trains_like_the_compiled_loop(pendulum: tuple[System, Logs]) -> None:
    system, logs = pendulum
    recipe = replace(PLAIN, identify=("b", "J"), spread=0.3, windows=Windows(3, 1, batch=1000))
    data = measured_samples(logs)
    runs = [fold.train for fold in leave_one_out(logs.experiments)]
    stacks = []
    for device in (None, "cpu"):
        problem = recipe.problem(system, data, logs.period, runs, 3)
        stack = [Progress.start(problem.model, m) for m in range(len(runs))]
        if device is None:
            for _ in recipe.windows.train(problem, stack):
                pass
        else:
            train_on(device, problem, recipe.windows, stack)
        stacks.append(stack)
    for one, other in zip(*stacks, strict=True):
        np.testing.assert_allclose(other.losses, one.losses, rtol=1e-6)
        np.testing.assert_allclose(other.p, one.p, rtol=1e-6)
        np.testing.assert_allclose(other.weights, one.weights, atol=1e-6)


def test_bad_requests_are_refused_in_one_line(pendulum: tuple[System, Logs]) -> None:
    system, logs = pendulum
    folds = leave_one_out(logs.experiments)
    cases: list[tuple[AugmentedRecipe, str, str]] = [
        (replace(PLAIN, identify=("mass",)), "cpu", "unknown parameter 'mass'"),
        (replace(PLAIN, windows=Windows(10_000, 1)), "cpu", "no training experiment has more than 10000"),
        (PLAIN, "abacus", "device abacus: cannot be used"),
        (replace(PLAIN, networks=one_per_port(hidden=4, inputs=["speed"])), "cpu", "speed"),
    ]
    for recipe, device, words in cases:
        with pytest.raises(BadInput, match=words) as caught:
            recipe.fit(system, logs, folds, device=device)
        assert "\n" not in str(caught.value)


def test_a_start_from_another_model_is_refused(pendulum: tuple[System, Logs], tmp_path: Path) -> None:
    system, _ = pendulum
    fitted(replace(PLAIN, networks=physics_only()), pendulum, tmp_path / "physics")
    with pytest.raises(BadInput, match="does not fit the configured model"):
        PLAIN.load(system, tmp_path / "physics")
