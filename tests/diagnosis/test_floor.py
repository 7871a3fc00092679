"""Models without fault lie at the floor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.benches import FRICTION, Bench, exact, pendulum
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.deviation import gap
from unmodelled.diagnosis.fitting.floor import floor, start_noise
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.diagnosis.fitting.simulation import Simulation


@pytest.mark.parametrize("bench", ["pendulum_bench", "slider_crank"])
@pytest.mark.parametrize("horizon", [0.02, 0.1])
def test_true_models_of_the_virtual_benches(
    bench: str, horizon: float, request: pytest.FixtureRequest
) -> None:
    system, logs = request.getfixturevalue(bench)
    simulation = Simulation(system, Recording.of(logs, horizon))
    values = simulation.values[None, None]
    found, least = gap(simulation, values, substeps=4), floor(simulation, values, substeps=4)
    assert 0.8 < found.value / least.value < 1.25
    assert least.value**2 == pytest.approx(np.mean(np.square(list(least.per_output.values()))))


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


def test_the_gap_is_that_of_every_verb(pendulum_bench, slider_crank) -> None:  # type: ignore[no-untyped-def]
    for system, logs in (pendulum_bench, slider_crank):
        wrong = system.with_values({"b": 0.03, "m3": 0.6})
        expected = free_runs(wrong, logs, 0.1, runs=[0, 2])
        simulation = Simulation(wrong, Recording.of(logs, 0.1, runs=[0, 2]))
        found = gap(simulation, simulation.values[None, None], expected.substeps)
        assert found.value == pytest.approx(expected.value, rel=1e-9)
        assert found.per_output == pytest.approx(expected.per_output, rel=1e-9)
        assert found.per_experiment == pytest.approx(expected.per_experiment, rel=1e-9)
