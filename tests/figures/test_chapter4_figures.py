"""Every figure of chapter 4: units, caption and file, and what is left where tables lack something."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from pipeline.figures.slider_crank import inputs, sensitivity
from tests.figures.checks import Draw, check_caption, check_file, check_rendered, figures_of, name_of
from tests.figures.slider_crank_tables import Tables, make_tables, write

pytestmark = pytest.mark.long

FIGURES = figures_of("slider_crank")


@pytest.fixture(scope="module")
def content() -> Tables:
    return make_tables()


@pytest.fixture(scope="module")
def folder(content: Tables, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("data"), content)


def labels(figure: Figure, axis: str) -> list[str]:
    """What stands along one axis of every visible panel, with the labels that panels share."""
    texts = [getattr(figure, f"get_sup{axis}label")()]
    texts += [getattr(axes, f"get_{axis}label")() for axes in figure.axes if axes.axison]
    return [text for text in texts if text]


@pytest.mark.parametrize("draw", FIGURES, ids=name_of)
def test_axes_carry_units_and_the_caption_is_a_sentence(draw: Draw, folder: Path) -> None:
    figure = draw(folder)
    assert any("(" in text for text in labels(figure, "x") + [axes.get_title() for axes in figure.axes])
    unlabelled = {sensitivity.correlations, inputs.network_inputs}  # symbols, and sets of inputs with a title
    for axis in "x" if draw in unlabelled else "xy":
        assert all("(" in text for text in labels(figure, axis)), labels(figure, axis)
    check_caption(draw)


@pytest.mark.parametrize("draw", FIGURES, ids=name_of)
def test_the_file_is_small_and_always_the_same(draw: Draw, folder: Path, tmp_path: Path) -> None:
    check_file(draw, folder, tmp_path)


def reduced(content: Tables) -> Tables:
    """Three models, two horizons, three folds, one campaign and one set; no T9 among the examples."""
    ids = ["T1a", "T4b", "T10a"]
    few = {name: table[table["id"].isin(ids)] for name, table in content.items() if "id" in table}
    for name in ("errors", "examples"):
        kept = few[name]["model"].isin(["nnap", "nnap_t", "physics"]) & few[name]["horizon"].isin([1, 30])
        few[name] = few[name][kept]
    few["errors"] = few["errors"][few["errors"]["repeat"] == 0]
    few["errors"].loc[few["errors"]["model"] == "nnap_t", ["rmse", "diverged"]] = np.inf, True
    for name in ("experiments", "signals", "force"):
        few[name] = few[name][few[name]["campaign"] == "spring"]
    few["force"] = few["force"].assign(F_true=np.nan)
    few["timing"] = content["timing"][content["timing"]["horizon"] == 30]
    few["history"] = content["history"][content["history"]["set"] == "m3_J1_Bm"]
    few["surface"] = content["surface"][content["surface"]["stage"] == "converged"]
    few["advice"] = content["advice"].head(1)
    return {**content, **few}


def nothing_trained(content: Tables) -> Tables:
    """Only plain models of two kinds, no history, no evaluated network."""
    plain = {name: content[name][~content[name]["extra"]] for name in ("errors", "examples")}
    two = {name: table[table["model"].isin(["nnap_d", "black_box"])] for name, table in plain.items()}
    return {**content, **two, "history": content["history"].head(0), "force": content["force"].head(0)}


def one_other_model(content: Tables) -> Tables:
    """A single model that none of the figures knows."""
    known = {name: content[name][content[name]["model"] == "nnap_split"] for name in ("errors", "examples")}
    return {**content, **{name: table.assign(model="another") for name, table in known.items()}}


@pytest.mark.parametrize("less", [reduced, nothing_trained, one_other_model], ids=lambda f: f.__name__)
def test_missing_cells_leave_a_figure(
    less: Callable[[Tables], Tables], content: Tables, tmp_path: Path
) -> None:
    folder = write(tmp_path, less(content))
    for draw in FIGURES:
        check_rendered(draw, folder)
