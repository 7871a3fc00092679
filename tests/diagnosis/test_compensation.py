"""A table beside an answer compensates the error of a sensor that is a function of what it shows."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.diagnoses import FRICTION, Said, diagnosis
from tests.diagnosis.studies import ANGLE, scales_of
from unmodelled.base.arrays import Array
from unmodelled.diagnosis.answer.compensation import compensations
from unmodelled.diagnosis.answer.summary import summary
from unmodelled.diagnosis.data.result import Diagnosis
from unmodelled.diagnosis.where.where import where
from unmodelled.effects.own_law import Law, Number

FILE = "compensation_theta.csv"
WAVE = Said("cyclic_error", ANGLE, {"A_s": 0.03, "A_c": 0.02, "n_y": 2.0})
OVERTONE = Said("cyclic_error", ANGLE, {"A_s": 0.1, "A_c": 0.0, "B_s": 0.0, "B_c": 0.05}, "with_overtone")
#: The same beside a first error, whose names are taken.
SECOND = replace(OVERTONE, numbers={"A_s_theta": 0.1, "A_c_theta": 0.0, "B_s": 0.0, "B_c": 0.05})


def wave(right: Array) -> Array:
    return right + 0.03 * np.sin(2.0 * right) + 0.02 * np.cos(2.0 * right)


def overtone(right: Array) -> Array:
    return right + 0.1 * np.sin(right) + 0.05 * np.cos(2.0 * right)


def both(right: Array) -> Array:
    return overtone(wave(right))


def shown_and_add(found: Diagnosis) -> tuple[Array, Array]:
    shown, add, low, high = compensations(found)[FILE].to_numpy().T
    assert (low < add).all() and (add < high).all()
    return shown, add


@pytest.mark.parametrize(
    ("said", "shows"), [((WAVE,), wave), ((OVERTONE,), overtone), ((WAVE, SECOND), both)]
)
def test_the_table_undoes_the_error_over_a_turn(
    tmp_path: Path, said: tuple[Said, ...], shows: Callable[[Array], Array]
) -> None:
    """Also of two errors, of which one acts on what the other shows."""
    found = diagnosis(tmp_path, FRICTION, *said)
    shown, add = shown_and_add(found)
    assert np.allclose(shown, np.deg2rad(np.arange(360.0)))
    assert np.abs(shows(shown + add) - shown).max() < 1e-9
    told = [each.get("compensation") for each in summary(found, where(found))["effects"]]
    assert told == [None, *[FILE] * len(said)]


def test_a_curve_of_a_user_is_compensated_over_the_logged_values(tmp_path: Path) -> None:
    found = diagnosis(tmp_path, WAVE)
    law = Law("bend", "y + c*y**2", {"c": Number("1/rad", 0.1)}, at="sensor")
    added = law.add(found.system, ANGLE, scales_of(found.system, found.logs))
    (effect,) = found.effects
    number = replace(effect.estimates["A_s"], value=0.1, interval=(0.09, 0.11))
    grown = replace(found.augmented, system=added.system.with_values({"c": 0.1}))
    effects = (replace(effect, added=added, estimates={"c": number}),)
    shown, add, *_ = compensations(replace(found, effects=effects, augmented=grown))[FILE].to_numpy().T
    assert (shown.min(), shown.max()) == (found.logs.y[:, 0].min(), found.logs.y[:, 0].max())
    assert np.abs((shown + add) + 0.1 * (shown + add) ** 2 - shown).max() < 1e-9


@pytest.mark.parametrize("numbers", [{"A_s": 0.45, "A_c": 0.45}, {"A_s": 0.3, "A_c": 0.2, "n_y": 4.0}])
def test_an_angle_that_is_shown_backwards_has_no_table(tmp_path: Path, numbers: dict[str, float]) -> None:
    found = diagnosis(tmp_path, replace(WAVE, numbers={**WAVE.numbers, **numbers}))
    assert compensations(found) == {}
    assert "compensation" not in summary(found, where(found))["effects"][0]


def test_an_error_that_comes_not_once_per_turn_is_left_alone(tmp_path: Path) -> None:
    """Behind a gear, what is shown in a turn does not tell the error: the interval says so."""
    found = diagnosis(tmp_path, replace(WAVE, numbers={**WAVE.numbers, "n_y": 2.5}))
    turns = np.repeat(np.linspace(-40.0, 40.0, len(found.logs)), np.diff(found.logs.offsets))
    moved = replace(found.logs, y=found.logs.y + turns[:, None])
    _, add, low, high = compensations(replace(found, logs=moved))[FILE].to_numpy().T
    assert (low < 0.0).all() and (high > 0.0).all() and np.abs(add).max() < 0.02
