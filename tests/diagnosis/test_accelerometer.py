"""An output that depends on what the model leaves out: an accelerometer, and the torque in a foot."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import unmodelled
from tests.diagnosis.studies import fitted
from tests.machines.folders import diagnosed, logs_of, system_of, write_runs
from unmodelled.diagnosis.core.choose import Chooser
from unmodelled.diagnosis.core.columns import Columns
from unmodelled.diagnosis.core.equations import Equations
from unmodelled.diagnosis.core.path import Path as FreeRun
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import Hypothesis
from unmodelled.logs.preparation import several

CART = """
schema: system/1
name: cart
states: {x: {unit: m}, v: {unit: m/s}}
inputs: {F: {unit: N}}
outputs:
  x: {unit: m}
  acc: {unit: m/s^2, expression: a}
parameters:
  m: {value: 2, unit: kg}
  d: {value: 1.5, unit: N s/m, identify: true, bounds: [0.1, 10]}
ports: {rail: {effort: F_x, unit: N, position: x, velocity: v}}
signals: {a: (F - d*v - F_x)/m}
dynamics: {x: v, v: a}
"""
FRICTION, DRAG, PERIOD, LAG = 1.2, 2.0, 0.005, 0.02


def recorded(folder: Path, seed: int) -> pd.DataFrame:
    """A cart with dry friction; its accelerometer is filtered."""
    random, n = np.random.default_rng(seed), 600
    t = PERIOD * np.arange(n)
    u = sum(4.0 * np.sin(rate * t + phase) for rate, phase in random.uniform((2, 0), (12, 6), (3, 2)))
    x, v, shown, rows = 0.0, 0.0, 0.0, []
    for k in range(n):
        a = (u[k] - DRAG * v - FRICTION * np.tanh(v / 1e-3)) / 2.0
        shown = a if k == 0 else shown
        rows.append((x, shown))
        for _ in range(20):
            a = (u[k] - DRAG * v - FRICTION * np.tanh(v / 1e-3)) / 2.0
            shown += PERIOD / 20 * (a - shown) / LAG
            v += PERIOD / 20 * a
            x += PERIOD / 20 * v
    noise = random.normal(0.0, (1e-5, 0.02), (n, 2))
    columns = np.array(rows) + noise
    return pd.DataFrame({"t": t, "F": u, "x": columns[:, 0], "acc": columns[:, 1]})


def test_an_accelerometer_alone_has_a_linear_system(tmp_path: Path) -> None:
    """No output shows a state: no start is measured, and hidden states start with the experiments."""
    runs = [recorded(tmp_path, seed)[["t", "F", "acc"]] for seed in range(4)]
    known = system_of(CART.replace("  x: {unit: m}\n", ""), tmp_path)
    logs = several(known, logs_of(known, tmp_path / "logs", runs))
    base = fitted(Hypothesis.known(Study.of(known, logs, 0.3, 0)))
    columns = Columns(FreeRun.of(base, base.recording))
    assert columns.starts.shape[3] == 0 and len(columns.own.prior) == 2
    chooser = Chooser(Equations.of(columns), columns.path.gap)
    assert ("sensor_lag", "sensor:acc") in [next(iter(s.names))[:2] for s in chooser.singles[:5]]


@pytest.mark.long
def test_friction_behind_a_filtered_accelerometer(tmp_path: Path) -> None:
    logs = write_runs(tmp_path / "logs", [recorded(tmp_path, seed) for seed in range(6)])
    system = CART.replace("F: {unit: N}", "F: {unit: N, hold: true}")
    answer = diagnosed(tmp_path, system, logs)
    found = {(e.family, e.port): [n["value"] for n in e.parameters.values()] for e in answer.effects}
    assert found[("coulomb_friction", "rail")][0] == pytest.approx(FRICTION, rel=0.05)
    assert found[("sensor_lag", "sensor:acc")][0] == pytest.approx(LAG, rel=0.05)
    again = unmodelled.read_logs(logs, answer.system)
    assert unmodelled.simulate(answer.system, again).value < 0.05
