"""Sweeps as a user runs them: one after the other, side by side, by Optuna; and the verb compare."""

import inspect
import json
from pathlib import Path

import pandas as pd
import pytest
import yaml
from omegaconf import OmegaConf

from pipeline.stages.tune import tune
from tests.commands import python
from tests.machines.folders import text_of, write_runs
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.base.files import write_json
from unmodelled.base.markers import MARKER
from unmodelled.cli.command_line import _options_last
from unmodelled.cli.sweep.runs import FAILURE, OVERRIDES
from unmodelled.cli.verbs.compare import compare

SWEEP = ("-m", "pipeline", "simulate", "-m", "system=cart.yaml", "logs=logs", "hydra.sweep.dir=outputs/sweep")


@pytest.fixture
def cart(tmp_path: Path) -> Path:
    """A cart that is pushed, and a log of it that its system file does not explain."""
    (tmp_path / "cart.yaml").write_text(text_of("slide.yaml"))
    t = pd.Series(range(60)) * 0.01
    write_runs(tmp_path / "logs", [pd.DataFrame({"t": t, "F": 1.0, "x": 0.2 * t**2 + t**3})])
    return tmp_path


@pytest.fixture
def sweep(tmp_path: Path) -> Path:
    """Six runs of train, as they lie there afterwards; the last failed."""
    for number, (hidden, seed) in enumerate((h, s) for h in (4, 8, 16) for s in (0, 1)):
        run = tmp_path / "sweep" / str(number)
        (run / OVERRIDES).parent.mkdir(parents=True)
        (run / OVERRIDES).write_text(yaml.safe_dump([f"model.hidden={hidden}", f"seed={seed}"]))
        if number < 5:
            write_json(run / "fit.json", {"seconds": hidden + seed, "loss": 0.5})
        else:
            (run / FAILURE).write_text("features: no such file\n")
    return tmp_path / "sweep"


@pytest.mark.long
def test_runs_side_by_side_and_their_comparison(cart: Path) -> None:
    """A run that fails says so and leaves the others alone."""
    horizons = "horizon=0.05,-1,0.1"
    result = python(*SWEEP, horizons, EXP_LAUNCHER="joblib", OMP_NUM_THREADS="1", cwd=cart)
    assert result.returncode == 2, result.stderr
    assert "Done   3 out of   3" in result.stderr
    assert "error: horizon: must be a positive number of seconds, got -1" in result.stderr
    assert "Traceback" not in result.stderr
    runs = cart / "outputs" / "sweep"
    assert sorted(p.parent.name for p in runs.glob("*/simulation.json")) == ["0", "2"]
    result = python("-m", "pipeline", "compare", "outputs/sweep", "out=compared", cwd=cart)
    assert result.returncode == 0, result.stderr
    said = result.stdout.splitlines()
    assert said[0] == "3 runs, swept: horizon"
    assert said[1].startswith("smallest simulation.gap.known: ") and said[1].endswith("run 0 horizon=0.05")
    failed, last = result.stderr.splitlines()
    assert failed.startswith("without metrics: run 1 horizon=-1: horizon: must be a positive number")
    files = "comparison.csv, comparison.svg"
    assert last == f"wrote compared: {files}; open compared/comparison.svg"
    table = pd.read_csv(cart / "compared" / "comparison.csv", dtype={"run": str})
    assert table["run"].tolist() == ["0", "1", "2"] and table["horizon"].tolist() == [0.05, -1.0, 0.1]
    gaps = [json.loads((runs / n / "simulation.json").read_text())["gap"]["known"] for n in ("0", "2")]
    assert table["simulation.gap.known"].dropna().tolist() == gaps
    names = [MARKER, *(f"comparison.{kind}" for kind in ("csv", "svg"))]
    assert sorted(p.name for p in (cart / "compared").iterdir()) == names
    assert {p.name for p in cart.iterdir()} == {"cart.yaml", "logs", "outputs", "compared"}


def test_a_sweep_has_a_folder_of_its_own(cart: Path) -> None:
    result = python(*SWEEP, "horizon=0.1,0.2", "out=data", cwd=cart)
    assert result.returncode == 2
    assert result.stderr.splitlines() == [
        "error: out: every run of a sweep has a folder of its own, in hydra.sweep.dir=<folder>"
    ]
    assert not (cart / "outputs").exists()


@pytest.mark.parametrize(
    ("launcher", "name"),
    [("joblib", "JoblibLauncher"), ("slurm", "SlurmLauncher"), ("submitit_local", "LocalLauncher")],
)
def test_launchers_are_installed_and_compose(launcher: str, name: str, cart: Path) -> None:
    words = [f"hydra/launcher={launcher}", "--cfg", "hydra", "-p", "hydra.launcher"]
    result = python("-m", "pipeline", "simulate", *words, cwd=cart)
    assert result.returncode == 0, result.stderr
    assert yaml.safe_load(result.stdout)["_target_"].endswith(f".{name}")


def test_an_unknown_launcher_is_refused(cart: Path) -> None:
    result = python(*SWEEP, "horizon=0.1", EXP_LAUNCHER="cluster", cwd=cart)
    assert result.returncode == 2
    (line,) = result.stderr.splitlines()
    assert "hydra/launcher=cluster" in line and "joblib" in line and "slurm" in line


def test_a_launcher_whose_package_is_missing_is_one_line(cart: Path) -> None:
    result = python(*SWEEP, "horizon=0.1", EXP_LAUNCHER="ray", cwd=cart)
    assert result.returncode == 2
    (line,) = result.stderr.splitlines()
    assert "hydra/launcher=ray: there is no such choice" in line and "pip install hydra-ray-launcher." in line


def test_a_launcher_whose_cluster_is_missing_is_one_line(cart: Path) -> None:
    result = python(*SWEEP, "horizon=0.1", EXP_LAUNCHER="slurm", PATH=str(cart), cwd=cart)
    assert result.returncode == 2
    assert result.stderr.splitlines()[-1] == (
        'error: sweep: Could not detect "srun", are you indeed on a slurm cluster?: '
        "check its launcher (EXP_LAUNCHER) and the keys hydra.<...>"
    )
    assert "Traceback" not in result.stderr


@pytest.mark.long
def test_optuna_minimises_what_tune_returns(tmp_path: Path, small_campaign: Campaign) -> None:
    small_campaign.write(tmp_path / "features")
    words = ["hydra/sweeper=hidden_units", "hydra.sweeper.n_trials=3", "hydra.sweep.dir=search"]
    small = ["model.features=features", "model.fit.steps=3", "profile.repeats=2"]
    result = python("-m", "pipeline", "tune", "-m", *words, *small, OMP_NUM_THREADS="1", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    found = yaml.safe_load((tmp_path / "search" / "optimization_results.yaml").read_text())
    tried = pd.concat([pd.read_parquet(tmp_path / "search" / k / "tuning.parquet") for k in "012"])
    medians = tried.groupby("hidden")["omega_mse"].median()
    assert found["best_value"] == medians.min() and found["best_params"] == {"hidden": medians.idxmin()}
    assert medians.index.min() >= 4 and medians.index.max() <= 256


def test_compare_writes_a_table_and_a_figure(
    sweep: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    compare(sweep, None, None, tmp_path / "out")
    table = pd.read_csv(tmp_path / "out" / "comparison.csv")
    assert list(table) == ["run", "model.hidden", "seed", "fit.loss", "fit.seconds", "failure"]
    assert table["fit.seconds"].tolist()[:5] == [4.0, 5.0, 8.0, 9.0, 16.0]
    said = capsys.readouterr()
    assert "6 runs, swept: model.hidden, seed" in said.out
    assert said.err == "without metrics: run 5 model.hidden=16 seed=1: features: no such file\n"
    first = (tmp_path / "out" / "comparison.svg").read_bytes()
    compare(sweep, "fit.seconds", "seed", tmp_path / "out")
    assert "largest fit.seconds: 16, run 4 model.hidden=16 seed=0" in capsys.readouterr().out
    assert b"</svg>" in first and first != (tmp_path / "out" / "comparison.svg").read_bytes()


@pytest.mark.parametrize(
    ("metric", "over", "words"),
    [
        ("loss", None, "metric: unknown 'loss', must be one of fit.loss, fit.seconds"),
        (None, "hidden", "over: unknown 'hidden', must be one of run, model.hidden, seed"),
    ],
)
def test_unknown_names_are_refused(
    metric: str | None, over: str | None, words: str, sweep: Path, tmp_path: Path
) -> None:
    with pytest.raises(BadInput) as caught:
        compare(sweep, metric, over, tmp_path / "out")
    assert str(caught.value) == words
    assert not (tmp_path / "out").exists()


def test_a_sweep_in_which_all_failed(sweep: Path, tmp_path: Path) -> None:
    for path in sweep.glob("*/fit.json"):
        path.unlink()
    with pytest.raises(BadInput, match="no run has metrics; run 0: nothing written"):
        compare(sweep, None, None, tmp_path / "out")


@pytest.mark.long
def test_a_bare_word_is_the_folder_whatever_its_name(sweep: Path, tmp_path: Path) -> None:
    sweep.rename(tmp_path / "it's [a, b]")
    result = python("-m", "pipeline", "compare", "it's [a, b]", "out=out", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "out" / "comparison.svg").exists()


@pytest.mark.parametrize(
    ("required", "words", "expected"),
    [
        ("runs", "a/b metric=x", ["runs='a/b'", "metric=x"]),
        ("runs", "metric=x a/b", ["metric=x", "runs='a/b'"]),
        ("runs", "--cfg job a/b", ["runs='a/b'", "--cfg", "job"]),
        ("runs", "-m a/b", ["runs='a/b'", "-m"]),
        ("runs", "-p hydra.launcher --resolve a", ["runs='a'", "-p", "hydra.launcher", "--resolve"]),
        ("runs", "a b", ["runs='a'", "b"]),
        ("runs", "runs=a", ["runs=a"]),
        ("system logs", "belt.yaml belt", ["system='belt.yaml'", "logs='belt'"]),
        ("system logs", "belt.yaml -q seed=1 belt", ["system='belt.yaml'", "seed=1", "logs='belt'", "-q"]),
        ("system logs", "belt system=belt.yaml", ["logs='belt'", "system=belt.yaml"]),
        ("system logs", "logs=belt belt.yaml more", ["logs=belt", "system='belt.yaml'", "more"]),
        ("system logs", "seed=1 -m model=a", ["seed=1", "model=a", "-m"]),
    ],
)
def test_options_stand_anywhere_and_bare_words_for_required_keys(
    required: str, words: str, expected: list[str]
) -> None:
    assert _options_last(required.split(), words.split()) == expected


@pytest.mark.long
def test_a_fault_in_one_run_is_told_and_the_other_runs(tmp_path: Path) -> None:
    words = ["acquire", "-m", "source=pendulum", "+source.period=0.0,0.002", "hydra.sweep.dir=sweep"]
    result = python("-m", "pipeline", *words, cwd=tmp_path)
    assert result.returncode == 1
    assert "Traceback" in result.stderr
    assert "ZeroDivisionError" in (tmp_path / "sweep" / "0" / FAILURE).read_text()
    assert (tmp_path / "sweep" / "1" / "experiments.csv").exists()


@pytest.mark.parametrize("hidden", ["0", "many", "[]", "[8,1.5]"])
def test_a_number_of_hidden_units_is_a_whole_number(hidden: str, tmp_path: Path) -> None:
    given = OmegaConf.create(f"hidden: {hidden}")["hidden"]
    arguments = dict.fromkeys(inspect.signature(tune).parameters)
    with pytest.raises(BadInput, match="hidden: must be whole numbers from 1 up"):
        tune(**{**arguments, "hidden": given})
