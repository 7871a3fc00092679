"""An output that depends on what the model leaves out: an accelerometer, and the torque in a foot."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

import unmodelled
from tests.diagnosis.studies import fitted
from tests.machines.folders import diagnosed, logs_of, motion, system_of, text_of, values_of, write_runs
from unmodelled.diagnosis.core.choose import Chooser
from unmodelled.diagnosis.core.columns import Columns
from unmodelled.diagnosis.core.equations import Equations
from unmodelled.diagnosis.core.path import Path as FreeRun
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import Hypothesis
from unmodelled.logs.preparation import several

FRICTION, LAG = 1.2, 0.02


def rates(x: NDArray[np.float64], u: NDArray[np.float64]) -> list[float]:
    """Of position, speed and filtered acceleration of a cart with dry friction."""
    a = (u - 2.0 * x[1] - FRICTION * np.tanh(x[1] / 1e-3)) / 2.0
    return [x[1], a, (a - x[2]) / LAG]


def run(seed: int) -> pd.DataFrame:
    random, t = np.random.default_rng(seed), 0.005 * np.arange(600)
    u = sum(4.0 * np.sin(rate * t + phase) for rate, phase in random.uniform((2, 0), (12, 6), (3, 2)))
    path = motion(rates, [0.0, 0.0, u[0] / 2.0], u, 0.005, substeps=10, held=True)
    columns = path[:, [0, 2]] + random.normal(0.0, (1e-5, 0.02), (len(t), 2))
    return pd.DataFrame({"t": t, "F": u, "x": columns[:, 0], "acc": columns[:, 1]})


def test_an_accelerometer_alone_has_a_linear_system(tmp_path: Path) -> None:
    """No output shows a state: no start is measured, and hidden states start with the experiments."""
    runs = [run(seed)[["t", "F", "acc"]] for seed in range(4)]
    known = system_of(text_of("cart_with_accelerometer.yaml", ("  x: {unit: m}\n", "")), tmp_path)
    logs = several(known, logs_of(known, tmp_path / "logs", runs))
    base = fitted(Hypothesis.known(Study.of(known, logs, 0.3, 0)))
    columns = Columns(FreeRun.of(base, base.recording))
    assert columns.starts.shape[3] == 0 and len(columns.own.prior) == 2
    chooser = Chooser(Equations.of(columns), columns.path.gap)
    assert ("sensor_lag", "sensor:acc") in [next(iter(s.names))[:2] for s in chooser.singles[:5]]


@pytest.mark.long
def test_friction_behind_a_filtered_accelerometer(tmp_path: Path) -> None:
    logs = write_runs(tmp_path / "logs", [run(seed) for seed in range(6)])
    system = text_of("cart_with_accelerometer.yaml", ("F: {unit: N}", "F: {unit: N, hold: true}"))
    answer = diagnosed(tmp_path, system, logs)
    found = {(e.family, e.port): values_of(e) for e in answer.effects}
    assert found[("coulomb_friction", "rail")][0] == pytest.approx(FRICTION, rel=0.05)
    assert found[("sensor_lag", "sensor:acc")][0] == pytest.approx(LAG, rel=0.05)
    again = unmodelled.read_logs(logs, answer.system)
    assert unmodelled.simulate(answer.system, again).value < 0.05
