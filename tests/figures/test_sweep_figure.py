"""The figure of a sweep: what is on its axes and which runs a line joins."""

import io
from itertools import product

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from tests.figures.checks import rendered
from unmodelled.cli.sweep.figure import comparison, horizontal_key
from unmodelled.report.figures.style import save, verbatim


@pytest.fixture
def table() -> pd.DataFrame:
    """Two models, three numbers of hidden units, two seeds; one run failed."""
    rows = product(("f_h1", "f_h2"), (4, 32, 256), (0, 1))
    table = pd.DataFrame(rows, columns=["model", "hidden", "seed"]).assign(run=[str(i) for i in range(12)])
    table["error"] = 10.0 * (table["model"] == "f_h2") + table["hidden"] + table["seed"]
    table.loc[3, "error"] = np.nan
    return table


def lines(figure: Figure) -> dict[str, tuple[list[float], list[float]]]:
    """Of every line, or row of bars, of medians its points."""
    drawn = [line for line in figure.axes[0].lines if line.get_marker() != "o"]
    return {str(d.get_label()): (list(d.get_xdata()), list(d.get_ydata())) for d in drawn}  # type: ignore[arg-type]


def test_numbers_before_names_and_the_seed_last(table: pd.DataFrame) -> None:
    assert horizontal_key(table, ["model", "seed", "hidden"]) == "hidden"
    assert horizontal_key(table, ["seed", "model"]) == "model"
    assert horizontal_key(table, ["seed"]) == "seed"
    assert horizontal_key(table, []) == "run"


def test_a_line_joins_the_medians_over_seeds_of_a_model(table: pd.DataFrame) -> None:
    figure = rendered(comparison(table, ["model", "hidden", "seed"], "error", "hidden"))
    assert lines(figure) == {
        "model=f_h1": ([4, 32, 256], [4.5, 32.0, 256.5]),
        "model=f_h2": ([4, 32, 256], [14.5, 42.5, 266.5]),
    }
    (axes,) = figure.axes
    points = [line for line in axes.lines if line.get_marker() == "o"]
    assert sum(len(np.atleast_1d(p.get_xdata())) for p in points) == 11
    assert axes.get_xscale() == "log" and axes.get_yscale() == "log"
    assert [t.get_text() for t in axes.get_xticklabels()] == ["4", "32", "256"]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("hidden", "error")


def test_names_and_what_was_left_at_its_default_stand_side_by_side(table: pd.DataFrame) -> None:
    table["model"] = table["model"].astype("str").where(table["model"] == "f_h1")
    figure = rendered(comparison(table[table["hidden"] == 4], ["model", "seed"], "error", "model"))
    assert list(lines(figure).values()) == [([0, 1], [4.5, 14.5])]
    assert [t.get_text() for t in figure.axes[0].get_xticklabels()] == ["f_h1", "default"]
    assert figure.axes[0].get_xscale() == "linear"


def test_many_groups_and_runs_that_were_not_swept(table: pd.DataFrame) -> None:
    many = pd.concat([table.assign(rate=rate) for rate in (0.1, 0.2, 0.3, 0.4)], ignore_index=True)
    figure = rendered(comparison(many, ["model", "hidden", "rate"], "error", "hidden"))
    assert len(lines(figure)) == 8
    assert "model=f_h2, rate=0.3" in lines(figure)
    alone = rendered(comparison(table.iloc[:1], [], "error", "run"))
    assert list(lines(alone).values()) == [([0], [4.0])]


def test_a_metric_that_diverged_or_is_negative_is_drawn_on_a_linear_axis(table: pd.DataFrame) -> None:
    table.loc[0, "error"] = np.inf
    table.loc[1, "error"] = -5.0
    figure = rendered(comparison(table, ["model", "hidden", "seed"], "error", "hidden"))
    assert figure.axes[0].get_yscale() == "linear"


def test_equal_tables_give_equal_files(table: pd.DataFrame) -> None:
    files = []
    for _ in range(2):
        save(comparison(table, ["model", "hidden"], "error", "hidden"), image := io.BytesIO())
        files.append(image.getvalue())
    assert files[0] == files[1]


def test_what_a_user_wrote_is_no_mathematics(table: pd.DataFrame) -> None:
    named = table.replace({"model": {"f_h1": r"a$\frac{", "f_h2": "$b$"}})
    with verbatim():
        figure = rendered(comparison(named, ["model", "hidden", "seed"], "error", "hidden"))
        assert set(lines(figure)) == {r"model=a$\frac{", "model=$b$"}
        save(figure, image := io.BytesIO())
    assert b"mathdefault" not in image.getvalue()
