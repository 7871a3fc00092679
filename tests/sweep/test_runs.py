"""The runs of a sweep as a table, on sweep folders made by hand."""

import math
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
import yaml

from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing_folder, write_json
from unmodelled.cli.sweep.metrics import metrics_of
from unmodelled.cli.sweep.runs import (
    FAILURE,
    OVERRIDES,
    metric_names,
    read_run,
    run_folders,
    swept_keys,
    table_of,
)


def make_run(folder: Path, *overrides: str, loss: float | None = None) -> Path:
    """A run as Hydra and train leave it."""
    (folder / OVERRIDES).parent.mkdir(parents=True)
    (folder / OVERRIDES).write_text(yaml.safe_dump(list(overrides)))
    if loss is not None:
        write_json(folder / "fit.json", {"loss": loss, "folds": ["a", "b"], "seconds": 2})
    return folder


def test_runs_are_found_at_any_depth_and_ordered_by_number(tmp_path: Path) -> None:
    for name in ("b/10", "b/2", "b/9", "a/0"):
        make_run(tmp_path / name)
    (tmp_path / "b" / ".submitit" / "7").mkdir(parents=True)
    names = [path.relative_to(tmp_path).as_posix() for path in run_folders(tmp_path)]
    assert names == ["a/0", "b/2", "b/9", "b/10"]
    assert run_folders(tmp_path / "a" / "0") == [tmp_path / "a" / "0"]


def test_keys_get_their_types(tmp_path: Path) -> None:
    given = ["seed=3", "+rate=1e-3", "model=f_h1", "widths=[4,8]", "flag=true", "name=null", "'path=a b'"]
    keys = read_run(make_run(tmp_path / "0", *given[:-1], "path='a=b, c'"), tmp_path).keys
    expected = {"seed": 3, "rate": 1e-3, "model": "f_h1", "widths": "[4,8]", "flag": True, "name": None}
    assert keys == {**expected, "path": "a=b, c"}


def test_a_fit_that_was_read_lends_its_keys(tmp_path: Path) -> None:
    fit = make_run(tmp_path / "fits" / "0", "seed=4", "model=f_h1")
    run = make_run(tmp_path / "judged" / "0", f"fits={fit}", "model=f_h2")
    assert read_run(run, tmp_path).keys == {"seed": 4, "model": "f_h2"}
    other = make_run(tmp_path / "judged" / "1", "fits=data/elsewhere")
    assert read_run(other, tmp_path).keys == {"fits": "data/elsewhere"}


def test_the_table_has_what_differs_and_what_is_missing(tmp_path: Path) -> None:
    make_run(tmp_path / "0", "split=a", "hidden=4", "model=f_h1", loss=0.5)
    make_run(tmp_path / "1", "split=a", "hidden=big", loss=0.25)
    failed = make_run(tmp_path / "2", "split=a", "hidden=16", "seed=1")
    (failed / FAILURE).write_text("features: no such file\n")
    make_run(tmp_path / "3", "split=a")
    runs = [read_run(folder, tmp_path) for folder in run_folders(tmp_path)]
    assert swept_keys(runs) == ["hidden", "model", "seed"]
    assert metric_names(runs) == ["fit.loss", "fit.seconds"]
    table = table_of(runs)
    assert list(table) == ["run", "split", "hidden", "model", "seed", "fit.loss", "fit.seconds", "failure"]
    assert table["hidden"].dropna().tolist() == ["4", "big", "16"]
    assert table["seed"].dtype == "Int64" and table["fit.loss"].tolist()[:2] == [0.5, 0.25]
    assert table["failure"].tolist()[2:] == ["features: no such file", "nothing written"]
    assert table["failure"].isna().tolist() == [True, True, False, False]
    # columns have one type each
    table.to_parquet(tmp_path / "table.parquet")
    pd.testing.assert_frame_equal(pd.read_parquet(tmp_path / "table.parquet"), table)


def test_a_metric_that_is_nowhere_finite_is_none(tmp_path: Path) -> None:
    run = make_run(tmp_path / "0", loss=1.0)
    write_history(run, [math.inf, math.inf])
    assert metric_names([read_run(run, tmp_path)]) == ["fit.loss", "fit.seconds"]


def write_history(folder: Path, last: list[float]) -> None:
    folds = {"fold": ["a", "b"] * 2, "repeat": 0, "epoch": [2, 2, 1, 1], "loss": [*last, 9.0, 9.0]}
    pd.DataFrame(folds).to_parquet(folder / "history.parquet")


def test_metrics_of_every_table(tmp_path: Path) -> None:
    """Medians and shares by hand."""
    state = {
        "state": ["x", "v"] * 3,
        "rmse": [1.0, 10.0, 3.0, 30.0, 2.0, 20.0],
        "diverged": [False] * 5 + [True],
    }
    pd.DataFrame(state).to_parquet(tmp_path / "errors.parquet")
    hidden = {"hidden": [8, 8, 8, 32, 32, 32], "repeat": [0, 1, 2] * 2, "omega_mse": [5, 6, 7, 9, 2, 1.0]}
    pd.DataFrame(hidden).to_parquet(tmp_path / "tuning.parquet")
    jumps = {"label": ["jump", "contact", "stall"], "jumps": [True, True, False], "mse": [1.0, 2.0, 4.0]}
    pd.DataFrame({**jumps, "model": "tau4"}).to_parquet(tmp_path / "repeats.parquet")
    write_history(tmp_path, [0.5, 0.7])
    pd.DataFrame({"t": [0.0], "x_measured": [1.0]}).to_parquet(tmp_path / "examples.parquet")
    write_json(tmp_path / "simulation.json", {"gap": {"known": 0.3}, "experiments": [{"known": 1.0}]})
    assert metrics_of(tmp_path) == pytest.approx(
        {
            "errors.x.rmse": 2.0,
            "errors.x.diverged": 0.0,
            "errors.v.rmse": 20.0,
            "errors.v.diverged": 1 / 3,
            "tuning.omega_mse": 2.0,
            "repeats.mse": 2.0,
            "repeats.accuracy": 2 / 3,
            "history.loss": 0.6,
            "simulation.gap.known": 0.3,
        }
    )


def test_models_of_one_table_are_told_apart_and_one_alone_has_no_prefix(tmp_path: Path) -> None:
    rows = {"fold": "a", "exp": [1, 2], "omega_mse": [1.0, 3.0], "omega_mse_time": [2.0, 4.0]}
    pd.DataFrame(rows).to_parquet(tmp_path / "errors.parquet")
    jumps = pd.DataFrame({"label": "jump", "jumps": True, "mse": [1.0, 2.0], "model": ["tau1", "tau2"]})
    jumps.to_parquet(tmp_path / "repeats.parquet")
    found = metrics_of(tmp_path)
    assert found["errors.omega_mse"] == 2.0 and found["repeats.tau2.mse"] == 2.0
    assert "repeats.mse" not in found


def test_no_folder_and_no_runs(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="absent: no such folder"):
        run_folders(tmp_path / "absent")
    with pytest.raises(BadInput, match="no runs of a sweep in it"):
        run_folders(tmp_path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("- seed=1\n- [", "line 2"),
        ("seed: 1", "must be a list of key=value"),
        ("- 1", "must be a list of key=value"),
        ("", "must be a list of key=value"),
        ("- seed=1\n- seed\n", "item 2: 'seed' is not key=value"),
        ("- !!python/object/apply:os.system ['touch owned']", "cannot be read"),
        ("- seed=\x00", "cannot be read"),
    ],
)
def test_unreadable_overrides_are_named(
    text: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run = make_run(tmp_path / "0", loss=1.0)
    (run / OVERRIDES).write_text(text)
    with pytest.raises(BadInput, match=words) as caught:
        read_run(run, tmp_path)
    assert str(caught.value).startswith(str(run / OVERRIDES)) and "\n" not in str(caught.value)
    assert not (tmp_path / "owned").exists()


def _text(path: Path) -> None:
    path.write_text("no table")


def _other_columns(path: Path) -> None:
    pd.DataFrame({"epoch": [1], "fold": ["a"], "repeat": [0]}).to_parquet(path)


@pytest.mark.parametrize(("write", "words"), [(_text, "not a Parquet"), (_other_columns, "no column .*loss")])
def test_unreadable_results_are_named(write: Callable[[Path], None], words: str, tmp_path: Path) -> None:
    write(tmp_path / "history.parquet")
    with pytest.raises(BadInput, match=words) as caught:
        metrics_of(tmp_path)
    assert str(caught.value).startswith(str(tmp_path / "history.parquet"))


def test_what_hydra_wrote_about_a_run_outlives_the_replacement_of_its_folder(tmp_path: Path) -> None:
    run = make_run(tmp_path / "0", "seed=1")
    with replacing_folder(run) as folder:
        write_json(folder / "fit.json", {"loss": 1.0})
    with replacing_folder(run) as folder:
        write_json(folder / "simulation.json", {"gap": {"known": 2.0}})
    found = read_run(run, tmp_path)
    assert found.keys == {"seed": 1} and found.metrics == {"simulation.gap.known": 2.0}
