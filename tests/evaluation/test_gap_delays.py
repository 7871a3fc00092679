"""The gap of systems whose sensors are late: the past is compared, and no delay hides anything."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.evaluation.gap_systems import PENDULUM, SLED, clock, drive, pendulum_logs, sled_logs, swing, truth
from tests.machines.folders import logs_of, system_of
from unmodelled.base.errors import BadInput
from unmodelled.diagnosis.fitting.free_runs import free_runs
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
    with pytest.raises(
        BadInput, match=r"outputs.theta.delay: 0.7 s is too long for experiment run1 of 0.664"
    ):
        free_runs(late, logs, 0.1)
