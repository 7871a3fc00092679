"""Hypotheses of a user, compared as a diagnosis compares laws."""

from typing import Any

import numpy as np
import pandas as pd
import pytest

import unmodelled as um
from tests.diagnosis.benches import pendulum
from tests.face.test_own_law import BRAKE, logged
from unmodelled.api.comparison import Comparison
from unmodelled.diagnosis.answer.own_hypotheses import ComparedHypotheses, ComparedHypothesis

SIZE = {"unit": "mN m s/rad", "plausible": 20, "low": 0}
EDDY_BRAKE = um.Law("eddy_brake", "c*v*(1 - cos(x))", {"c": SIZE})


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, "hypotheses: must be laws by name"),
        (["coulomb_friction"], "hypotheses: must be laws by name"),
        ({"a": 3}, "hypotheses: a: must be a list of laws, got int"),
        ({"a": [3]}, "hypotheses: a: must be laws or names, got int"),
        ({"a": "coulomb"}, "hypotheses: a: there is no law 'coulomb'; did you mean 'coulomb_friction'"),
        ({"a": ["coulomb_friction@elbow"]}, "coulomb_friction: cannot act at 'elbow', must be one of joint"),
        ({"a": ["overflow"]}, "hypotheses: a: overflow: pendulum has no place with all that this law needs"),
        ({"a": um.Law("backlash", "k*x", {"k": {"unit": "N m/rad", "plausible": 1}})}, "the name is taken"),
    ],
)
def test_hypotheses_that_cannot_be_compared_are_refused(given: Any, words: str) -> None:
    with pytest.raises(um.BadInput, match=words):
        um.compare(*um.example("pendulum"), given)


def test_logs_in_degrees_are_refused_with_what_to_do() -> None:
    system, logs = um.example("pendulum")
    degrees = logs.table().assign(theta=lambda rows: np.degrees(rows["theta"]))
    with pytest.raises(um.BadInput, match=r"^logs: correct this before laws are compared: .*degrees"):
        um.compare(system, degrees, {"friction": ["coulomb_friction"]}, quiet=True)


def test_the_table_has_paired_differences_and_a_row_without_a_fit() -> None:
    rows = [("a", [4.0, 5.0, 6.0]), ("b", [3.0, 5.0, 4.0]), ("c", [np.nan])]
    each = tuple(ComparedHypothesis(name, (name,), np.array(scores), 1.0, ()) for name, scores in rows)
    found = Comparison(ComparedHypotheses(each, (0.75, 0.25, np.nan), 0.2, ("a note",)))
    table = found.table().set_index("hypothesis")
    assert table.difference.tolist()[:2] == [0.0, 3.0] and table.elpd.tolist()[:2] == [15.0, 12.0]
    assert table.standard_error["b"] == pytest.approx(np.sqrt(3.0))  # of the differences 1, 0, 2
    assert table.loc["c", ["elpd", "difference", "probability"]].isna().all()
    assert (found.best, found.probability("b")) == ("a", 0.25)
    assert repr(found).startswith("a predicts best, probability 75 %") and "note: a note" in repr(found)
    assert found._repr_html_().count("<table") == 1 and len(found.numbers) == 0
    with pytest.raises(um.BadInput, match="hypotheses: there is no 'd'"):
        found.probability("d")


@pytest.mark.long
def test_the_law_that_was_planted_predicts_best_with_its_number(tmp_path_factory: Any) -> None:
    folder = tmp_path_factory.mktemp("braked")
    pendulum(folder)
    logs = [logged(k) for k in range(4)]
    both = {"brake": EDDY_BRAKE, "friction": ["coulomb_friction", "viscous_friction"], "wrong": ["backlash"]}
    found = um.compare(folder / "system.yaml", logs, both, quiet=True)
    assert found.best == "brake" and found.probability("brake") > 0.99
    assert {*found.table().hypothesis} == {"no law", *both}
    row = found.numbers.query("hypothesis == 'brake'").iloc[0]
    assert row.low < 1e3 * BRAKE < row.high and row.unit == "mN m s/rad"
    assert row.value == pytest.approx(1e3 * BRAKE, rel=0.05)
    friction = found.table().set_index("hypothesis").laws["friction"]
    assert friction.startswith("Coulomb friction") and "viscous friction" in friction


@pytest.mark.long
def test_evidence_is_that_of_the_diagnosis() -> None:
    system, logs = um.example("pendulum")
    answer = um.diagnose(system, logs, quiet=True)
    found = um.compare(system, logs, {"friction": "coulomb_friction", "nothing": []}, quiet=True)
    nats: pd.Series = answer.evidence.query("law == 'Coulomb friction at joint'").nats
    ours = found.table().set_index("hypothesis")
    assert len(nats) == 2 and ours.evidence["friction"] == pytest.approx(nats.mean(), abs=0.5)
    assert ours.evidence["nothing"] == pytest.approx(0.0, abs=1e-6) and len(ours) == 2
