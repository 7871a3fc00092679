"""What single figures of chapter 4 show is what the tables hold."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.figures.slider_crank import closed_form, horizon, parameters, tables
from tests.figures.slider_crank_tables import Tables, make_tables, write


@pytest.fixture(scope="module")
def content() -> Tables:
    return make_tables()


@pytest.fixture(scope="module")
def folder(content: Tables, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("data"), content)


def test_nine_tenths_of_the_most_accurate_runs_and_the_mean_of_those_that_end() -> None:
    rows = pd.DataFrame({"rmse": [*range(1, 20), np.nan], "diverged": [False] * 18 + [True] * 2})
    found = tables.accuracy(rows)
    assert (found.best, found.limit, found.mean, found.diverged) == (1.0, 18.0, 9.5, 2)
    assert tables.accuracy(rows.tail(3)).limit == np.inf
    assert np.isnan(tables.accuracy(rows.tail(2)).mean)


@pytest.mark.long
def test_the_gain_is_that_of_the_means(content: Tables, folder: Path) -> None:
    rows = content["errors"][content["errors"]["extra"]]
    means = rows.groupby("horizon")["rmse"].mean()
    best = means.drop(1).idxmin()
    change = f"−{100 * (1 - means[best] / means[1]):.0f} % at N = {best}"
    assert change in horizon.horizon_length(folder).axes[0].get_title()


def test_the_fit_finds_the_exponent(content: Tables, tmp_path: Path) -> None:
    timing = content["timing"].assign(seconds_per_epoch=0.1 * content["timing"]["horizon"] ** 0.75)
    figure = horizon.horizon_length(write(tmp_path, {**content, "timing": timing}))
    legend = figure.axes[1].get_legend()
    assert legend is not None
    assert any("N^{0.75}" in text.get_text() for text in legend.get_texts())


def test_the_median_of_the_runs_is_drawn(content: Tables, folder: Path) -> None:
    history = content["history"]
    mine = history[(history["set"] == "m3_J1_Bm") & (history["parameter"] == "m3")]
    expected = mine[mine["epoch"] == mine["epoch"].max()]["value"].median()
    ends = [np.asarray(line.get_ydata(), float)[-1] for line in panel(parameters.convergence(folder)).lines]
    assert expected in ends


def panel(figure: Figure) -> Axes:
    return next(axes for axes in figure.axes if "m_3" in axes.get_ylabel())


def test_the_formula_stands_above_its_figure(content: Tables, folder: Path) -> None:
    assert content["closed_form"]["formula"].iloc[0] in closed_form.closed_form(folder).get_suptitle()


def test_the_example_is_the_dissertations_where_it_is_on_file() -> None:
    assert tables.example(["T10a", "T9a", "T9b"]) == "T9a"
    assert tables.example(["T10b", "T2a"]) == "T2a"
