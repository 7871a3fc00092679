"""The gap on the expression machine is the gap of the contract, which compiled models compute."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.diagnosis.free_runs import free_runs
from pipeline.evaluation.gap import LARGEST_ERROR, gap
from pipeline.measurements.logs import Logs
from pipeline.physics.system.model import System
from tests.diagnosis.benches import FRICTION, Bench, pendulum
from tests.diagnosis.conftest import Known
from tests.diagnosis.studies import HORIZON

RUNS = (0, 2)


def late(delay: float) -> tuple[str, str]:
    """An output with a known delay."""
    return "  theta: {unit: rad}\nparameters:", f"  theta: {{unit: rad, delay: {delay}}}\nparameters:"


def logged(folder: Path, *changes: tuple[str, str]) -> Known:
    system = pendulum(folder, *FRICTION, *changes).with_values({"F_c": 0.05, "mgl": 1.1})
    return system, Bench(samples=260).logs(folder / "logs", system)


def same(system: System, logs: Logs, horizon: float = HORIZON) -> None:
    expected, found = (each(system, logs, horizon, RUNS) for each in (gap, free_runs))
    assert found.value == pytest.approx(expected.value, rel=1e-6) and found.value > 0.0
    assert found.per_experiment == pytest.approx(expected.per_experiment, rel=1e-6)
    assert found.per_output == pytest.approx(expected.per_output, rel=1e-6)
    assert found.scale == pytest.approx(expected.scale) and found.substeps == expected.substeps
    assert found.floor == pytest.approx(expected.floor)
    counted = expected.run.counted
    np.testing.assert_array_equal(found.run.counted, counted)
    scale = np.array(list(expected.scale.values()))
    np.testing.assert_allclose((found.run.y / scale)[counted], (expected.run.y / scale)[counted], atol=1e-6)
    rows = counted.any(axis=1)
    np.testing.assert_array_equal(found.run.window[rows], expected.run.window[rows])


def test_without_delay(tmp_path: Path) -> None:
    same(*logged(tmp_path))


@pytest.mark.parametrize("delay", [0.006, 0.0073])
def test_with_a_delay_of_the_output(tmp_path: Path, delay: float) -> None:
    same(*logged(tmp_path, late(delay)))


def test_with_a_delay_of_the_input(tmp_path: Path) -> None:
    same(*logged(tmp_path, ("  torque: {unit: N m}", "  torque: {unit: N m, delay: 0.0031}")))


@pytest.mark.parametrize("horizon", [0.013, 10.0])
def test_short_windows_and_experiments_as_a_whole(tmp_path: Path, horizon: float) -> None:
    same(*logged(tmp_path), horizon)


def test_of_a_bench_with_two_outputs(slider_crank: Known) -> None:
    system, logs = slider_crank
    assert len(system.outputs) > 1
    same(system, logs, 0.05)
    first, *others = system.outputs
    slow = replace(system, outputs=(replace(first, delay=2.8 * logs.period), *others))
    same(slow, logs.for_system(slow), 0.05)


def test_what_diverges_counts_as_the_largest_error(tmp_path: Path) -> None:
    change = ("mgl*sin(theta)", "mgl*sin(theta) - grow*omega**3")
    number = ("ports:", "  grow: {value: -20.0, unit: N m s^3/rad^3}\nports:")
    system, logs = logged(tmp_path, change, number)
    found = free_runs(system, logs, HORIZON, RUNS)
    expected = gap(system, logs, HORIZON, RUNS)
    assert np.isfinite(found.run.y[found.run.counted]).all()
    error = np.abs(found.run.y - logs.y)[found.run.counted] / found.scale["theta"]
    assert error.max() == pytest.approx(LARGEST_ERROR) and np.mean(error > 0.999 * LARGEST_ERROR) > 0.1
    # how a state grows beyond all bounds depends on the last digit
    assert found.value == pytest.approx(expected.value, rel=1e-2)


def test_only_the_asked_experiments_are_simulated(tmp_path: Path) -> None:
    system, logs = logged(tmp_path)
    found = free_runs(system, logs, HORIZON, (3,))
    assert list(found.per_experiment) == ["run3"]
    assert set(logs.owner[found.run.counted[:, 0]]) == {3}
    assert np.isnan(found.run.y[~found.run.counted]).all()
