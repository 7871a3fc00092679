"""Laws with a free shape: a loop of another shape than the starting values is named, with its numbers."""

from pathlib import Path

import pytest

from tests.diagnosis.planted import plant
from tests.diagnosis.studies import effect
from tests.machines.folders import read_case
from unmodelled.diagnosis.answer.diagnose import diagnose_gap
from unmodelled.diagnosis.core import columns
from unmodelled.diagnosis.data.thresholds import Thresholds
from unmodelled.effects.library import effects

#: Families of friction, which are the only ones that this test compares.
FRICTION = ("viscous_friction", "coulomb_friction", "stribeck_friction", "hysteresis")


@pytest.mark.long
@pytest.mark.parametrize(("back", "exponent"), [(0.9, 3.0), (0.2, 1.5)])
def test_a_loop_of_another_shape_is_hysteresis(
    back: float, exponent: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant(tmp_path, effect("hysteresis", "bouc_wen"), numbers={"b_h": back, "n_h": exponent, "x_h": 0.1})
    monkeypatch.setattr(columns, "effects", lambda: tuple(e for e in effects() if e.family in FRICTION))
    # a loop of the fixed shape predicts nearly as well, and is named where complexity has its price
    cheap = Thresholds(material_share=0.005)
    found = diagnose_gap(*read_case(tmp_path), 0.2, 0, 1, thresholds=cheap)
    (named,) = found.effects
    assert (named.added.family, named.added.variant) == ("hysteresis", "bouc_wen")
    assert named.estimates["F_h"].value == pytest.approx(0.15, rel=0.05)
    assert named.estimates["x_h"].value == pytest.approx(0.1, rel=0.1)
    assert named.estimates["b_h"].value == pytest.approx(back, abs=0.1)
    assert named.estimates["n_h"].value == pytest.approx(exponent, rel=0.15)
