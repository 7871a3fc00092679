"""Systems as FMUs: run by FMPy, they are the free runs of this package, with delays and initial states."""

import re
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import fmpy
import numpy as np
import pytest
import sympy as sp
from fmpy.validation import validate_fmu

from tests.machines.folders import system_of, text_of
from tests.machines.known import SYSTEMS, Array, built_in
from tests.physics.robot.mechanisms import CART
from tests.physics.robot.mechanisms import system_of as robot_of
from unmodelled import BadInput, System, write_fmu
from unmodelled.__main__ import PROGRAM
from unmodelled.cli.command_line import main
from unmodelled.diagnosis.gates.fmu import reason_against_fmu
from unmodelled.engine.fmu.stepper import Stepper
from unmodelled.engine.free_run import Integration, Windows, free_run
from unmodelled.engine.machine.program import Program

PENDULUM = built_in("pendulum")
STEP = 0.004
RC = """
schema: system/1
name: rc_branch
states: {v: {unit: V, initial: R*i}}
inputs: {i: {unit: A}}
outputs: {u: {unit: V, expression: v + R_0*i}}
operating_point: {u_0: {unit: V}}
parameters: {R: {value: 2.0, unit: ohm}, R_0: {value: 1.0, unit: ohm}, C: {value: 0.1, unit: F}}
dynamics: {v: (i - (v - u_0)/R)/C}
"""


def simulated(system: System, folder: Path, u: Array, start: Mapping[str, float]) -> Array:
    """Outputs of the FMU (samples, outputs) along inputs (samples, inputs) that are held."""
    file = folder / "machine.fmu"
    write_fmu(system, file)
    assert validate_fmu(str(file)) == []
    names = ["time", *(item.name for item in system.inputs)]
    held = np.rec.fromarrays([STEP * np.arange(len(u)), *u.T], names=names)
    shown = [item.name for item in system.outputs]
    steps = {"stop_time": STEP * (len(u) - 1), "output_interval": STEP, "step_size": STEP}
    given = {"start_values": dict(start), "input": held, "output": shown, "fmi_type": "CoSimulation"}
    found = fmpy.simulate_fmu(str(file), **steps, **given)
    return np.stack([found[name] for name in shown], 1)


def variables(system: System, folder: Path) -> list[Any]:
    """Variables of the FMU of a system."""
    write_fmu(system, folder / "machine.fmu")
    return fmpy.read_model_description(str(folder / "machine.fmu")).modelVariables


def held_run(system: System, u: Array, x0: Array) -> Array:
    """Outputs (samples, outputs) of the register machine, with inputs that are held."""
    one, steps = np.zeros(1, np.int64), len(u) - 1
    windows = Windows(u, STEP * np.arange(len(u)), one, one + steps, one, one)
    program = Program.of(system, [item.expression for item in system.outputs])
    how = Integration(STEP, "rk4", 4)
    return free_run(program, windows, np.array(system.values)[None, None], np.empty((1, 0)), x0, how)[0, 0]


@pytest.fixture(scope="module")
def torque() -> Array:
    return np.random.default_rng(0).normal(size=(60, 1)).repeat(4, axis=0)


def test_an_fmu_is_the_free_run(torque: Array, tmp_path: Path) -> None:
    shown = simulated(PENDULUM, tmp_path, torque, {"start_theta": 0.3, "start_omega": -1.0})
    assert shown == pytest.approx(held_run(PENDULUM, torque, np.array([[[0.3, -1.0]]])), abs=1e-9)


def test_parameters_and_names_are_those_of_the_system(tmp_path: Path) -> None:
    found = {v.name: (v.causality, v.start and float(v.start)) for v in variables(PENDULUM, tmp_path)}
    parameters = {p.name: ("parameter", p.value) for p in PENDULUM.parameters}
    starts = {f"start_{s.name}": ("parameter", 0.0) for s in PENDULUM.states}
    sides = {"torque": ("input", 0.0), "theta": ("output", None), "time": ("independent", None)}
    assert found == parameters | starts | sides


def test_an_initial_value_follows_from_the_inputs_and_a_constant_is_a_parameter(tmp_path: Path) -> None:
    """A voltage R*i decays to R*i + u_0 within R*C; i and u_0 are set before the start."""
    u = np.full((101, 1), 1.5)
    shown = simulated(system_of(RC, tmp_path), tmp_path, u, {"i": 1.5, "u_0": 0.4})
    t = STEP * np.arange(101)
    assert shown[:, 0] == pytest.approx(3.0 + 0.4 * (1.0 - np.exp(-t / 0.2)) + 1.5, abs=1e-9)


@pytest.mark.parametrize("delay", [2.0 * STEP, 1.3 * STEP, 0.2 * STEP])
@pytest.mark.parametrize("of", ["inputs", "outputs"])
def test_delays_are_simulated(of: str, delay: float, torque: Array) -> None:
    """A machine that rests first does the same later: at T, and with a delay of d at T + d."""
    (item,) = getattr(PENDULUM, of)
    late = replace(PENDULUM, **{of: (replace(item, delay=delay),)})
    nothing, rest = np.zeros(1), np.zeros(2)
    runs = [Stepper(s, np.array(s.values), np.empty(0), nothing, rest) for s in (late, PENDULUM)]
    for u in torque:
        for run in runs:
            run.step(u, STEP)
    shown = runs[1].y
    assert abs(runs[0].y - shown) > 1e-3
    runs[0].step(nothing + 9.0, delay)
    assert runs[0].y == pytest.approx(shown, abs=1e-8)


def test_the_command_writes_an_fmu(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(PROGRAM, ["export", f"system={SYSTEMS}/pendulum.yaml", f"out={tmp_path}/machine.fmu"]) == 0
    assert "inputs: torque (N m)\noutputs: theta (rad)\n" in capsys.readouterr().out
    assert validate_fmu(str(tmp_path / "machine.fmu")) == []


def test_what_is_no_fmu_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(BadInput, match=r"must end in \.fmu, for example machine\.fmu"):
        write_fmu(PENDULUM, tmp_path / "machine.zip")
    named = replace(PENDULUM, parameters=(replace(PENDULUM.parameters[0], name="start_theta"),))
    with pytest.raises(BadInput, match="start_theta: the FMU has an initial state of that name"):
        write_fmu(named, tmp_path / "machine.fmu")
    monkeypatch.setitem(sys.modules, "pythonfmu3", None)
    with pytest.raises(BadInput, match="needs pythonfmu3"):
        write_fmu(PENDULUM, tmp_path / "machine.fmu")
    assert not list(tmp_path.iterdir())


def test_a_constant_of_other_experiments_is_the_start_value(tmp_path: Path) -> None:
    listed = RC.replace("u_0: {unit: V}", "u_0: {unit: V, values: {run1: 0.1}, other: 0.4}")
    found = variables(system_of(listed, tmp_path), tmp_path)
    assert {v.name: v.start for v in found if v.name == "u_0"} == {"u_0": "0.4"}


def test_an_fmu_of_a_mass_that_no_robot_has_is_not_written(tmp_path: Path) -> None:
    system = robot_of(tmp_path, CART.format(2), "parameters: {cart_mass: {}}\n")
    write_fmu(system, tmp_path / "cart.fmu")
    with pytest.raises(BadInput, match=r"cart\.mass would be -1 kg, which is never negative"):
        write_fmu(system.with_values({"cart_mass": -1.0}), tmp_path / "wrong.fmu")
    assert not (tmp_path / "wrong.fmu").exists()


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        (
            "motor.yaml",
            "{value: 2.0e-3,",
            "{value: 0,",
            "the rate of i has no value at the start with L = 0 H",
        ),
        (
            "two_masses.yaml",
            "{value: 0.03",
            "{value: -0.03",
            "J2 = -0.03 kg m^2, and what stores is positive",
        ),
        ("two_masses.yaml", "T2)/J2", "T2)/(J2 + J1)", ""),
        (
            "two_masses.yaml",
            "T2)/J2",
            "T2)/(J2 - 10*J1)",
            "the mass or inertia at load is negative at the start",
        ),
        (
            "two_masses.yaml",
            "u: {unit: N m}",
            "u: {unit: N m, delay: -0.01}",
            "u acts 0.01 s before it is given",
        ),
        (
            "rooted_tank.yaml",
            "{unit: m}}\ni",
            "{unit: m}}\ni",
            "the rate of h has no value at the start with G",
        ),
        ("rooted_tank.yaml", "{unit: m}}\ni", "{unit: m, initial: 0.6}}\ni", ""),
        ("tank.yaml", "A: {value: ", "A: {value: -", "A = -0.5 m^2, and what stores is positive"),
        (
            "swing.yaml",
            "expression: rate",
            "expression: rate*sin(phi)/phi",
            "the output tacho has no value at the",
        ),
        (
            "swing.yaml",
            "expression: rate",
            "expression: rate*d*rate/torque",
            "",
        ),  # of a torque, it has a value
        ("swing.yaml", "{unit: rad}, rate", "{unit: rad, initial: asin(torque/mgl)}, rate", ""),
    ],
)
def test_an_fmu_that_cannot_start_is_not_written(
    file: str, old: str, new: str, words: str, tmp_path: Path
) -> None:
    system = system_of(text_of(file, (old, new)), tmp_path)
    if words:
        with pytest.raises(BadInput, match=re.escape(f"machine.fmu was not written: {words}")):
            write_fmu(system, tmp_path / "machine.fmu")
    else:
        write_fmu(system, tmp_path / "machine.fmu")
    assert (tmp_path / "machine.fmu").exists() != bool(words)


def test_an_fmu_that_says_something_else_or_runs_otherwise_is_not_written(tmp_path: Path) -> None:
    write_fmu(PENDULUM, tmp_path / "machine.fmu")
    assert reason_against_fmu(PENDULUM, tmp_path / "machine.fmu") == ""
    heavier = PENDULUM.with_values({"J": 0.3})
    assert "gives J the value" in reason_against_fmu(heavier, tmp_path / "machine.fmu")
    theta, omega = PENDULUM.states
    raised = replace(PENDULUM, states=(replace(theta, initial=sp.Float(0.2)), omega))
    reason = reason_against_fmu(raised, tmp_path / "machine.fmu")
    assert reason == "it does not run as the system does; please report this line"


def test_an_answer_that_does_not_offer_its_system_has_no_fmu(tmp_path: Path) -> None:
    sentence = "augmented_system.yaml is not offered: theta diverges; keep pendulum.yaml"
    answer = SimpleNamespace(system=PENDULUM, refused=(sentence,))
    with pytest.raises(BadInput, match=r"machine\.fmu was not written: augmented_system"):
        write_fmu(answer, tmp_path / "machine.fmu")
