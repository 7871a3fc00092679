"""Every figure of follower jumps: units, caption and file, and what is left where tables lack something."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from pipeline.figures.jumps import contributions
from pipeline.stages.draw import draw as draw_stage
from tests.figures.checks import Draw, check_caption, check_file, check_rendered, figures_of, name_of
from tests.figures.jump_tables import Content, make_tables, networks_only, write
from unmodelled.base.errors import BadInput

pytestmark = pytest.mark.long

FIGURES = figures_of("jumps")


@pytest.fixture(scope="module")
def content() -> Content:
    return make_tables()


@pytest.fixture(scope="module")
def folder(content: Content, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("data"), content)


def texts(figure: Figure) -> str:
    parts = [figure.get_suptitle()]
    for axes in figure.axes:
        parts += [axes.get_title(), axes.get_title("left"), *(text.get_text() for text in axes.texts)]
    return " ".join(parts)


@pytest.mark.parametrize("draw", FIGURES, ids=name_of)
def test_axes_with_numbers_carry_units_and_the_caption_is_a_sentence(draw: Draw, folder: Path) -> None:
    figure = draw(folder)
    figure.draw_without_rendering()
    for axes in figure.axes:
        for axis, shared in ((axes.xaxis, figure.get_supxlabel()), (axes.yaxis, figure.get_supylabel())):
            if any(tick.get_visible() and tick.get_text() for tick in axis.get_ticklabels()):
                text = axis.get_label_text() or shared
                assert "(" in text and text.endswith(")"), f"{text!r} has no unit"
    check_caption(draw)


@pytest.mark.parametrize("draw", FIGURES, ids=name_of)
def test_the_file_is_small_and_always_the_same(draw: Draw, folder: Path, tmp_path: Path) -> None:
    check_file(draw, folder, tmp_path)


def no_jump(content: Content) -> Content:
    """Only contact runs were tested; both ways of explaining say the same of everything."""
    less = {name: content[name][content[name]["label"] == "contact"] for name in ("runs", "examples")}
    return {**content, **less, "agreement": content["agreement"].assign(shares=np.nan, trajectories=np.nan)}


def nothing(content: Content) -> Content:
    return {name: table.head(0) for name, table in content.items()}


@pytest.mark.parametrize("less", [networks_only, no_jump, nothing], ids=lambda f: f.__name__)
def test_missing_parts_leave_a_figure(
    less: Callable[[Content], Content], content: Content, tmp_path: Path
) -> None:
    folder = write(tmp_path, less(content))
    for draw in FIGURES:
        figure = check_rendered(draw, folder)
        assert "nan" not in texts(figure), draw.__name__


def test_a_missing_table_is_named(content: Content, tmp_path: Path) -> None:
    folder = write(tmp_path, content)
    (folder / "tables" / "jumps" / "exact.parquet").unlink()
    figures = {"fig_5_23": contributions.relative_contributions}
    with pytest.raises(BadInput, match=r"fig_5_23: .*exact\.parquet: no such file"):
        draw_stage(figures, None, folder, tmp_path / "raw", {5: "cam_follower"}, 1, tmp_path / "out")
