"""Fits recover what was planted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

import unmodelled as um
from tests.diagnosis.benches import FRICTION, PERIOD, Bench, exact, integrated, pendulum
from tests.diagnosis.conftest import Known
from tests.diagnosis.unknowns import F_C, MGL, B, simulation_of
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.deviation import gap
from unmodelled.diagnosis.fitting.fit import Fit, fit_parameters
from unmodelled.diagnosis.fitting.floor import floor, start_noise
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.diagnosis.fitting.unknowns import Unknown
from unmodelled.logs.folder import read_logs

Array = NDArray[np.float64]
GAIN = (
    ("  theta: {unit: rad}\nparameters:", "  theta: {unit: rad, expression: theta + k*theta}\nparameters:"),
    ("ports:", "  k: {value: 0.0, unit: '1', identify: true, bounds: [-0.5, 0.5]}\nports:"),
)


def errors_of(found: Fit, truth: dict[str, float]) -> Array:
    """In standard deviations."""
    sigma = np.sqrt(np.diag(found.covariance))
    return np.array([(found.values[n] - truth[n]) / sigma[found.names.index(n)] for n in truth])


def rough(simulation: Simulation) -> float:
    """Noise of the sensors in standard deviations of the outputs."""
    recording = simulation.recording
    return float(np.sqrt(np.mean((recording.noise / recording.scale) ** 2)))


def test_a_pendulum_with_friction_and_wrong_parameters(tmp_path: Path) -> None:
    simulation = simulation_of(tmp_path, Bench())
    found = fit_parameters(simulation)
    assert found.converged and found.names == ("b", "mgl", "F_c")
    truth = Bench()
    planted = {"b": truth.b, "mgl": truth.mgl, "F_c": float(np.max(truth.friction))}
    assert np.abs(errors_of(found, planted)).max() < 4.0
    assert found.values == pytest.approx(planted, rel=0.03)
    assert 0.8 * rough(simulation) < found.left.value < 1.05 * rough(simulation)
    assert found.gap.value == gap(simulation, found.numbers, found.substeps).value
    assert found.gap.value < 1.3 * floor(simulation, found.numbers).value
    known = pendulum(tmp_path / "known")
    without = fit_parameters(Simulation(known, simulation.recording))
    assert without.converged and without.gap.value > 5.0 * found.gap.value
    assert np.std(found.start / start_noise(simulation, found.numbers)) < 1.2


def test_the_slider_crank_bench(slider_crank: Known) -> None:
    system, logs = slider_crank
    truth = {"m3": 0.77, "J1": 0.0034, "F_c": 3.0, "viscous": 4.0}
    wrong = system.with_values({"m3": 1.1, "J1": 0.005, "F_c": 0.0, "viscous": 1.0, "B_m": 0.007})
    simulation = Simulation(wrong, Recording.of(logs, 0.1))
    free = [Unknown.of(p) for p in system.parameters if p.name in truth]
    found = fit_parameters(simulation, free)
    assert found.converged
    assert found.values == pytest.approx(truth, rel=0.12)
    assert found.gap.value < 1.25 * floor(simulation, found.numbers, found.substeps).value
    assert found.left.per_output["theta"] < 0.2 * found.gap.per_output["theta"]


@pytest.mark.parametrize("seed", range(3))
def test_intervals_are_as_wide_as_they_say(tmp_path: Path, seed: int) -> None:
    """Over parameters and draws of the noise together."""
    bench = Bench(noise=1e-3, seed=seed, runs=6)
    found = fit_parameters(simulation_of(tmp_path, bench))
    off = errors_of(found, {"b": bench.b, "mgl": bench.mgl, "F_c": 0.06})
    assert 0.05 < np.sqrt(np.mean(off**2)) < 2.5


def test_spikes_and_a_run_gone_wrong_do_little_harm(tmp_path: Path) -> None:
    system = pendulum(tmp_path, *FRICTION)
    logs = Bench().logs(tmp_path / "logs", system)
    y = logs.y.copy()
    y[7::40] += 0.05
    found = fit_parameters(Simulation(system, Recording.of(replace(logs, y=y), 0.1)))
    assert found.values["mgl"] == pytest.approx(1.2, rel=0.02)
    assert found.values["F_c"] == pytest.approx(0.06, rel=0.25)


@pytest.mark.parametrize("name", ["theta", "torque"])
def test_a_delay(tmp_path: Path, name: str) -> None:
    system = pendulum(tmp_path, *FRICTION)
    logs = Bench(delay=5).logs(tmp_path / "logs", system)
    simulation = Simulation(system, Recording.of(logs, 0.1, latest=0.02), {"lag": name})
    found = fit_parameters(simulation, [B, MGL, F_C, Unknown("lag", 0.0, 0.02, 0.002)])
    assert found.converged
    assert found.values["lag"] == pytest.approx(5 * PERIOD, abs=2e-4)
    assert found.left.value < 1.1 * rough(simulation)


def test_a_gain_of_the_sensor(tmp_path: Path) -> None:
    simulation = simulation_of(tmp_path, Bench(gain=1.1), *GAIN)
    found = fit_parameters(simulation)
    assert found.values["k"] == pytest.approx(0.1, abs=3e-3)
    assert found.values["mgl"] == pytest.approx(1.2, rel=0.01)


def test_a_value_for_every_experiment(tmp_path: Path) -> None:
    planted = (0.02, 0.04, 0.06, 0.08)
    simulation = simulation_of(tmp_path, Bench(friction=planted))
    found = fit_parameters(simulation, [B, MGL, replace(F_C, own=True)])
    assert found.names[2:] == tuple(f"F_c@run{k}" for k in range(4))
    assert list(found.own["F_c"].values()) == pytest.approx(planted, abs=2e-3)
    sigma = np.sqrt(np.diag(found.covariance))[2:]
    assert (np.abs(np.array(list(found.own["F_c"].values())) - planted) < 4.0 * sigma).all()
    shared = fit_parameters(simulation, [B, MGL, F_C])
    assert shared.gap.value > 2.0 * found.gap.value


def test_some_runs_only(tmp_path: Path) -> None:
    system = pendulum(tmp_path, *FRICTION)
    logs = Bench(friction=(0.02, 0.04, 0.06, 0.08)).logs(tmp_path / "logs", system)
    found = fit_parameters(
        Simulation(system, Recording.of(logs, 0.1, runs=[3, 1])), [B, MGL, replace(F_C, own=True)]
    )
    assert found.own["F_c"] == pytest.approx({"run1": 0.04, "run3": 0.08}, abs=3e-3)
    assert set(found.gap.per_experiment) == {"run1", "run3"}


def test_the_best_of_several_starts_goes_on(tmp_path: Path) -> None:
    """A ripple whose number of periods is not known: its fit has a valley around every one."""
    law = ("F_c*tanh(omega/creep)", "F_c*tanh(omega/creep) + a*sin(n*theta)")
    number = ("ports:", "  a: {value: 0.0, unit: N m}\n  n: {value: 1.0, unit: '1'}\nports:")
    wide = exact(pendulum(tmp_path, *FRICTION, law, number))
    bench = Bench(ripple=0.1)
    recording = Recording.of(bench.logs(tmp_path / "logs", wide), 0.1)
    simulation = Simulation(wide, recording)
    free = [Unknown("a", -1.0, 1.0, 0.05), Unknown("n", 1.0, 30.0, 1.0)]
    starts = [{"n": float(n)} for n in (3, 7, 11, 15)]
    found = fit_parameters(simulation, free, starts)
    assert found.values == pytest.approx({"a": 0.1, "n": 12.0}, rel=0.05)
    lost = fit_parameters(simulation, free, starts[:1])
    assert lost.gap.value > 1.5 * found.gap.value


def test_states_that_no_output_shows(tmp_path: Path) -> None:
    """A spring behind a memory of its own; its stiffness is found through the memory."""
    memory = (
        ("  omega: {unit: rad/s}\n", "  omega: {unit: rad/s}\n  z: {unit: rad}\n"),
        ("  omega: (torque", "  z: (theta - z)/lag\n  omega: (torque - stiff*(theta - z)"),
        ("ports:", "  stiff: {value: 0.3, unit: N m/rad}\n  lag: {value: 0.1, unit: s}\nports:"),
    )
    system = exact(pendulum(tmp_path, *FRICTION, *memory))
    logs = Bench(memory=(0.5, 0.05)).logs(tmp_path / "logs", system)
    simulation = Simulation(system, Recording.of(logs, 0.1))
    assert simulation.hidden == [2]
    found = fit_parameters(simulation, [Unknown("stiff", 0.0, 5.0, 0.3), Unknown("lag", 0.01, 1.0, 0.1)])
    assert found.values == pytest.approx({"stiff": 0.5, "lag": 0.05}, rel=0.05)
    assert found.gap.value < 1.3 * floor(simulation, found.numbers).value


def test_what_data_do_not_tell_has_no_interval(tmp_path: Path) -> None:
    number = ("ports:", "  idle: {value: 1.0, unit: '1'}\nports:")
    simulation = simulation_of(tmp_path, Bench(), number)
    found = fit_parameters(simulation, [B, Unknown("idle", 0.0, 2.0, 1.0)])
    assert found.values["idle"] == 1.0
    assert np.isinf(found.covariance[1, 1]) and np.isfinite(found.covariance[0, 0])


def test_a_system_whose_sensor_shows_no_state_by_itself(tmp_path: Path) -> None:
    """All states are integrated from the start of the experiment, and there is no start to be corrected."""
    text = """
schema: system/1
name: lag
states:
  x: {unit: ''}
inputs:
  u: {unit: ''}
outputs:
  y: {unit: '', expression: x**2}
parameters:
  k: {value: 3.0, unit: 1/s, identify: true, bounds: [0.1, 50]}
dynamics:
  x: k*(u - x)
"""
    system = pendulum(tmp_path, text=text)
    t = PERIOD * np.arange(400)
    u = 1.0 + np.sin(9.0 * t)
    path = integrated(lambda x, drive: 8.0 * (drive - x), np.zeros((1, 1)), u[:, None])[:, 0, 0]
    y = path**2 + 1e-3 * np.random.default_rng(0).standard_normal(len(t))
    pd.DataFrame({"t": t, "u": u, "y": y}).to_csv(tmp_path / "run.csv", index=False)
    (tmp_path / "experiments.csv").write_text("id,file\nrun,run.csv\n")
    simulation = Simulation(system, Recording.of(read_logs(tmp_path, system), 0.1))
    found = fit_parameters(simulation)
    assert simulation.hidden == [0] and found.start.shape[1] == 0
    assert found.values["k"] == pytest.approx(8.0, rel=0.01)
    assert 0.9 < found.gap.value / floor(simulation, found.numbers).value < 1.1


def test_a_machine_without_inputs_and_without_unknowns(tmp_path: Path) -> None:
    """The initial states alone are fitted: a pendulum that swings freely, whose numbers are all trusted."""
    free = (
        ("inputs:\n  torque: {unit: N m}\n", ""),
        ("(torque - b*omega", "(-b*omega"),
        ("value: 0.03, unit: N m s/rad, identify: true, bounds: [0, 0.1]", "value: 0.015, unit: N m s/rad"),
        ("value: 0.9, unit: N m, identify: true, bounds: [0.2, 5]", "value: 1.2, unit: N m"),
    )
    system = pendulum(tmp_path, *free)
    driven = pendulum(tmp_path / "driven")
    logs = Bench(friction=0.0).logs(tmp_path / "logs", driven)
    still = {name: run.assign(torque=0.0) for name, run in logs.table().groupby("experiment")}
    simulation = Simulation(system, Recording.of(um.Logs.from_frames(still, system), 0.1))
    found = fit_parameters(simulation)
    assert found.converged and found.names == () and found.start.shape[1] == 2
