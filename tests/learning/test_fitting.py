"""Training from Python: every model of conf/model, saved fits, plants that are recovered, killed trainings
that go on, failures that stay alone, and what is refused.
"""

import re
import subprocess
import sys
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
from tests.machines.folders import changed
from tests.machines.known import recorded
from unmodelled import BadInput, Evaluation, Fit, Logs, System, evaluate, one_per_port, read_logs, train
from unmodelled.learning import fitting
from unmodelled.learning.adam import Adam
from unmodelled.learning.augmented import AugmentedRecipe
from unmodelled.learning.checkpoint import read_checkpoint, write_checkpoint
from unmodelled.learning.held_out import free_runs, learned_efforts, measured_samples
from unmodelled.learning.on_device import train_on
from unmodelled.learning.recipe import refused, required
from unmodelled.learning.resume import checkpoint_beside
from unmodelled.learning.splits import Fold, leave_one_out
from unmodelled.learning.structures import Structure, black_box, conservative_and_dissipative, physics_only
from unmodelled.learning.windows import Progress, Windows

Data = tuple[System, Logs]
PLAIN = AugmentedRecipe(one_per_port(hidden=8), Windows(5, 6, batch=64), method="rk4", hold=1.0)
SHORT = Windows(5, 3, batch=64)
STRUCTURES = {
    "physics": physics_only(),
    "ports": one_per_port(4, ["sin(theta)", "mod(theta, 2*pi)", "omega"]),
    "split": conservative_and_dissipative(4, 1e-5),
    "black": black_box(4, ["theta", "omega", "torque"]),
}


@pytest.fixture(scope="module")
def three_runs(tmp_path_factory: pytest.TempPathFactory) -> Data:
    return recorded(PendulumCampaign(runs=3, duration=2.0), "pendulum", tmp_path_factory.mktemp("three"))


def recipe(networks: Structure) -> AugmentedRecipe:
    return replace(PLAIN, networks=networks, windows=SHORT)


@pytest.fixture(scope="module")
def fit(three_runs: Data) -> Fit:
    return train(*three_runs, recipe(one_per_port(8)), repeats=2, seed=1)


@pytest.mark.parametrize("name", STRUCTURES)
def test_a_saved_fit_predicts_the_same(name: str, three_runs: Data, tmp_path: Path) -> None:
    fit = train(*three_runs, recipe(STRUCTURES[name]))
    fit.save(tmp_path / "fit")
    again = Fit.load(tmp_path / "fit")
    state, other = fit.model.state_dict(), again.model.state_dict()
    assert set(state) == set(other) and all(torch.equal(state[key], other[key]) for key in state)
    for key in ("trained_on", "integration", "diverged", "seed", "repeats", "horizon", "epochs", "seconds"):
        assert getattr(again, key) == getattr(fit, key), key
    pd.testing.assert_frame_equal(again.history, fit.history)
    first, second = (evaluate(f, three_runs[1]) for f in (fit, again))
    for key, table in first.tables().items():
        pd.testing.assert_frame_equal(second.tables()[key], table)


def test_a_fit_with_another_key_of_the_integration_is_refused(fit: Fit, tmp_path: Path) -> None:
    fit.save(tmp_path / "fit")
    content = read_checkpoint(tmp_path / "fit" / "model.pt")
    content["about"]["integration"]["order"] = 2
    write_checkpoint(tmp_path / "fit" / "model.pt", content)
    with pytest.raises(BadInput, match=r"model\.pt: integration: has the unknown key 'order'"):
        Fit.load(tmp_path / "fit")


def test_models_are_judged_on_what_they_were_not_trained_on(fit: Fit, three_runs: Data) -> None:
    _, logs = three_runs
    found = evaluate(fit, logs)
    pairs = found.errors[["fold", "id"]].drop_duplicates()
    assert fit.folds == list(logs.ids) and (pairs["fold"] == pairs["id"]).all() and len(pairs) == 3
    assert found.errors["repeat"].unique().tolist() == [0, 1]
    for fold, ids in fit.trained_on.items():
        assert set(ids) == set(logs.ids) - {fold}


def test_other_experiments_are_all_predicted(fit: Fit, three_runs: Data, tmp_path: Path) -> None:
    system, _ = three_runs
    PendulumCampaign(runs=2, duration=1.0).write(tmp_path / "logs", 5)
    table = pd.read_csv(tmp_path / "logs" / "experiments.csv")
    table.assign(id=["new1", "new2"]).to_csv(tmp_path / "logs" / "experiments.csv", index=False)
    found = evaluate(fit, read_logs(tmp_path / "logs", system))
    assert found.errors.groupby(["fold", "repeat"])["id"].unique().map(set).tolist() == 6 * [{"new1", "new2"}]
    assert found.efforts.empty


def test_results_print_themselves(fit: Fit, three_runs: Data) -> None:
    found = evaluate(fit, three_runs[1])
    assert str(fit).splitlines()[0] == "6 models of pendulum (3 folds): 8 hidden units in joint"
    assert str(fit).splitlines()[1].startswith("b: ") and "N m s/rad" in repr(fit)
    assert [line.partition(":")[0] for line in repr(found).splitlines()] == ["theta", "omega"]
    assert "<td>b</td>" in fit._repr_html_() and "<td>rad/s</td>" in found._repr_html_()
    (row,) = fit.table().to_dict("records")
    assert (row["parameter"], row["known"]) == ("b", 0.01) and row["low"] <= row["median"] <= row["high"]
    rows = found.table().set_index("state")
    assert rows["runs"].tolist() == [6, 6] and rows["unit"].tolist() == ["rad", "rad/s"]
    assert rows.loc["omega", "median"] == found.errors.query("state == 'omega'")["rmse"].median()


def test_a_figure_shows_measured_and_simulated_states(fit: Fit, three_runs: Data) -> None:
    found: Evaluation = evaluate(fit, three_runs[1])
    axes = found.plot("run2").axes
    assert [axis.get_ylabel() for axis in axes] == ["theta [rad]", "omega [rad/s]"]
    measured = np.asarray(axes[1].lines[0].get_ydata())
    np.testing.assert_array_equal(measured, three_runs[1].x[three_runs[1].rows(1), 1])
    with pytest.raises(BadInput, match="experiment: 'run9' must be one of the held-out run1, run2, run3"):
        found.plot("run9")


def test_a_fit_continues_another(fit: Fit, three_runs: Data) -> None:
    further = train(*three_runs, recipe(one_per_port(8)), repeats=2, seed=1, start=fit)
    assert further.history.groupby("fold")["loss"].first().mean() < fit.history["loss"].iloc[0]
    with pytest.raises(BadInput, match="must have 3 models"):
        train(*three_runs, recipe(one_per_port(8)), start=fit)


def test_what_cannot_be_evaluated_is_refused(fit: Fit, three_runs: Data) -> None:
    system, logs = three_runs

    def halves(experiments: pd.DataFrame) -> list[Fold]:
        rows = np.arange(len(experiments))
        return [Fold("all but the last", rows[:-1], rows[-1:])]

    one = train(system, logs, recipe(physics_only()), split=halves)
    assert evaluate(one, logs).errors["id"].unique().tolist() == ["run3"]
    everything = Fit(**{**vars(one), "trained_on": {"all": logs.ids}})
    with pytest.raises(BadInput, match="every experiment was trained on"):
        evaluate(everything, logs)


def test_a_fit_replaces_no_file_of_a_user(fit: Fit, tmp_path: Path) -> None:
    fit.save(tmp_path / "fit")
    fit.save(tmp_path / "fit")  # its own
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "system.yaml").write_text("mine")
    with pytest.raises(BadInput, match=r"has no file \.made_by"):
        fit.save(tmp_path / "mine")
    assert (tmp_path / "mine" / "system.yaml").read_text() == "mine"


@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("system.yaml", "joint:", "elbow:", "names 'joint', which .*system.yaml does not have"),
        ("system.yaml", "  b: {", "  bb: {", "system.yaml"),
        ("model.pt", None, None, "model.pt: no such file"),
        ("history.parquet", None, None, "history.parquet: no such file"),
    ],
)
def test_damage_is_refused(name: str, old: str, new: str, words: str, fit: Fit, tmp_path: Path) -> None:
    fit.save(tmp_path)
    if old is None:
        (tmp_path / name).unlink()
    else:
        (tmp_path / name).write_text(changed((tmp_path / name).read_text(), (old, new)))
    with pytest.raises(BadInput, match=words):
        Fit.load(tmp_path)


def test_a_model_says_which_data_it_needs() -> None:
    file, logs = Path("system.yaml"), Path("logs")
    assert required(file, logs) == (file, logs)
    refused(None, None)
    with pytest.raises(BadInput, match=r"needs system=... and logs=...: system and logs are missing"):
        required(None, None)
    words = r"only hybrid models of a system take system=... and start=...: leave them"
    with pytest.raises(BadInput, match=words):
        refused(file, None, Path("fit"))


#: Models of any system build on one of these files of conf/training/.
TRAINING = re.compile(r"/training@_here_: (one_step|multi_step|shooting)\n")
MODELS = [name for name, file in PROGRAM.groups()["model"].items() if TRAINING.search(file.read_text())]
#: Models that the quick tests train: no network and one, one step at a time and over windows.
QUICK = {"physics", "black_box"}
TINY = ["epochs=2", "recurrent_epochs=2", "window_epochs=2", "shooting_epochs=4"]


@pytest.fixture(scope="module")
def slider(tmp_path_factory: pytest.TempPathFactory) -> Data:
    campaign = SliderCrankCampaign(profiles=[1, 6], samples=340)
    return recorded(campaign, "slider_crank", tmp_path_factory.mktemp("slider"))


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory: pytest.TempPathFactory) -> Data:
    return recorded(PendulumCampaign(runs=4, duration=3.0), "pendulum", tmp_path_factory.mktemp("pendulum"))


def fitted_to(recipe: AugmentedRecipe, data: Data, out: Path, seed: int = 0) -> Fit:
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


def fitted(recipe: AugmentedRecipe, data: Data, out: Path, seed: int = 0) -> pd.DataFrame:
    fitted_to(recipe, data, out, seed)
    return pd.read_parquet(out / "history.parquet").drop(columns="seconds")


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.long) for name in MODELS]
)
def test_every_model_trains_saves_loads_and_simulates(name: str, slider: Data, tmp_path: Path) -> None:
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


def test_inputs_that_the_system_holds_are_held(slider: Data) -> None:
    system, one = slider[0], slider[0].inputs[0]
    held = replace(system, inputs=(replace(one, hold=True),))
    assert PLAIN.integration(system, 0.01).hold == 1.0
    assert PLAIN.integration(held, 0.01).hold == 0.0
    both = replace(system, inputs=(replace(one, hold=True), replace(one, name="other")))
    with pytest.raises(BadInput, match=f"inputs: {one.name} hold their values .* give all inputs"):
        PLAIN.integration(both, 0.01)


@pytest.mark.long
def test_friction_that_the_model_lacks_is_learned_and_damping_found(pendulum: Data, tmp_path: Path) -> None:
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
    pendulum: Data, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
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
def test_other_checkpoints_are_not_taken(content: bytes | None, pendulum: Data, tmp_path: Path) -> None:
    whole = fitted(PLAIN, pendulum, tmp_path / "one")
    checkpoint = tmp_path / ".two.checkpoint"
    if content is None:
        torch.save({"class": "Progress", "state": {}, "about": {"identity": "another"}}, checkpoint)
    else:
        checkpoint.write_bytes(content)
    pd.testing.assert_frame_equal(fitted(PLAIN, pendulum, tmp_path / "two"), whole)


def test_a_diverging_fold_is_reported_and_leaves_the_others_alone(
    pendulum: Data, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
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


def test_torch_on_a_device_trains_like_the_compiled_loop(pendulum: Data) -> None:
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


def test_bad_requests_are_refused_in_one_line(pendulum: Data) -> None:
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


LOADED = """
import sys, torch
from unmodelled.learning.adam import Adam
weights = torch.nn.Parameter(torch.ones(3))
optimiser = Adam([weights], lr=0.1)
optimiser.zero_grad()
weights.square().sum().backward()
optimiser.step()
print(*sorted({name.split(".")[1] for name in sys.modules if name.startswith("torch.")}))
"""


def trained(optimiser: type[torch.optim.Optimizer]) -> list[torch.Tensor]:
    """Weights after some steps with two groups and a falling rate."""
    generator = torch.Generator().manual_seed(0)
    weights = [torch.nn.Parameter(torch.randn(n, generator=generator)) for n in (5, 3)]
    adam = optimiser([{"params": [w]} for w in weights], lr=0.1)  # type: ignore[call-arg]
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(adam, 10)
    for _ in range(10):
        adam.zero_grad()
        sum(w.pow(4).sum() for w in weights).backward()  # type: ignore[union-attr]
        adam.step()
        schedule.step()
    return [w.detach() for w in weights]


def test_the_steps_are_those_of_torch() -> None:
    assert all(torch.equal(a, b) for a, b in zip(trained(Adam), trained(torch.optim.Adam), strict=True))


@pytest.mark.long
def test_no_compiler_is_loaded() -> None:
    done = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, check=True)
    assert "optim" in done.stdout.split() and "_dynamo" not in done.stdout.split()
