"""Ports between which an effort is missing: said with the lines of a port between them."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from tests.diagnosis.run_folder import write_runs
from unmodelled.diagnosis.data.result import JudgedModel
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.diagnosis.where.corrections import Corrections
from unmodelled.diagnosis.where.opposite import opposite_ports
from unmodelled.logs.folder import read_logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

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
    write_runs(folder / "logs", tables)
    known = written(folder, TWO_MASSES)
    logs = prepare(known, read_logs(folder / "logs", known))
    model = JudgedModel("known", known, logs, free_runs(known, logs, HORIZON))
    return Corrections.of(model, HORIZON, Sensors(logs))


def written(folder: Path, text: str) -> System:
    (folder / "system.yaml").write_text(text)
    return read_system(folder / "system.yaml")


def test_a_torque_between_two_masses_is_said_with_the_lines_of_a_port(tmp_path: Path) -> None:
    (sentence,) = opposite_ports(lacking(tmp_path, damping_between))
    assert sentence.startswith("equal and opposite efforts are missing at motor and load")
    signals, ports = (
        re.search(rf"under {name}: {{(.*?}}?)}}[,\s]", sentence) for name in ("signals", "ports")
    )
    assert signals is not None and ports is not None
    # the lines, copied into the file, give a system with a port between the two
    equations = TWO_MASSES.replace("- T1)", "- (T1 + T1_T2))").replace("- T2)", "- (T2 - T1_T2))")
    text = equations.replace("ports:\n", f"signals: {{{signals[1]}}}\nports:\n  {ports[1]}\n")
    between = written(tmp_path, text).port("motor_load")
    assert (between.effort, between.unit) == ("T1_T2", "N m")
    assert (between.position, between.velocity) == ("x_motor_load", "v_motor_load")


@pytest.mark.parametrize("effort", [friction_of_the_load, friction_of_both])
def test_friction_of_one_mass_or_of_both_is_not_between_them(tmp_path: Path, effort: Effort) -> None:
    assert opposite_ports(lacking(tmp_path, effort)) == ()
