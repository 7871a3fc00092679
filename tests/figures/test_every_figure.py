"""Every figure of every chapter: units, caption and file, and what is left where tables lack something."""

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from pipeline.figures.clutch import identification
from pipeline.figures.jumps import contributions
from pipeline.stages.draw import draw as draw_stage
from tests.figures import test_chapter2_figures as tutorial
from tests.figures import test_chapter3_figures as clutch
from tests.figures import test_chapter4_figures as slider_crank
from tests.figures import test_chapter5_figures as campaign
from tests.figures import test_chapter6_figures as drivetrain
from tests.figures import test_jump_figures as jumps
from tests.figures import test_withheld_figures as withheld
from tests.figures.checks import Chapter, Draw, check_axes, check_caption, check_file, check_rendered, texts
from unmodelled.base.errors import BadInput

CHAPTERS: dict[str, Chapter] = {
    **{"tutorial": tutorial.CHAPTER, "clutch": clutch.CHAPTER, "slider_crank": slider_crank.CHAPTER},
    **{"campaign": campaign.CHAPTER, "drivetrain": drivetrain.CHAPTER, "jumps": jumps.CHAPTER},
    **{"withheld": withheld.CHAPTER},
}


def case(name: str, *values: Any) -> Any:
    """Values with the name of their chapter; only the figures of the withheld check take no time."""
    marks = () if name == "withheld" else pytest.mark.long
    return pytest.param(*values, id="-".join([name, *(v.__name__ for v in values[1:])]), marks=marks)


FIGURES = [case(name, name, draw) for name, chapter in CHAPTERS.items() for draw in chapter.figures]
LACKING = [case(name, chapter, less) for name, chapter in CHAPTERS.items() for less in chapter.lacking]


@pytest.fixture(scope="module")
def folder_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The data folder of a chapter."""

    @cache
    def made(name: str) -> Path:
        return CHAPTERS[name].write(tmp_path_factory.mktemp(name), CHAPTERS[name].make())

    return made


@pytest.mark.parametrize(("name", "draw"), FIGURES)
def test_axes_carry_units_and_the_caption_is_a_sentence(
    name: str, draw: Draw, folder_of: Callable[[str], Path]
) -> None:
    check_axes(draw, folder_of(name))
    check_caption(draw)


@pytest.mark.parametrize(("name", "draw"), FIGURES)
def test_the_file_is_small_and_always_the_same(
    name: str, draw: Draw, folder_of: Callable[[str], Path], tmp_path: Path
) -> None:
    check_file(draw, folder_of(name), tmp_path)


@pytest.mark.parametrize(("chapter", "less"), LACKING)
def test_missing_parts_leave_a_figure(chapter: Chapter, less: Callable[[Any], Any], tmp_path: Path) -> None:
    folder = chapter.write(tmp_path, less(chapter.make()))
    for draw in chapter.figures:
        figure = check_rendered(draw, folder)
        assert figure.axes and not re.search(r"\bnan\b", texts(figure)), draw.__name__


@pytest.mark.long
@pytest.mark.parametrize(
    ("chapter", "table", "figure", "draw"),
    [
        ("clutch", "pairs", "fig_3_14_2", identification.profile_pairs),
        ("jumps", "exact", "fig_5_23", contributions.relative_contributions),
    ],
)
def test_a_missing_table_is_named(chapter: str, table: str, figure: str, draw: Draw, tmp_path: Path) -> None:
    folder = CHAPTERS[chapter].write(tmp_path, CHAPTERS[chapter].make())
    (folder / "tables" / chapter / f"{table}.parquet").unlink()
    campaigns = {3: "clutch", 5: "cam_follower"}
    with pytest.raises(BadInput, match=rf"{figure}: .*{table}\.parquet: no such file"):
        draw_stage({figure: draw}, None, folder, tmp_path / "raw", campaigns, 1, tmp_path / "out")
