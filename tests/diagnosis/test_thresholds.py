"""Every threshold says what it means, and a study can vary it."""

from __future__ import annotations

import inspect
import re
from dataclasses import fields, replace
from pathlib import Path

import pandas as pd
import pytest

from tests.diagnosis.benches import Bench, pendulum
from tests.diagnosis.studies import HORIZON, JOINT, effect
from unmodelled.diagnosis.data.study import Study, held_out
from unmodelled.diagnosis.data.thresholds import DEFAULT_THRESHOLDS, Thresholds
from unmodelled.diagnosis.fitting.hypothesis import Hypothesis

ROOM = Path(__file__).parents[2] / "unmodelled" / "diagnosis"


def test_every_threshold_has_meaning_unit_origin_and_sensitivity() -> None:
    for each in fields(Thresholds):
        assert set(each.metadata) == {"unit", "origin", "sensitivity"}, each.name
        assert all(each.metadata.values()), each.name
        assert f"\n    {each.name}: " in (inspect.getdoc(Thresholds) or "")


def test_every_threshold_is_used() -> None:
    """By the code of the room, outside the file that defines it."""
    code = "".join(path.read_text() for path in ROOM.rglob("*.py") if path.name != "thresholds.py")
    assert {each.name for each in fields(Thresholds)} <= set(re.findall(r"\.(\w+)\b", code))


def test_the_held_out_share_decides_how_many_are_held_out() -> None:
    table = pd.DataFrame({"id": [str(k) for k in range(8)], "file": "log.csv"})
    shares = {0.25: 2, 0.5: 4, 0.01: 1}
    assert {
        share: len(held_out(table, 0, replace(DEFAULT_THRESHOLDS, held_out_share=share))) for share in shares
    } == shares


def test_a_study_hands_its_thresholds_to_its_hypotheses(tmp_path: Path) -> None:
    system = pendulum(tmp_path)
    logs = Bench(samples=120, groups=tuple("abab")).logs(tmp_path / "logs", system)
    dear = Thresholds(local_complexity=10.0, input_timing=0.1)
    usual, other = (
        Hypothesis.known(Study.of(system, logs, HORIZON, 0, limits)) for limits in (DEFAULT_THRESHOLDS, dear)
    )
    place = replace(JOINT, factor="group", level="a")
    found = [h.plus(effect("coulomb_friction"), place).complexity for h in (usual, other)]
    assert found[1] - found[0] == pytest.approx(10.0 - DEFAULT_THRESHOLDS.local_complexity)
    timing = [next(u for u in h.unknowns if u.name.startswith("timing")) for h in (usual, other)]
    assert timing[1].high == pytest.approx(timing[0].high / 6.0)
