"""Training and evaluation from Python: results that print, save and load, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch

from pipeline.rigs.pendulum import PendulumCampaign
from unmodelled.base.errors import BadInput
from unmodelled.learning.augmented import AugmentedRecipe
from unmodelled.learning.evaluation import Evaluation, evaluate
from unmodelled.learning.fit import Fit
from unmodelled.learning.recipe import refused, required
from unmodelled.learning.splits import Fold
from unmodelled.learning.structures import (
    Structure,
    black_box,
    conservative_and_dissipative,
    one_per_port,
    physics_only,
)
from unmodelled.learning.training import train
from unmodelled.learning.windows import Windows
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

ROOT = Path(__file__).parents[2]
SHORT = Windows(5, 3, batch=64)
STRUCTURES = {
    "physics": physics_only(),
    "ports": one_per_port(4, ["sin(theta)", "mod(theta, 2*pi)", "omega"]),
    "split": conservative_and_dissipative(4, 1e-5),
    "black": black_box(4, ["theta", "omega", "torque"]),
}


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory: pytest.TempPathFactory) -> tuple[System, Logs]:
    folder = tmp_path_factory.mktemp("pendulum") / "logs"
    PendulumCampaign(runs=3, duration=2.0).write(folder, 0)
    system = read_system(ROOT / "systems" / "pendulum.yaml")
    return system, read_logs(folder, system)


def recipe(networks: Structure) -> AugmentedRecipe:
    return AugmentedRecipe(networks, SHORT, method="rk4", hold=1.0)


@pytest.fixture(scope="module")
def fit(pendulum: tuple[System, Logs]) -> Fit:
    return train(*pendulum, recipe(one_per_port(8)), repeats=2, seed=1)


@pytest.mark.parametrize("name", STRUCTURES)
def test_a_saved_fit_predicts_the_same(name: str, pendulum: tuple[System, Logs], tmp_path: Path) -> None:
    fit = train(*pendulum, recipe(STRUCTURES[name]))
    fit.save(tmp_path / "fit")
    again = Fit.load(tmp_path / "fit")
    state, other = fit.model.state_dict(), again.model.state_dict()
    assert set(state) == set(other) and all(torch.equal(state[key], other[key]) for key in state)
    for key in ("trained_on", "integration", "diverged", "seed", "repeats", "horizon", "epochs", "seconds"):
        assert getattr(again, key) == getattr(fit, key), key
    pd.testing.assert_frame_equal(again.history, fit.history)
    first, second = (evaluate(f, pendulum[1]) for f in (fit, again))
    for key, table in first.tables().items():
        pd.testing.assert_frame_equal(second.tables()[key], table)


def test_models_are_judged_on_what_they_were_not_trained_on(fit: Fit, pendulum: tuple[System, Logs]) -> None:
    _, logs = pendulum
    found = evaluate(fit, logs)
    pairs = found.errors[["fold", "id"]].drop_duplicates()
    assert fit.folds == list(logs.ids) and (pairs["fold"] == pairs["id"]).all() and len(pairs) == 3
    assert found.errors["repeat"].unique().tolist() == [0, 1]
    for fold, ids in fit.trained_on.items():
        assert set(ids) == set(logs.ids) - {fold}


def test_other_experiments_are_all_predicted(fit: Fit, pendulum: tuple[System, Logs], tmp_path: Path) -> None:
    system, _ = pendulum
    PendulumCampaign(runs=2, duration=1.0).write(tmp_path / "logs", 5)
    table = pd.read_csv(tmp_path / "logs" / "experiments.csv")
    table.assign(id=["new1", "new2"]).to_csv(tmp_path / "logs" / "experiments.csv", index=False)
    found = evaluate(fit, read_logs(tmp_path / "logs", system))
    assert found.errors.groupby(["fold", "repeat"])["id"].unique().map(set).tolist() == 6 * [{"new1", "new2"}]
    assert found.efforts.empty


def test_results_print_themselves(fit: Fit, pendulum: tuple[System, Logs]) -> None:
    found = evaluate(fit, pendulum[1])
    assert str(fit).splitlines()[0] == "6 models of pendulum (3 folds): 8 hidden units in joint"
    assert str(fit).splitlines()[1].startswith("b: ") and "N m s/rad" in repr(fit)
    assert [line.partition(":")[0] for line in repr(found).splitlines()] == ["theta", "omega"]
    assert "<td>b</td>" in fit._repr_html_() and "<td>rad/s</td>" in found._repr_html_()
    (row,) = fit.table().to_dict("records")
    assert (row["parameter"], row["known"]) == ("b", 0.01) and row["low"] <= row["median"] <= row["high"]
    rows = found.table().set_index("state")
    assert rows["runs"].tolist() == [6, 6] and rows["unit"].tolist() == ["rad", "rad/s"]
    assert rows.loc["omega", "median"] == found.errors.query("state == 'omega'")["rmse"].median()


def test_a_figure_shows_measured_and_simulated_states(fit: Fit, pendulum: tuple[System, Logs]) -> None:
    found: Evaluation = evaluate(fit, pendulum[1])
    axes = found.plot("run2").axes
    assert [axis.get_ylabel() for axis in axes] == ["theta [rad]", "omega [rad/s]"]
    measured = np.asarray(axes[1].lines[0].get_ydata())
    np.testing.assert_array_equal(measured, pendulum[1].x[pendulum[1].rows(1), 1])
    with pytest.raises(BadInput, match="experiment: 'run9' must be one of the held-out run1, run2, run3"):
        found.plot("run9")


def test_a_fit_continues_another(fit: Fit, pendulum: tuple[System, Logs]) -> None:
    further = train(*pendulum, recipe(one_per_port(8)), repeats=2, seed=1, start=fit)
    assert further.history.groupby("fold")["loss"].first().mean() < fit.history["loss"].iloc[0]
    with pytest.raises(BadInput, match="must have 3 models"):
        train(*pendulum, recipe(one_per_port(8)), start=fit)


def test_what_cannot_be_evaluated_is_refused(fit: Fit, pendulum: tuple[System, Logs]) -> None:
    system, logs = pendulum

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
def test_a_damaged_fit_is_refused(
    name: str, old: str | None, new: str, words: str, fit: Fit, tmp_path: Path
) -> None:
    fit.save(tmp_path)
    if old is None:
        (tmp_path / name).unlink()
    else:
        text = (tmp_path / name).read_text()
        assert old in text
        (tmp_path / name).write_text(text.replace(old, new))
    with pytest.raises(BadInput, match=words):
        Fit.load(tmp_path)


def test_a_model_says_which_data_it_needs() -> None:
    file, logs = Path("system.yaml"), Path("logs")
    assert required(file, logs) == (file, logs)
    refused(None, None)
    with pytest.raises(BadInput, match=r"needs system=... and logs=...: system and logs are missing"):
        required(None, None)
    with pytest.raises(
        BadInput, match=r"only hybrid models of a system take system=... and start=...: leave them"
    ):
        refused(file, None, Path("fit"))
