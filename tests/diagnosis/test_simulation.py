"""Free runs by the register machine next to those of the compiled engine."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.diagnosis.benches import FRICTION, PERIOD, Bench, pendulum
from tests.evaluation.compiled_free_run import free_run
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.engine.compiled.backend import Generated
from unmodelled.engine.free_run import Integration
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import System, symbol

MEMORY = (
    ("  omega: {unit: rad/s}\n", "  omega: {unit: rad/s}\n  z: {unit: rad, initial: 0.02}\n"),
    ("  omega: (torque", "  z: omega*(1 - z/0.01*sign(omega))\n  omega: (torque - stiff*z"),
    ("ports:", "  stiff: {value: 2.0, unit: N m/rad}\nports:"),
)
LONG = Bench(samples=300)


def assert_equal(
    system: System, logs: Logs, horizon: float, runs: list[int], each: Sequence[int] = (1, 3)
) -> None:
    own, recording = prepare(system, logs), Recording.of(logs, horizon, runs)
    simulation = Simulation(system, recording)
    for substeps in each:
        expected = free_run(system, own, horizon, Integration(logs.period, "rk4", substeps, 1.0), runs)
        found = simulation(simulation.values[None, None], substeps=substeps)
        measured, simulated = (np.full(logs.y.shape, np.nan) for _ in range(2))
        rows = recording.rows[recording.counted]
        simulated[rows] = found.y[:, 0][recording.counted]
        measured[rows] = found.measured[:, 0][recording.counted]
        np.testing.assert_array_equal(np.isfinite(simulated), expected.counted)
        difference = np.abs(simulated - expected.y)[expected.counted]
        assert difference.max() < 1e-11 * np.abs(logs.y).max()
        np.testing.assert_array_equal(measured[expected.counted], logs.y[expected.counted])


def with_delay(system: System, delay: float) -> System:
    return replace(system, outputs=(replace(system.outputs[0], delay=delay),))


@pytest.mark.parametrize("horizon", [0.033, 0.1, 10.0])
def test_measured_and_hidden_states(tmp_path: Path, horizon: float) -> None:
    """Presliding friction has a state that no output shows, and that depends on all that was before."""
    known, logs = LONG.recorded(tmp_path, *FRICTION)
    assert_equal(known, logs, horizon, [0, 1, 2, 3])
    assert_equal(known, logs, horizon, [2])
    # the logs have its states at four steps per sample
    assert_equal(pendulum(tmp_path / "memory", *MEMORY), logs, horizon, [1, 3], each=[4])


@pytest.mark.parametrize("late", [0.0, 0.0053])
def test_the_generated_kernel_simulates_what_the_register_machine_does(tmp_path: Path, late: float) -> None:
    """For several sets of numbers, one of them with another input, that differ between experiments too."""
    system = pendulum(tmp_path, *FRICTION).with_values({"F_c": 0.05})
    system = with_delay(system, late)
    logs = LONG.logs(tmp_path / "logs", system)
    recording = Recording.of(logs, 0.033, [0, 1, 3], latest=0.006)
    machine = Simulation(system, recording, {"held": "torque"})
    kernel = Simulation(system, recording, {"held": "torque"}, backend=Generated.of)
    values = np.tile(machine.values, (len(logs), 2, 1))
    values[:, 1, -1] = 0.4 * PERIOD
    values[1:, :, machine.names.index("F_c")] = 0.08
    expected, found = machine(values, substeps=2), kernel(values, substeps=2)
    assert np.nanmax(np.abs(expected.y[:, 1] - expected.y[:, 0])) > 1e-4
    assert_allclose(found.y, expected.y, rtol=0, atol=1e-11)
    assert_allclose(found.first, expected.first, rtol=0, atol=1e-11)
    np.testing.assert_array_equal(kernel.over(recording.thinned(5))(values).y.shape[:2], (5, 2))


def test_hidden_states_of_sets_that_differ_in_one_number(tmp_path: Path) -> None:
    """Together they are as each of them alone: whether the hidden state depends on the number or not."""
    play = (
        ("omega*(1 - z/0.01*sign(omega))", "omega*(1 - z/play*sign(omega))"),
        ("ports:", "  play: {value: 0.01, unit: rad}\nports:"),
    )
    known = pendulum(tmp_path, *MEMORY, *play)
    _, logs = LONG.recorded(tmp_path / "known")
    recording = Recording.of(logs, 0.1)
    simulation = Simulation(known, recording, {"held": "torque"})
    changes = {"stiff": 2.5, "play": 0.008, "held": 0.4 * PERIOD}
    values = np.tile(simulation.values, (1, 2 + len(changes), 1))
    for k, (name, value) in enumerate(changes.items()):
        values[0, k, simulation.names.index(name)] = value
    moved = np.zeros((len(recording.start), values.shape[1], 2))
    moved[:, -1] = 1e-3, 1e-2
    together = simulation(values, moved).y
    assert len(np.unique(together[-1, :, 0, 0])) == values.shape[1]
    for k in range(values.shape[1]):
        alone = simulation(values[:, k : k + 1], moved[:, k : k + 1]).y
        np.testing.assert_array_equal(together[:, k], alone[:, 0])


@pytest.mark.parametrize(("tau", "forgets"), [(0.01, True), (5.0, False)])
def test_hidden_states_are_integrated_as_far_back_as_they_remember(
    tmp_path: Path, tau: float, forgets: bool
) -> None:
    """A lag forgets within a window how it started, a store does not."""
    lag = ("z: omega*(1 - z/0.01*sign(omega))", f"z: (theta - z)/{tau}")
    known = pendulum(tmp_path, *MEMORY, lag)
    _, logs = LONG.recorded(tmp_path / "known")
    recording = Recording.of(logs, 0.1)
    simulation = Simulation(known, recording, {"held": "torque"})
    values = np.tile(simulation.values, (1, 3, 1))
    values[0, 1:, simulation.names.index("stiff")] = 2.5, 3.0
    values[0, 2, simulation.names.index("held")] = 0.4 * PERIOD
    short = simulation.forgetting(values[:, :1])
    assert (short.memory is not None, short.forgets_before(simulation)) == (forgets, forgets)
    whole, found = simulation(values).y, short(values).y
    few = recording.thinned(5)
    off = 1e-3 * float(np.nanstd(whole))
    assert_allclose(short.over(few)(values).y, simulation.over(few)(values).y, rtol=0, atol=off)
    assert_allclose(found, whole, rtol=0, atol=off)
    assert forgets or np.array_equal(found, whole, equal_nan=True)


@pytest.mark.parametrize("name", ["theta", "torque"])
def test_a_delay_among_the_numbers(tmp_path: Path, name: str) -> None:
    """Is the same as one in the file; every set has its own."""
    known, logs = LONG.recorded(tmp_path)
    recording = Recording.of(logs, 0.1, latest=0.02)
    simulation = Simulation(known, recording, {"lag": name})
    lags = [0.0, 0.004, 0.0071, 0.004]
    values = np.tile(simulation.values, (1, len(lags), 1))
    values[0, :, -1] = lags
    together = simulation(values)
    for k, lag in enumerate(lags):
        alone = simulation(values[:, k : k + 1])
        np.testing.assert_array_equal(together.y[:, k], alone.y[:, 0])
        if name == "theta":
            own = Simulation(with_delay(known, lag), recording)
            expected = own(own.values[None, None])
            np.testing.assert_array_equal(together.y[:, k], expected.y[:, 0])
            np.testing.assert_array_equal(together.measured[:, k], expected.measured[:, 0])
    np.testing.assert_array_equal(together.y[:, 1], together.y[:, 3])
    assert np.nanmax(np.abs(together.y[:, 1] - together.y[:, 0])) > 1e-3
    with pytest.raises(ValueError, match="delays must be from 0 to 10 samples"):
        Simulation(with_delay(known, 0.021), recording)(np.array(known.values)[None, None])


def test_a_gain_among_the_numbers_moves_the_start(tmp_path: Path) -> None:
    system = pendulum(tmp_path)
    gain, offset, theta = symbol("gain"), symbol("offset"), symbol("theta")
    numbers = {"gain": 1.0, "offset": 0.0}
    more = [replace(system.parameters[0], name=name, value=value) for name, value in numbers.items()]
    output = replace(system.outputs[0], expression=gain * theta + offset)
    wide = replace(system, parameters=(*system.parameters, *more), outputs=(output,))
    logs = LONG.logs(tmp_path / "logs", system)
    simulation = Simulation(wide, Recording.of(logs, 0.1))
    values = np.tile(simulation.values, (1, 2, 1))
    values[0, 1, -2:] = 1.25, 0.1
    found = simulation(values)
    for k, (a, b) in enumerate(values[0, :, -2:]):
        read = wide.with_values({"gain": a, "offset": b})
        expected = free_run(read, prepare(read, logs), 0.1, Integration(logs.period, "rk4", 1, 1.0)).y[:, 0]
        recording = simulation.recording
        rows = recording.rows[recording.counted]
        assert_allclose(found.y[:, k, :, 0][recording.counted], expected[rows], atol=1e-9)


def test_thinned_windows_are_some_of_them(tmp_path: Path) -> None:
    system = pendulum(tmp_path)
    recording = Recording.of(Bench().logs(tmp_path / "logs", system), 0.02)
    some = recording.thinned(20)
    assert 10 <= len(some.start) <= 20 and set(some.owner) == {0, 1, 2, 3}
    simulations = [Simulation(system, r) for r in (recording, some)]
    every, few = (s(s.values[None, None]).y for s in simulations)
    where = [int(np.flatnonzero(recording.start == first)[0]) for first in some.start]
    np.testing.assert_array_equal(every[where], few)


def test_an_experiment_shorter_than_a_delay_is_refused(tmp_path: Path) -> None:
    _, logs = Bench(samples=60).recorded(tmp_path)
    with pytest.raises(ValueError, match="shorter than experiment run0"):
        Recording.of(logs, 0.1, latest=59 * PERIOD)
