"""A mass at a port whose mobility is a round number is written with its unit, and read back."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.physics.effects.benches import measured
from tests.physics.robot.mechanisms import system_of
from unmodelled.effects.added import with_numbers
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.systems.reader import read_system
from unmodelled.systems.writer import write_system

SLIDER = """<mujoco><worldbody><body name="cart"><joint name="rail" type="slide" axis="1 0 0"/>
  <inertial pos="0 0 0" mass="{}" diaginertia="1 1 1"/></body></worldbody>
  <actuator><motor name="drive" joint="rail"/></actuator></mujoco>"""


@pytest.mark.parametrize("mass", [0.05, 0.5, 1.0, 2.0, 4.0, 0.0071])
@pytest.mark.parametrize("variant", ["", "with_weight"])
def test_a_round_mobility_keeps_its_unit_in_the_file(mass: float, variant: str, tmp_path: Path) -> None:
    given = system_of(tmp_path, SLIDER.format(mass), "inputs: {u_drive: {}}\n")
    (effect,) = (e for e in effects() if (e.family, e.variant) == ("inertia_error", variant))
    added = effect.add(given, Place("port", "rail"), measured(given))
    system = with_numbers(added.system, [added], {"dM": 0.1 * mass})
    write_system(system, tmp_path / "augmented.yaml")
    assert read_system(tmp_path / "augmented.yaml") == system
