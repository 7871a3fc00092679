"""The gap is that of the contract, beside its floor, persistence and the default horizon."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.diagnosis.benches import FRICTION, Bench, exact, pendulum
from tests.diagnosis.conftest import Known
from tests.diagnosis.studies import HORIZON
from tests.evaluation.compiled_free_run import free_run
from tests.machines.folders import Array, logs_of, motion, system_of, text_of
from unmodelled.diagnosis.answer.diagnose import findings
from unmodelled.diagnosis.data.gap import LARGEST_ERROR, output_scale, steps_of
from unmodelled.diagnosis.data.persistence import FEWEST_SAMPLES, default_horizon, persistence
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.faults.look import log_faults
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


#: A sine's speed kept for this phase (rad) errs by its own standard deviation: |exp(ix) - 1 - ix| = 1.
SINE = 1.4566


def outputs(*runs: Array, period: float = 0.01) -> Logs:
    """Logs of outputs (samples,) or (samples, outputs), without inputs."""
    y = [run.reshape(len(run), -1) for run in runs]
    offsets = np.concatenate([[0], np.cumsum([len(run) for run in y])]).astype(np.int64)
    samples, names = int(offsets[-1]), tuple(f"y{j}" for j in range(y[0].shape[1]))
    ids = tuple(f"run{i}" for i in range(len(y)))
    t = period * np.concatenate([np.arange(len(run)) for run in y])
    none = {"u": np.empty((samples, 0)), "c": np.empty((len(y), 0)), "x": np.empty((samples, 0))}
    about = {"measured": (), "notes": (), "provenance": {"data": "virtual"}}
    table = pd.DataFrame({"id": ids})
    return Logs(names, (), (), (), ids, table, period, offsets, t=t, y=np.concatenate(y), **none, **about)


def sines(rate: float, samples: int = 2000, size: float = 1.0, level: float = 0.0) -> Logs:
    """Two runs of a sine, `rate` in rad per sample."""
    k = np.arange(samples)
    return outputs(*(level + size * np.sin(rate * k + phase) for phase in (0.3, 2.0)))


@settings(max_examples=20, deadline=None)
@given(rate=st.floats(0.01, 0.05), size=st.floats(1e-6, 1e6), level=st.floats(-1e3, 1e3))
def test_a_sine_is_predicted_for_a_known_phase(rate: float, size: float, level: float) -> None:
    logs = sines(rate, size=size, level=size * level)
    steps = default_horizon(logs) / logs.period
    assert steps == pytest.approx(SINE / rate, rel=0.08)  # candidates are 3 % apart, and two digits remain
    assert steps == pytest.approx(round(steps), abs=1e-6)


@pytest.mark.parametrize("period", [1e-6, 0.01, 50.0])
def test_the_unit_of_time_does_not_change_the_number_of_samples(period: float) -> None:
    logs = replace(sines(0.02), period=period)
    assert default_horizon(logs) / period == pytest.approx(73.0, abs=1.0)


def test_a_ramp_is_predicted_for_ever() -> None:
    k = np.arange(900.0)
    logs = outputs(0.2 + 0.001 * k, 3.0 - 0.002 * k)
    assert default_horizon(logs) == pytest.approx(3.0)  # a third of an experiment
    assert persistence(Recording.of(logs, 3.0)) < 1e-9


def test_a_constant_is_predicted_for_ever() -> None:
    logs = outputs(np.zeros((600, 2)), np.ones((900, 2)))
    assert default_horizon(logs) == pytest.approx(2.0)  # a third of the shortest
    assert persistence(Recording.of(logs, 2.0)) == 0.0


def test_noise_is_not_predicted_at_all() -> None:
    logs = outputs(np.random.default_rng(0).standard_normal(3000))
    assert default_horizon(logs) == pytest.approx(FEWEST_SAMPLES * logs.period)
    assert persistence(Recording.of(logs, 0.3)) == pytest.approx(np.sqrt(2.0), rel=0.1)


@pytest.mark.parametrize("samples", [50, 60, 76, 90])
def test_short_experiments_have_three_windows(samples: int) -> None:
    logs = outputs(np.random.default_rng(0).standard_normal(samples), np.zeros(200))
    assert steps_of(default_horizon(logs), logs) == min(25, samples // 3)


def test_one_short_part_does_not_set_the_horizon_of_all() -> None:
    """Its windows are whole; as much as a tenth of all samples does count."""
    ramp = 0.01 * np.arange(6000.0)
    long = [ramp[:2100], ramp[:2400], ramp[:2100]]
    alone, beside = default_horizon(outputs(*long)), default_horizon(outputs(ramp[:200], *long))
    assert alone == beside == pytest.approx(7.0)
    assert default_horizon(outputs(ramp[:600], ramp[:600], *long)) == pytest.approx(2.0)
    assert default_horizon(outputs(ramp[:1800], *5 * long)) == pytest.approx(6.0)  # another run, no part
    recording = Recording.of(outputs(ramp[:200], *long), beside)
    assert recording.steps[recording.owner == 0].tolist() == [199]
    assert (recording.steps[recording.owner == 1] == 700)[:2].all()
    many = Recording.of(outputs(*long, ramp[:200], *long, ramp[:200]), 1.0).thinned(20)
    assert set(many.owner.tolist()) == set(range(8))


@settings(max_examples=20, deadline=None)
@given(period=st.floats(1e-4, 10.0), rate=st.floats(0.005, 0.1))
def test_a_default_horizon_is_a_tidy_number_of_samples(period: float, rate: float) -> None:
    logs = replace(sines(rate), period=period)
    seconds = default_horizon(logs)
    steps = round(seconds / period)
    assert seconds == pytest.approx(steps * period, rel=1e-9)
    assert 25 <= steps <= 666
    tidy = float(f"{seconds:.2g}")  # two digits but for the rounding to samples, at both ends more
    assert steps in (25, 666) or abs(tidy - seconds) <= 0.51 * period


def test_many_samples_take_as_long_as_few() -> None:
    logs = sines(0.001, samples=200_000)
    assert default_horizon(logs) / logs.period == pytest.approx(SINE / 0.001, rel=0.08)


def test_persistence_is_the_gap_of_the_better_prediction() -> None:
    """Against loops: two outputs, one with spikes that are cut, the other best predicted by its speed."""
    rng, k = np.random.default_rng(1), np.arange(300)
    steps = np.repeat(rng.standard_normal(60), 5)
    steps[::37] += 80.0
    logs = outputs(np.stack([steps, np.sin(0.03 * k)], axis=1), np.stack([steps, np.cos(0.03 * k)], axis=1))
    recording = Recording.of(logs, 0.13)
    speed = np.stack([recording.sensors.slope(j, 0.0) for j in (0, 1)], axis=1)
    squares: list[list[Array]] = [[], []]
    for first, last in pairwise(logs.offsets.tolist()):
        for start in range(first, last - 1, 13):
            for row in range(start + 1, min(start + 13, last - 1) + 1):
                kept = logs.y[start], logs.y[start] + speed[start] * 0.01 * (row - start)
                for each, predicted in zip(squares, kept, strict=True):
                    error = np.abs(logs.y[row] - predicted) / output_scale(logs)
                    each.append(np.minimum(error, LARGEST_ERROR) ** 2)
    still, moving = (np.mean(each, axis=0) for each in squares)
    assert still[0] < moving[0] and moving[1] < still[1]
    assert persistence(recording) == pytest.approx(np.sqrt((still[0] + moving[1]) / 2.0), rel=1e-9)


def test_windows_of_some_experiments_count_alone() -> None:
    logs = outputs(np.sin(0.05 * np.arange(400)), np.zeros(400))
    both, still = (persistence(Recording.of(logs, 0.3, runs)) for runs in ([0, 1], [1]))
    assert still == 0.0 < both


def test_free_runs_worse_than_persistence_have_a_note(tmp_path: Path) -> None:
    wrong, logs = Bench().recorded(tmp_path, ("(torque", "(10*torque"))
    found = free_runs(wrong, logs, 0.2, [1, 2])
    assert found.persistence == persistence(Recording.of(logs, 0.2, [1, 2])) < found.value
    (note,) = (note for note in found.notes if "persistence" in note)
    assert f"({found.value:.3g} standard deviations)" in note and f"({found.persistence:.3g})" in note
    right = free_runs(pendulum(tmp_path), logs, 0.2)
    assert right.value < right.persistence and not any("persistence" in note for note in right.notes)


def test_a_time_in_milliseconds_is_found_with_the_default_horizon(tmp_path: Path) -> None:
    system, right = Bench(samples=300).recorded(tmp_path)
    logs = replace(right, period=1e3 * right.period, t=1e3 * right.t)
    horizon = default_horizon(logs)
    assert horizon == pytest.approx(1e3 * default_horizon(right))
    (fault,) = log_faults(system, logs, horizon)
    assert (fault.channels, fault.problem, fault.decides) == (("t",), "milliseconds", True)
    assert log_faults(system, right, default_horizon(right)) == ()


@pytest.mark.long
def test_a_diagnosis_has_the_default_horizon_unless_one_is_given(tmp_path: Path) -> None:
    system, logs = Bench(samples=300).recorded(tmp_path)
    usual = default_horizon(logs)
    assert usual != HORIZON
    for given_horizon, used in ((None, usual), (HORIZON, HORIZON)):
        content = findings(system, logs, given_horizon, workers=1).content
        gap, held = content["gap"], [logs.ids.index(name) for name in content["gap"]["held_out"]]
        assert gap["horizon"] == used
        recording = Recording.of(logs, used, held)
        assert gap["persistence"] == pytest.approx(persistence(recording), rel=1e-7)
