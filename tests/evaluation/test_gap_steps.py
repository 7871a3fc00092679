"""The steps of a gap are small enough; what diverges or has no value is a large error."""

import math
from pathlib import Path

import numpy as np
import pytest

from tests.evaluation.compiled_free_run import free_run
from tests.evaluation.gap_systems import PENDULUM, clock, drive, swing, truth
from tests.machines.folders import logs_of, system_of
from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.engine.free_run import Integration
from unmodelled.systems.reader import read_system

DECAY = """
schema: system/1
name: decay
states: {x: {unit: m}}
inputs: {u: {unit: m}}
outputs:
  x: {unit: m}
parameters: {k: {value: 1.0, unit: 1/s}}
dynamics: {x: k*(u - x)}
"""


@pytest.mark.parametrize("stiffness", [2.0, 2500.0, 10_000.0])
def test_steps_are_small_enough_also_for_stiff_systems(tmp_path: Path, stiffness: float) -> None:
    """The largest overflows at one and at two steps per sample, alike."""
    system = system_of(DECAY, tmp_path).with_values({"k": stiffness})
    t = clock(400, 0.002)
    u = drive(t, 0)
    slope, x, path = np.diff(u) / 0.002, 0.2, [0.2]
    for a, s in zip(u, slope, strict=False):  # exact between samples: x follows u with a lag
        x = a + s * (0.002 - 1.0 / stiffness) + (x - a + s / stiffness) * math.exp(-stiffness * 0.002)
        path.append(x)
    logs = logs_of(system, tmp_path / "logs", [{"t": t, "x": np.array(path), "u": u}])
    found = free_runs(system, logs, 0.5)
    assert found.value < 1e-6
    assert not found.notes
    assert (found.substeps == 1) == (stiffness == 2.0)


@pytest.mark.long
def test_more_substeps_change_less_than_a_tenth_of_the_floor(tmp_path: Path) -> None:
    system, t = read_system(PENDULUM), clock(400, 0.04)
    u = drive(t, 0)
    theta = truth(swing(), t, u, [0.3, 0.0])[:, 0] + 1e-4 * np.random.default_rng(0).standard_normal(400)
    logs = logs_of(system, tmp_path, [{"t": t, "theta": theta, "torque": u}])
    found = free_runs(system, logs, 0.5)
    assert found.substeps > 1
    fine = free_run(system, logs, 0.5, Integration(logs.period, "rk4", 64, 1.0))
    difference = (found.run.y - fine.y)[found.run.counted[:, 0]] / np.std(logs.y)
    assert np.sqrt(np.mean(difference**2)) < 0.1 * found.floor


def test_a_diverging_system_has_a_bounded_gap(tmp_path: Path) -> None:
    text = DECAY.replace("unit: 1/s", "unit: 1/(m^2 s)").replace("k*(u - x)", "k*x**3")
    text = text.replace("\nparameters", "\n  s: {unit: m, expression: 'where(x > 1, 1, 0)'}\nparameters")
    system = system_of(text.replace("unit: 1/(m^2 s)", "unit: ''").replace("unit: m", "unit: ''"), tmp_path)
    system = system.with_values({"k": 60.0})
    t = clock(200, 0.002)
    x = 1.0 + 0.3 * np.sin(9.0 * t)
    log = {"t": t, "x": x, "s": np.where(x > 1.0, 1.0, 0.0), "u": drive(t, 0)}
    found = free_runs(system, logs_of(system, tmp_path / "logs", [log]), 0.1)
    assert found.per_output["s"] > 5.0
    assert 5.0 < found.value <= LARGEST_ERROR
    assert np.isfinite(found.run.y).all()
    assert any(note.startswith("x: ") and "diverged" in note for note in found.notes)
    # no step is fine enough where a window diverges at any step
    assert not any("has not converged" in note for note in found.notes)


def test_an_output_without_a_value_counts_as_a_large_error(tmp_path: Path) -> None:
    text = DECAY.replace(
        "  x: {unit: m}\nparameters", "  x: {unit: m}\n  r: {unit: m^0.5, expression: sqrt(x)}\nparameters"
    )
    system = system_of(text, tmp_path)
    t = clock(200, 0.002)
    x = 0.01 * np.cos(2.0 * t)
    logs = logs_of(
        system, tmp_path / "logs", [{"t": t, "x": x, "r": np.sqrt(np.abs(x)), "u": -50.0 + 0.0 * t}]
    )
    found = free_runs(system, logs, 0.1)
    assert 0.0 < found.per_output["r"] <= LARGEST_ERROR
    assert any(note.startswith("r: ") for note in found.notes)
