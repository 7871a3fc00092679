"""Figures of the withheld check on small made-up tables."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipeline.figures import withheld
from pipeline.withheld import scores
from tests.evaluation.test_withheld import table
from tests.figures.checks import Chapter, write_tables


def write(folder: Path, cases: pd.DataFrame) -> Path:
    tables = {"cases": cases, "detection": scores.detection(cases), "calibration": scores.calibration(cases)}
    return write_tables(folder, "withheld", tables | {"confusion": scores.confusion(cases)})


def only(kind: str) -> Callable[[pd.DataFrame], pd.DataFrame]:
    return lambda cases: cases[cases["kind"] == kind]


CHAPTER = Chapter(("withheld",), table, write, (only("null"), only("outside"), only("pair")))


def test_counts_are_written_into_the_matrix(folder: Path) -> None:
    axes = withheld.confusion_matrix(folder).axes[0]
    assert [text.get_text() for text in axes.texts] == ["1"] * 4
    assert [label.get_text() for label in axes.get_xticklabels()][-2:] == ["unknown", "no gap"]


def test_curves_show_the_shares(folder: Path) -> None:
    axes = withheld.amplitude_detection(folder).axes[0]
    lines = {str(line.get_label()): np.asarray(line.get_ydata()) for line in axes.lines}
    assert lines[withheld.FINDERS["oracle"].label] == pytest.approx([0.0, 100.0])
    assert lines[withheld.FINDERS["top1"].label] == pytest.approx([100.0, 25.0])
    numbers = [text.get_text() for text in withheld.calibration_curve(folder).axes[0].texts]
    assert numbers == ["1", "1", "8"]


def test_a_right_answer_is_a_filled_marker(folder: Path) -> None:
    left = withheld.shrink_against_oracle(folder).axes[0]
    faces = [len(points.get_facecolor()) > 0 for points in left.collections if len(points.get_offsets())]
    assert sorted(faces) == [False, False, True]


def test_every_machine_has_a_look() -> None:
    from pipeline.rigs.withheld.machines import MACHINES as REAL

    assert set(withheld.MACHINES) == {machine.name for machine in REAL}
