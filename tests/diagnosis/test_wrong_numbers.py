"""A number of the file in a wrong unit is told before all effects; a missing law is none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.diagnosis.diagnoses import told
from tests.diagnosis.run_folder import write_runs
from unmodelled.diagnosis.answer.wrong_numbers import wrong_number
from unmodelled.diagnosis.gates.effect_numbers import impossible_numbers
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system

FAN = """
schema: system/1
name: fan
states: {w: {unit: rad/s}}
inputs: {T: {unit: N m, hold: true}}
outputs: {w: {unit: rad/s}}
parameters: {J: {value: 0.05, unit: kg m^2}, c: {value: DAMPING, unit: N m s/rad},
  F: {value: 0.01, unit: N m, identify: true, bounds: [0, 0.1]}}
ports: {shaft: {effort: T_l, unit: N m, velocity: w}}
dynamics: {w: (T - c*w - F*sign(w) - T_l)/J}
"""
AXIS = """
<mujoco model="axis"><worldbody><body name="carriage">
  <joint name="x" type="slide" axis="1 0 0" damping="DAMPING"/>
  <inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/></body></worldbody>
  <actuator><position name="servo" joint="x" kp="STIFFNESS"/></actuator></mujoco>
"""
AXIS_SYSTEM = """schema: system/1
name: axis
model: robots/axis.xml
inputs: {u_servo: {column: goal, hold: true}}
outputs: {q_x: {column: x}}
"""


def fan(folder: Path, damping: float, drag: float = 0.0) -> str:
    """A fan of 0.05 kg m^2 and 0.2 N m s/rad, whose file may have another damping."""
    rng, tables = np.random.default_rng(3), []
    for _ in range(4):
        T, w, seen = np.repeat(rng.uniform(-3.0, 3.0, 15), 20), 0.0, []
        for torque in T:
            seen.append(w)
            for _ in range(10):
                w += 1e-3 * (torque - 0.2 * w - 0.01 * np.tanh(w / 0.01) - drag * w * abs(w)) / 0.05
        noisy = np.array(seen) + 0.01 * rng.standard_normal(len(T))
        tables.append(pd.DataFrame({"t": 0.01 * np.arange(len(T)), "T": T, "w": noisy}))
    write_runs(folder / "logs", tables)
    return FAN.replace("DAMPING", repr(damping))


def axis(folder: Path, stiffness: float, damping: float) -> str:
    """A carriage of 2 kg behind a servo of 800 N/m and 30 N s/m, whose file may have other numbers."""
    rng, tables = np.random.default_rng(4), []
    for _ in range(4):
        goal, x, v, seen = np.repeat(rng.uniform(-0.1, 0.1, 12), 25), 0.0, 0.0, []
        for wanted in goal:
            seen.append(x)
            for _ in range(20):
                v += 5e-4 * (800.0 * (wanted - x) - 30.0 * v) / 2.0
                x += 5e-4 * v
        noisy = np.array(seen) + 2e-5 * rng.standard_normal(len(goal))
        tables.append(pd.DataFrame({"t": 0.01 * np.arange(len(goal)), "goal": goal, "x": noisy}))
    write_runs(folder / "logs", tables)
    (folder / "robots").mkdir()
    text = AXIS.replace("STIFFNESS", repr(stiffness)).replace("DAMPING", repr(damping))
    (folder / "robots" / "axis.xml").write_text(text.strip())
    return AXIS_SYSTEM


@pytest.mark.parametrize(
    ("machine", "numbers", "name", "said"),
    [
        (fan, (0.2 * np.pi / 30.0,), "c", "9.55 times too small, as by 1/min instead of rad/s: with 0.2 N m"),
        (fan, (0.2 * 9.80665,), "c", "9.81 times too large, as by kilograms instead of newtons"),
        (axis, (0.8, 30.0), "servo_kp", "1e+03 times too small, as by thousandths instead of the unit"),
        (axis, (800.0, 1800.0), "x_damping", "60 times too large, as by minutes instead of seconds"),
        (fan, (0.2,), "", ""),
        (fan, (0.2, 0.03), "", ""),
        (axis, (800.0, 42.0), "", ""),
    ],
    ids=["1/min", "kgf", "mm", "minutes", "right", "drag", "uncertain"],
)
def test_a_number_in_a_wrong_unit_is_told(
    machine: object, numbers: tuple[float, ...], name: str, said: str, tmp_path: Path
) -> None:
    assert callable(machine)
    (tmp_path / "system.yaml").write_text(machine(tmp_path, *numbers))
    system = read_system(tmp_path / "system.yaml")
    answer = replace(told(system, read_logs(tmp_path / "logs", system)), verdict="unknown")
    warning = wrong_number(answer)
    assert (warning is None) is (not name)
    if warning is not None:
        assert (warning.channels, warning.decides) == ((name,), False)
        assert said in warning.sentence and len(warning.sentence) < 300
        around = impossible_numbers(replace(answer, faults=(warning,)))
        assert around == f"its effects were fitted around {name}, a wrong number of the given file"
    assert impossible_numbers(answer) == ""


def test_what_has_no_gap_has_no_wrong_number(tmp_path: Path) -> None:
    (tmp_path / "system.yaml").write_text(fan(tmp_path, 0.2))
    system = read_system(tmp_path / "system.yaml")
    assert wrong_number(told(system, read_logs(tmp_path / "logs", system))) is None
