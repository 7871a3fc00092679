"""The gap is that of the contract, with free runs of the compiled engine; true models lie at the floor."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.benches import FRICTION, Bench, exact, pendulum
from tests.diagnosis.conftest import Known
from tests.diagnosis.studies import HORIZON
from tests.evaluation.compiled_free_run import free_run
from tests.machines.folders import logs_of, motion, system_of, text_of
from unmodelled.diagnosis.data.gap import output_scale
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.fitting.deviation import gap
from unmodelled.diagnosis.fitting.floor import floor, start_noise
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.engine.free_run import Integration
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import System

RUNS = (0, 2)


def logged(folder: Path, *changes: tuple[str, str]) -> Known:
    system = pendulum(folder, *FRICTION, *changes).with_values({"F_c": 0.05, "mgl": 1.1})
    return system, Bench(samples=260).logs(folder / "logs", system)


def same(system: System, logs: Logs, horizon: float = HORIZON) -> None:
    found = free_runs(system, logs, horizon, RUNS)
    how = Integration(logs.period, "rk4", found.substeps, 1.0)
    expected = free_run(system, logs, horizon, how, RUNS)
    counted, scale = expected.counted, output_scale(logs)
    np.testing.assert_array_equal(found.run.counted, counted)
    np.testing.assert_allclose((found.run.y / scale)[counted], (expected.y / scale)[counted], atol=1e-6)
    np.testing.assert_array_equal(found.run.window, expected.window)
    square = np.where(counted, ((expected.y - logs.y) / scale) ** 2, np.nan)
    per_output = np.sqrt(np.nanmean(square, axis=0))
    assert list(found.per_output.values()) == pytest.approx(per_output, rel=1e-6)
    assert found.value == pytest.approx(np.sqrt(np.mean(per_output**2)), rel=1e-6) and found.value > 0.0
    for i in RUNS:
        own = np.sqrt(np.mean(np.nanmean(square[logs.rows(i)], axis=0)))
        assert found.per_experiment[logs.ids[i]] == pytest.approx(own, rel=1e-6)
    whole = free_run(system, logs, 1e9, how, RUNS)
    for j, name in enumerate(logs.outputs):
        off = (whole.y - logs.y)[whole.counted[:, j], j]
        assert found.units[name].whole_run == pytest.approx(np.sqrt(np.mean(off**2)), rel=1e-6)


OUTPUT, INPUT = "  theta: {unit: rad%s}\nparameters:", "  torque: {unit: N m%s}"


@pytest.mark.parametrize(
    ("channel", "delay", "horizon"),
    [
        *((OUTPUT, 0.0, horizon) for horizon in (HORIZON, 0.013, 10.0)),  # short windows, whole experiments
        *((OUTPUT, 0.006, HORIZON), (OUTPUT, 0.0073, HORIZON), (INPUT, 0.0031, HORIZON)),
    ],
)
def test_with_and_without_delays(tmp_path: Path, channel: str, delay: float, horizon: float) -> None:
    same(*logged(tmp_path, (channel % "", channel % f", delay: {delay}")), horizon)


@pytest.mark.long
def test_of_a_bench_with_two_outputs(slider_crank: Known) -> None:
    system, logs = slider_crank
    assert len(system.outputs) > 1
    same(system, logs, 0.05)
    first, *others = system.outputs
    slow = replace(system, outputs=(replace(first, delay=2.8 * logs.period), *others))
    same(slow, prepare(slow, logs), 0.05)


def test_the_error_at_the_horizon_is_that_of_full_windows(tmp_path: Path) -> None:
    system, logs = logged(tmp_path)
    steps = 23  # a rest stays at the end of every experiment
    found = free_runs(system, logs, steps * logs.period, RUNS)
    ends = [logs.offsets[i] + np.arange(steps, 260, steps) for i in RUNS]
    off = (found.run.y - logs.y)[np.concatenate(ends), 0]
    assert found.units["theta"].at_horizon == pytest.approx(np.sqrt(np.mean(off**2)), rel=1e-9)
    assert found.units["theta"].unit == "rad"


@pytest.mark.parametrize("size", [1e-200, 1.0, 1e100])
def test_scales_of_tiny_and_of_constant_outputs(tmp_path: Path, size: float) -> None:
    _, logs = logged(tmp_path)
    np.testing.assert_allclose(output_scale(replace(logs, y=size * logs.y)), size * output_scale(logs))
    still = np.where(logs.owner == 1, 0.3, 0.1)[:, None] * size  # rounding does not count as motion
    assert output_scale(replace(logs, y=still)) == pytest.approx(0.3 * size)
    assert output_scale(replace(logs, y=0.0 * logs.y)) == 1.0
    assert np.isfinite(Sensors(replace(logs, y=still)).noise).all()


@pytest.mark.parametrize("noise", [5e-5, 1e-3])
def test_floor_of_a_sensor_whose_noise_is_known(tmp_path: Path, noise: float) -> None:
    system = exact(pendulum(tmp_path, *FRICTION))
    bench = Bench(noise=noise, runs=16, samples=800)
    recording = Recording.of(bench.logs(tmp_path / "logs", system), 0.1)
    assert recording.noise[0] == pytest.approx(noise, rel=0.1)
    simulation = Simulation(system, recording)
    values = simulation.values[None, None]
    assert 0.8 < gap(simulation, values).value / floor(simulation, values).value < 1.25
    sigma = start_noise(simulation, values)
    np.testing.assert_allclose(sigma[:, 0], recording.noise[0])
    first = np.isin(recording.start, recording.logs.offsets)
    # half of the filter is missing where an experiment begins
    assert sigma[first, 1].min() > 2.0 * np.median(sigma[~first, 1])


LAW = "(q - a*sqrt(G*(h - edge)))/A"


@pytest.mark.parametrize(
    ("law", "diverges"),
    [
        (LAW, True),
        ("(q - a*sqrt(G*abs(h - edge)) - e*log((h - edge)/edge))/A", True),
        ("(q - a*sqrt(G*(h - 0.1*edge)))/A", False),
    ],
)
def test_windows_without_a_value_take_no_finer_steps(tmp_path: Path, law: str, diverges: bool) -> None:
    """Levels of half of the runs lie below the edge, where the file has the root of a negative number."""
    rng, start = np.random.default_rng(2), 0.15 + 0.12 * np.arange(6)
    q = np.repeat(rng.uniform(0.02, 0.08, (8, 6)), 30, axis=0)
    rates = lambda h, q: (q - 0.02 * np.sqrt(19.62 * np.maximum(h - 0.05, 0.0))) / 0.5  # noqa: E731
    h = motion(rates, start, q, 0.5, held=True) + 1e-3 * rng.standard_normal(q.shape)
    tables = [{"t": 0.5 * np.arange(240), "q": q[:, k], "h": h[:, k]} for k in range(6)]
    system = system_of(text_of("rooted_tank.yaml", (LAW, law)), tmp_path)
    found = free_runs(system, logs_of(system, tmp_path / "logs", tables), horizon=20.0)
    assert any("diverged" in note for note in found.notes) is diverges
    assert found.substeps <= 8
    assert not any("has not converged" in note for note in found.notes)
