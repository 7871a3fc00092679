"""The gap compares late sensors with the past; its steps are small enough; what diverges is a large error."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.evaluation.compiled_free_run import free_run
from tests.evaluation.gap_systems import PENDULUM, SLED, clock, drive, pendulum_logs, sled_logs, swing, truth
from tests.machines.folders import logs_of, system_of
from unmodelled.base.errors import BadInput
from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.engine.free_run import Integration
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system


def delayed(delay: float, folder: Path, friction: float = 0.0) -> tuple[System, Logs]:
    """The pendulum with a late angle sensor and a speed sensor that is not."""
    text = PENDULUM.read_text().replace(
        "  theta: {unit: rad}\nparameters",
        f"  theta: {{unit: rad, delay: {delay}}}\n  omega: {{unit: rad/s}}\nparameters",
    )
    system = system_of(text, folder)
    n, h = 500, 0.002
    late = round(delay / h * 4)  # quarters of samples
    t = np.arange(4 * n) * h / 4
    x = truth(swing(friction), t, drive(t, 0), [0.3, 0.0])
    samples = np.arange(4 * 100, 4 * n, 4)
    columns = {"theta": x[samples - late, 0], "omega": x[samples, 1], "torque": drive(t, 0)[samples]}
    return system, logs_of(system, folder / "logs", [{"t": clock(n - 100), **columns}])


@pytest.mark.long
@pytest.mark.parametrize("delay", [0.0, 0.02, 0.0205, 0.0015, 0.15])
def test_a_late_sensor_is_compared_with_the_past(tmp_path: Path, delay: float) -> None:
    system, logs = delayed(delay, tmp_path)
    found = free_runs(system, logs, 0.1)
    assert found.value < 1e-4
    whole = math.floor(delay / 0.002 + 1e-6)
    nothing = np.isnan(found.run.y)
    assert nothing[:, 0].sum() == nothing[:, 0][: whole + 1].sum() == (whole + 1 if delay else 0)
    assert nothing[:, 1].sum() == nothing[:, 1][400 - whole :].sum() == whole
    if delay:
        prompt = replace(system, outputs=tuple(replace(o, delay=0.0) for o in system.outputs))
        assert free_runs(prompt, prepare(prompt, logs), 0.1).value > 1e-3


@pytest.mark.long
def test_a_delay_hides_no_gap(tmp_path: Path) -> None:
    """Not even a delay longer than the horizon."""
    gaps = []
    for delay in (0.0, 0.02, 0.15):
        (tmp_path / str(delay)).mkdir()
        system, logs = delayed(delay, tmp_path / str(delay), friction=0.1)
        gaps.append(free_runs(system, logs, 0.1).per_output["theta"])
    assert gaps[0] > 0.01
    assert gaps[1:] == pytest.approx([gaps[0]] * 2, rel=0.3)


@pytest.mark.parametrize(
    ("horizon", "share"), [(0.01, 1 / 8), (0.02, 1 / (9 * math.sqrt(3))), (0.03, 1 / 24), (0.5, 1 / 24)]
)
def test_a_late_sensor_shows_the_input_of_then(tmp_path: Path, horizon: float, share: float) -> None:
    """Between samples an output is read by the polynomial through the nearest four of its window.

    The error of a polynomial through n samples that are h apart is at most share * h**n times the largest
    n-th derivative of the output. The shortest windows hold two or three samples only; 96 steps are whole
    windows of each of them.
    """
    late = "  a: {unit: m/s^2, expression: F/m + 0*v, delay: 0.043}\nparameters:"
    system = system_of(SLED.replace("\nparameters:", "\n" + late), tmp_path)
    one = sled_logs(system_of(SLED, tmp_path), tmp_path / "one", 0.0, (101,))
    then = (4.0 + 3.0 * np.cos(4.0 * (one.t - 0.043))) / 2.0
    log = {"t": one.t, "v": one.y[:, 0], "a": then, "F": one.u[:, 0]}
    logs = logs_of(system, tmp_path / "two", [log])
    found, samples = free_runs(system, logs, horizon), min(round(horizon / 0.01) + 1, 4)
    assert found.per_output["a"] * found.scale["a"] < share * 0.01**samples * 1.5 * 4.0**samples
    assert found.per_output["v"] < 1e-10
    prompt = replace(system, outputs=tuple(replace(o, delay=0.0) for o in system.outputs))
    assert free_runs(prompt, logs, horizon).value > 0.05


def test_a_delay_as_long_as_an_experiment_is_refused(tmp_path: Path) -> None:
    logs = pendulum_logs(tmp_path)
    system = read_system(PENDULUM)
    late = replace(system, outputs=(replace(system.outputs[0], delay=0.7),))
    words = r"outputs.theta.delay: 0.7 s is too long for experiment run1 of 0.664"
    with pytest.raises(BadInput, match=words):
        free_runs(late, logs, 0.1)


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
    more = "\n  r: {unit: m^0.5, expression: sqrt(x)}\nparameters"
    system = system_of(DECAY.replace("\nparameters", more), tmp_path)
    t = clock(200, 0.002)
    x = 0.01 * np.cos(2.0 * t)
    log = {"t": t, "x": x, "r": np.sqrt(np.abs(x)), "u": -50.0 + 0.0 * t}
    logs = logs_of(system, tmp_path / "logs", [log])
    found = free_runs(system, logs, 0.1)
    assert 0.0 < found.per_output["r"] <= LARGEST_ERROR
    assert any(note.startswith("r: ") for note in found.notes)
