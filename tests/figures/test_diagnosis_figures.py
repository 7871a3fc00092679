"""Figures of a diagnosis on the tables of a pendulum, and on tables that lack something."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.diagnosis.diagnoses import BENCH, friction
from tests.figures.checks import Draw, check_caption, check_file, check_rendered, texts
from unmodelled.diagnosis.answer.figure_tables import write_tables
from unmodelled.diagnosis.data.result import Verdict
from unmodelled.diagnosis.where.where import where
from unmodelled.report.figures import experiments, residual, steps
from unmodelled.report.figures.files import FIGURES, write_figures
from unmodelled.report.figures.tables import printed

pytestmark = pytest.mark.long

SMALL = replace(BENCH, runs=4, samples=300)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Verdict], Path]:
    """By verdict: tables of a diagnosis with it."""
    found: dict[Verdict, Path] = {}

    def made(verdict: Verdict) -> Path:
        if verdict not in found:
            found[verdict] = tmp_path_factory.mktemp(verdict)
            bench = replace(SMALL, friction=0.0) if verdict == "no_gap" else SMALL
            diagnosis = friction(found[verdict] / "case", bench, verdict)
            write_tables(diagnosis, where(diagnosis), found[verdict])
        return found[verdict]

    return made


def changed(source: Path, folder: Path, name: str, change: Callable[[pd.DataFrame], pd.DataFrame]) -> Path:
    """The tables with one of them changed."""
    shutil.copytree(source / "tables", folder / "tables")
    path = folder / "tables" / f"{name}.parquet"
    change(pd.read_parquet(path)).to_parquet(path, index=False)
    return folder


def with_correlations(source: Path, folder: Path) -> Path:
    """The tables with one more: correlations of two numbers."""
    data = changed(source, folder, "steps", lambda table: table)
    pairs = [(a, b, 1.0 if a == b else -0.9) for a in ("F_c", "b") for b in ("F_c", "b")]
    rows = pd.DataFrame(pairs, columns=["row", "column", "correlation"])
    rows.to_parquet(data / "tables" / "correlations.parquet", index=False)
    return data


@pytest.mark.parametrize("draw", FIGURES.values(), ids=lambda draw: draw.__name__)
def test_every_figure(draw: Draw, folder: Callable[[Verdict], Path], tmp_path: Path) -> None:
    check_caption(draw)
    check_file(draw, with_correlations(folder("effect"), tmp_path / "effect"), tmp_path)
    for verdict in ("unknown", "no_gap"):
        check_rendered(draw, with_correlations(folder(verdict), tmp_path / verdict))


def test_files_and_captions(folder: Callable[[Verdict], Path], tmp_path: Path) -> None:
    left_out: dict[Verdict, set[str]] = {
        "effect": set(),
        "unknown": {"left_over"},
        "no_gap": {"lacking", "left_over"},
    }
    for verdict, absent in left_out.items():
        data, expected = tmp_path / verdict, [name for name in FIGURES if name not in absent]
        write_figures(with_correlations(folder(verdict), data))
        index = json.loads((data / "figures" / "figures.json").read_text())
        assert [entry["id"] for entry in index] == expected
        assert [entry["number"] for entry in index] == [str(k + 1) for k in range(len(expected))]
        names = {path.name for path in (data / "figures").iterdir()}
        assert names == {"figures.json", *(f"{name}.svg" for name in expected)}
        assert all(entry["caption"].endswith(".") and entry["note"] for entry in index)


def test_the_law_runs_through_what_is_lacking(folder: Callable[[Verdict], Path]) -> None:
    figure = residual.lacking(folder("effect"))
    (side,) = (axes for axes in figure.axes if axes.get_xlabel() == "omega (rad/s)")
    law = next(line for line in side.lines if line.get_linewidth() == 2.0)
    x, y = (np.asarray(values, np.float64) for values in (law.get_xdata(), law.get_ydata()))
    assert np.all(np.diff(x) > 0.0)
    np.testing.assert_allclose(np.abs(y[np.abs(x) > 0.5]), 0.06, atol=0.006)
    windows = pd.read_parquet(folder("effect") / "tables" / "windows.parquet")
    off = windows[windows["stage"] == "lacking"].eval("(value - law)/error")
    assert np.sqrt(np.mean(off**2)) < 2.0
    assert "torque lacking (N\u2009m)" in texts(figure) and "theta (rad)" in texts(figure)


def test_steps_fall_to_the_noise(folder: Callable[[Verdict], Path]) -> None:
    figure = steps.gap_steps(folder("effect"))
    labels = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert labels == ["as given", "re-identified", "+ Coulomb friction at joint"]
    widths = [patch.get_width() for patch in figure.axes[0].patches]
    assert widths == sorted(widths, reverse=True)


def test_the_named_model_is_marked(folder: Callable[[Verdict], Path]) -> None:
    for verdict, expected in (("effect", "Coulomb friction at joint"), ("no_gap", "no effect")):
        table = pd.read_parquet(folder(verdict) / "tables" / "candidates.parquet")
        assert table.loc[table["named"], "label"].tolist() == [expected]


def test_what_is_not_there_is_not_drawn(folder: Callable[[Verdict], Path], tmp_path: Path) -> None:
    source = folder("effect")
    cases: dict[str, tuple[Callable[[pd.DataFrame], pd.DataFrame], tuple[str, ...]]] = {
        "candidates": (lambda table: table.iloc[:0], ("candidates",)),
        "windows": (lambda table: table.assign(level=np.nan, acceleration=np.nan), ("lacking", "left_over")),
        "laws": (lambda table: table.iloc[:0], ("lacking",)),
        "trajectory": (lambda table: table.assign(known=np.nan), ("before_and_after",)),
    }
    for name, (change, figures) in cases.items():
        data = changed(source, tmp_path / name, name, change)
        for figure in figures:
            check_rendered(FIGURES[figure], data)
    empty = changed(source, tmp_path / "empty", "windows", lambda table: table.iloc[:0])
    assert "nothing is known of joint" in texts(residual.lacking(empty))


def test_the_worst_of_many_experiments(folder: Callable[[Verdict], Path], tmp_path: Path) -> None:
    def many(table: pd.DataFrame) -> pd.DataFrame:
        whole = pd.concat([table] * 20, ignore_index=True)
        size = np.linspace(1.0, 2.0, len(whole))
        return whole.assign(id=[f"run{k}" for k in range(len(whole))], reidentified=size)

    data = changed(folder("effect"), tmp_path / "many", "experiments", many)
    figure = experiments.gaps_of_experiments(data)
    labels = [label.get_text().removeprefix("★ ") for label in figure.axes[0].get_yticklabels()]
    assert labels[0] == "run79" and len(labels) == 40
    assert figure.axes[0].get_title() == "40 of 80 experiments"


def test_units_are_printed() -> None:
    assert printed("kg m^2/s") == "kg\u2009m²/s"
    assert printed("m^-1") == "m⁻¹"
    assert printed("") == printed("1") == "–"
