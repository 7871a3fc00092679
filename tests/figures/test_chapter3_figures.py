"""Every figure of chapter 3: units, caption and file, and what is left where tables lack something."""

from collections.abc import Callable
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from pipeline.figures.clutch import identification
from pipeline.stages.draw import draw as draw_stage
from tests.figures.checks import Draw, check_caption, check_file, check_rendered, figures_of, name_of
from tests.figures.clutch_tables import Content, make_tables, users_own, write
from unmodelled.base.errors import BadInput

pytestmark = pytest.mark.long

FIGURES = figures_of("clutch")


@pytest.fixture(scope="module")
def content() -> Content:
    return make_tables()


@pytest.fixture(scope="module")
def folder(content: Content, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("data"), content)


def labels(figure: Figure, axis: str) -> list[str]:
    """What stands along one axis of every visible panel."""
    texts = [getattr(axes, f"get_{axis}label")() for axes in figure.axes if axes.axison]
    return [text for text in texts if text]


def texts(figure: Figure) -> str:
    """Titles of the figure and of its parts."""
    parts = [figure, *figure.subfigs]
    return " ".join([*(part.get_suptitle() for part in parts), *(axes.get_title() for axes in figure.axes)])


@pytest.mark.parametrize("draw", FIGURES, ids=name_of)
def test_axes_carry_units_and_the_caption_is_a_sentence(draw: Draw, folder: Path) -> None:
    figure = draw(folder)
    found = labels(figure, "x") + labels(figure, "y")
    assert found and all("(" in text for text in found), found
    check_caption(draw)


@pytest.mark.parametrize("draw", FIGURES, ids=name_of)
def test_the_file_is_small_and_always_the_same(draw: Draw, folder: Path, tmp_path: Path) -> None:
    check_file(draw, folder, tmp_path)


def one_method(content: Content) -> Content:
    """Nothing of maximum entropy, no evenly spread samples, a pair and a profile only."""
    less = dict(content)
    for name, column in (
        ("densities", "alpha_of"),
        ("monte_carlo", "alpha_of"),
        ("sampling", "alpha_of"),
        ("accuracy", "alpha_of"),
        ("accuracy", "method"),
        ("estimates", "method"),
        ("identified", "method"),
        ("example_fits", "density"),
    ):
        less[name] = less[name][less[name][column] != "maximum_entropy"]
    less["sampling"] = less["sampling"][less["sampling"]["rule"] == "random"]
    less["pairs"] = less["pairs"][less["pairs"]["first"] == "sigma_1"]
    less["profiles"] = less["profiles"][less["profiles"]["name"] == "sigma_2"]
    return less


def nothing_found(content: Content) -> Content:
    """No pairs, no data sets drawn again; the simulated shafts never meet; one speed and one brake torque."""
    experiments = content["experiments"]
    kept = experiments[(experiments["rpm"] == 1200.0) & (experiments["T_b0"] == 10.0)]
    less = {
        name: table[table["id"].isin(kept["id"])] if "id" in table else table
        for name, table in content.items()
    }
    less["pairs"], less["accuracy"] = content["pairs"].head(0), less["accuracy"].head(0)
    less["replicates"] = content["replicates"].head(0)
    less["engagement"] = content["engagement"].assign(synchronous=False)
    return {**less, "about": {}}


@pytest.mark.parametrize("less", [users_own, one_method, nothing_found], ids=lambda f: f.__name__)
def test_missing_cells_leave_a_figure(
    less: Callable[[Content], Content], content: Content, tmp_path: Path
) -> None:
    folder = write(tmp_path, less(content))
    for draw in FIGURES:
        figure = check_rendered(draw, folder)
        assert "nan" not in texts(figure), draw.__name__


def test_a_missing_table_is_named(content: Content, tmp_path: Path) -> None:
    folder = write(tmp_path, content)
    (folder / "tables" / "clutch" / "pairs.parquet").unlink()
    figures = {"fig_3_14_2": identification.profile_pairs}
    with pytest.raises(BadInput, match=r"fig_3_14_2: .*pairs\.parquet: no such file"):
        draw_stage(figures, None, folder, tmp_path / "raw", {3: "clutch"}, 1, tmp_path / "out")
