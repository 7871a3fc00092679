"""Ports between which an effort is missing: a port between them is added."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from tests.machines.folders import logs_of, system_of, write_runs
from unmodelled.api.diagnosis import diagnose
from unmodelled.api.next_experiment import planned
from unmodelled.diagnosis.data.result import JudgedModel
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.diagnosis.where.corrections import Corrections
from unmodelled.diagnosis.where.opposite import opposite_ports, with_ports_between
from unmodelled.logs.folder import read_logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import symbol
from unmodelled.systems.reader import read_system
from unmodelled.systems.writer import write_system

Array = NDArray[np.float64]
Effort = Callable[[Array], tuple[float, float]]

TWO_MASSES = """
schema: system/1
name: two_masses
states: {q1: {unit: rad}, w1: {unit: rad/s}, q2: {unit: rad}, w2: {unit: rad/s}}
inputs: {u: {unit: N m}}
outputs: {q1: {unit: rad}, q2: {unit: rad}}
parameters:
  J1: {value: 0.01, unit: kg m^2}
  J2: {value: 0.03, unit: kg m^2}
  k: {value: 45, unit: N m/rad, identify: true, bounds: [10, 100]}
ports:
  motor: {effort: T1, unit: N m, position: q1, velocity: w1}
  load: {effort: T2, unit: N m, position: q2, velocity: w2}
dynamics:
  q1: w1
  w1: (u - k*(q1 - q2) - T1)/J1
  q2: w2
  w2: (k*(q1 - q2) - T2)/J2
"""
PERIOD, SAMPLES, RUNS, SUBSTEPS, NOISE, HORIZON = 2e-3, 500, 4, 10, 1e-5, 0.1


def damping_between(x: Array) -> tuple[float, float]:
    torque = 0.12 * (x[1] - x[3])
    return torque, -torque


def friction_of_the_load(x: Array) -> tuple[float, float]:
    return 0.0, 0.08 * float(np.tanh(x[3] / 0.05))


def friction_of_both(x: Array) -> tuple[float, float]:
    return 0.08 * float(np.tanh(x[1] / 0.05)), 0.15 * float(np.tanh(x[3] / 0.05))


def friction_beside_damping(x: Array) -> tuple[float, float]:
    torque = 0.06 * (x[1] - x[3])
    return torque, 0.25 * float(np.tanh(x[3] / 0.05)) - torque


def rates(x: Array, torque: float, effort: Effort) -> Array:
    one, two = effort(x)
    spring = 45.0 * (x[0] - x[2])
    return np.array([x[1], (torque - spring - one) / 0.01, x[3], (spring - two) / 0.03])


def lacking(folder: Path, effort: Effort) -> Corrections:
    rng, t, tables = np.random.default_rng(1), PERIOD * np.arange(SAMPLES), []
    h = PERIOD / SUBSTEPS
    for _ in range(RUNS):
        u = 0.5 * np.sin(rng.uniform(4.0, 60.0, 3) * t[:, None] + rng.uniform(0.0, 6.28, 3)).sum(1)
        x = [np.zeros(4)]
        for k in range(SAMPLES - 1):
            now = x[-1]
            for share in (np.arange(SUBSTEPS) + 0.5) / SUBSTEPS:
                torque = u[k] + share * (u[k + 1] - u[k])
                middle = now + 0.5 * h * rates(now, torque, effort)
                now = now + h * rates(middle, torque, effort)
            x.append(now)
        seen = np.array(x)[:, [0, 2]] + NOISE * rng.standard_normal((SAMPLES, 2))
        tables.append(pd.DataFrame({"t": t, "u": u, "q1": seen[:, 0], "q2": seen[:, 1]}))
    known = system_of(TWO_MASSES, folder)
    logs = prepare(known, logs_of(known, folder / "logs", tables))
    model = JudgedModel("known", known, logs, free_runs(known, logs, HORIZON))
    return Corrections.of(model, HORIZON, Sensors(logs))


def test_a_torque_between_two_masses_gives_a_port_between_them(tmp_path: Path) -> None:
    found = lacking(tmp_path, damping_between)
    known = found.model.system
    pairs = opposite_ports(found)
    assert [(one.name, other.name) for one, other in pairs] == [("motor", "load")]
    grown, (name,) = with_ports_between(known, pairs)
    between = grown.port(name)
    assert name == "motor_load"
    assert (between.effort, between.unit) == ("T1_T2", "N m")
    one, other = (grown.dynamics[k].diff(symbol("T1_T2")) for k in (1, 3))
    assert (one, other) == (-1 / symbol("J1"), 1 / symbol("J2"))
    assert grown.signals["q1_minus_q2"] == symbol("q1") - symbol("q2")
    # what is written to a file comes back
    write_system(grown, tmp_path / "grown.yaml")
    assert read_system(tmp_path / "grown.yaml").dynamics == grown.dynamics


@pytest.mark.long
def test_a_law_between_two_masses_is_named_without_a_port_in_the_file(tmp_path: Path) -> None:
    found = lacking(tmp_path, damping_between)
    answer = diagnose(found.model.system, found.model.logs, HORIZON)
    (effect,) = answer.effects
    assert (effect.family, effect.port) == ("viscous_friction", "motor_load")
    (note,) = (
        note for note in answer.notes if "equal and opposite efforts are missing at motor and load" in note
    )
    assert "at the port motor_load" in note
    (number,) = effect.parameters.values()
    assert number["value"] == pytest.approx(0.12, rel=0.03)
    # the file of the machine has no such port; the experiment to make next is designed with it
    (tmp_path / "limits.yaml").write_text("duration: 0.5\ninputs: {u: {low: -1, high: 1}}\n")
    given = found.model.system, found.model.logs, answer.content
    assert planned(*given, tmp_path / "limits.yaml", 0).table()["u"].abs().max() <= 1.0
    assert any("equal and opposite efforts" in note for note in answer.notes)


@pytest.mark.long
def test_a_law_between_two_masses_is_named_beside_a_larger_one(tmp_path: Path) -> None:
    """The friction of the load hides at first that equal and opposite torques are missing."""
    found = lacking(tmp_path, friction_beside_damping)
    assert opposite_ports(found) == ()
    answer = diagnose(found.model.system, found.model.logs, HORIZON)
    named = {(e.family, e.port): next(iter(e.parameters.values()))["value"] for e in answer.effects}
    assert named == {
        ("coulomb_friction", "load"): pytest.approx(0.25, rel=0.01),
        ("viscous_friction", "motor_load"): pytest.approx(0.06, rel=0.01),
    }


@pytest.mark.parametrize("effort", [friction_of_the_load, friction_of_both])
def test_friction_of_one_mass_or_of_both_is_not_between_them(tmp_path: Path, effort: Effort) -> None:
    assert opposite_ports(lacking(tmp_path, effort)) == ()


ROOMS = """
schema: system/1
name: rooms
states: {T1: {unit: K}, T2: {unit: K}}
inputs: {Q1: {unit: W}, Q2: {unit: W}}
outputs: {T1: {unit: K}, T2: {unit: K}}
parameters:
  C: {value: 2.0, unit: J/K}
  U: {value: 0.055, unit: W/K, identify: true, bounds: [0.01, 0.15]}
ports:
  left: {effort: P1, unit: W, position: T1}
  right: {effort: P2, unit: W, position: T2}
dynamics:
  T1: (Q1 - U*(T1 - 293) - P1)/C
  T2: (Q2 - U*(T2 - 293) - P2)/C
"""


@pytest.mark.long
def test_heat_between_two_rooms_is_named_without_a_port_in_the_file(tmp_path: Path) -> None:
    """Two balances with heat exchange of 0.02 W/K; exact steps of a linear system, heaters held."""
    rng, tables, n, every = np.random.default_rng(2), [], 400, 40
    exchange = 0.02 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    rate, modes = np.linalg.eigh((0.05 * np.eye(2) + exchange) / 2.0)
    decay = modes @ np.diag(np.exp(-rate)) @ modes.T
    for _ in range(6):
        Q = rng.uniform(0.0, 1.0, (n // every, 2)).repeat(every, axis=0)
        T = [293.0 + rng.uniform(0.0, 5.0, 2)]
        for heat in Q[:-1]:
            rest = 293.0 + np.linalg.solve(0.05 * np.eye(2) + exchange, heat)
            T.append(rest + decay @ (T[-1] - rest))
        seen = np.array(T) + 0.02 * rng.standard_normal((n, 2))
        columns = dict(zip(("Q1", "Q2", "T1", "T2"), np.hstack([Q, seen]).T, strict=True))
        tables.append(pd.DataFrame({"t": np.arange(float(n)), **columns}))
    write_runs(tmp_path / "logs", tables)
    known = system_of(ROOMS.replace("unit: W}", "unit: W, hold: true}", 2), tmp_path)
    answer = diagnose(known, read_logs(tmp_path / "logs", known))
    (effect,) = answer.effects
    assert (answer.verdict, effect.family, effect.port) == ("effect", "linear_loss", "left_right")
    (number,) = effect.parameters.values()
    assert number["value"] == pytest.approx(0.02, rel=0.03) and number["unit"] == "W/K"
