"""Advice on shorter windows where most of the gap is left."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.diagnosis.diagnoses import Said, diagnosis
from tests.diagnosis.studies import HORIZON
from unmodelled.diagnosis.answer.shorter_windows import shorter_windows
from unmodelled.diagnosis.data.result import Verdict
from unmodelled.effects.place import Place

DAMPING = Said("viscous_friction", Place("port", "joint"), {"d": 0.002})


@pytest.mark.parametrize(
    ("verdict", "shrink", "horizon", "advised"),
    [
        *(("main_effect", 0.3, HORIZON, "horizon=0.017"), ("unknown", 0.0, HORIZON, "horizon=0.017")),
        *(("main_effect", 0.8, HORIZON, ""), ("effect", 0.3, HORIZON, ""), ("unknown", 0.0, 0.02, "")),
    ],
)
def test_most_of_the_gap_is_left(
    verdict: Verdict, shrink: float, horizon: float, advised: str, tmp_path: Path
) -> None:
    found = replace(diagnosis(tmp_path, DAMPING), verdict=verdict, shrink=shrink, horizon=horizon)
    notes = list(shorter_windows(found))
    assert [advised in note for note in notes] == [True] * bool(advised)


def test_a_port_without_a_position_has_no_travel(tmp_path: Path) -> None:
    found = replace(diagnosis(tmp_path, DAMPING), verdict="unknown", shrink=0.0)
    (port,) = found.system.ports
    still = replace(found.system, ports=(replace(port, position=None),))
    assert not list(shorter_windows(replace(found, system=still)))
