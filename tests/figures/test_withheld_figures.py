"""Figures of the withheld check on small made-up tables."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipeline.figures.withheld import calibration, confusion, detection, shrink
from pipeline.figures.withheld.tables import FINDERS, MACHINES
from pipeline.withheld import scores
from tests.evaluation.test_withheld import table
from tests.figures.checks import (
    Draw,
    check_caption,
    check_file,
    check_rendered,
    figures_of,
    name_of,
    write_tables,
)

FIGURES = figures_of("withheld")


def write(folder: Path, cases: pd.DataFrame) -> Path:
    tables = {"cases": cases, "detection": scores.detection(cases), "calibration": scores.calibration(cases)}
    return write_tables(folder, "withheld", tables | {"confusion": scores.confusion(cases)})


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("data"), table())


@pytest.mark.parametrize("draw", FIGURES, ids=name_of)
def test_axes_carry_units_and_the_caption_is_a_sentence(draw: Draw, folder: Path) -> None:
    figure = draw(folder)
    for axes in figure.axes:
        assert axes.get_xlabel().endswith(")")
    assert figure.axes[0].get_ylabel().endswith(")")
    check_caption(draw)


@pytest.mark.parametrize("draw", FIGURES, ids=name_of)
def test_the_file_is_small_and_always_the_same(draw: Draw, folder: Path, tmp_path: Path) -> None:
    check_file(draw, folder, tmp_path)


@pytest.mark.parametrize("kind", ["null", "outside", "pair"])
def test_figures_draw_when_there_is_one_kind_only(kind: str, tmp_path: Path) -> None:
    cases = table()
    data = write(tmp_path, cases[cases["kind"] == kind])
    for draw in FIGURES:
        check_rendered(draw, data)


def test_counts_are_written_into_the_matrix(folder: Path) -> None:
    axes = confusion.confusion_matrix(folder).axes[0]
    assert [text.get_text() for text in axes.texts] == ["1"] * 4
    assert [label.get_text() for label in axes.get_xticklabels()][-2:] == ["unknown", "no gap"]


def test_curves_show_the_shares(folder: Path) -> None:
    axes = detection.amplitude_detection(folder).axes[0]
    lines = {str(line.get_label()): np.asarray(line.get_ydata()) for line in axes.lines}
    assert lines[FINDERS["oracle"].label] == pytest.approx([0.0, 100.0])
    assert lines[FINDERS["top1"].label] == pytest.approx([100.0, 25.0])
    numbers = [text.get_text() for text in calibration.calibration_curve(folder).axes[0].texts]
    assert numbers == ["1", "1", "8"]


def test_a_right_answer_is_a_filled_marker(folder: Path) -> None:
    left = shrink.shrink_against_oracle(folder).axes[0]
    faces = [len(points.get_facecolor()) > 0 for points in left.collections if len(points.get_offsets())]
    assert sorted(faces) == [False, False, True]


def test_every_machine_has_a_look() -> None:
    from pipeline.rigs.withheld.machines import MACHINES as REAL

    assert set(MACHINES) == {machine.name for machine in REAL}
