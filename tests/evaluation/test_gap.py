"""The gap between a system and measured experiments, against independent integrators and closed forms."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.evaluation import gap_systems
from tests.evaluation.gap_systems import SLED, Array, clock, drive, pendulum_logs, sled_logs, swing, truth
from tests.machines.folders import logs_of, system_of
from unmodelled.base.errors import BadInput
from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.logs.logs import Logs
from unmodelled.systems.reader import read_system

OSCILLATOR = """
schema: system/1
name: shaker
states: {x: {unit: m}, v: {unit: m/s}, i: {unit: A, initial: 0.4}}
inputs: {V: {unit: V}}
outputs: {x: {unit: m}}
operating_point: {m: {unit: kg}}
parameters:
  k: {value: 300, unit: N/m}
  d: {value: 1.5, unit: N s/m}
  R: {value: 2.0, unit: ohm}
  L: {value: 0.04, unit: H}
  K: {value: 4.0, unit: N/A}
dynamics:
  x: v
  v: (K*i - k*x - d*v)/m
  i: (V - R*i - K*v)/L
"""


def within(logs: Logs) -> float:
    """Standard deviation of the only output from the mean of its run."""
    runs = [logs.y[logs.rows(i), 0] for i in range(len(logs))]
    return float(np.sqrt(np.mean(np.concatenate([y - y.mean() for y in runs]) ** 2)))


def test_the_true_pendulum_has_no_gap(tmp_path: Path) -> None:
    logs = pendulum_logs(tmp_path)
    found = free_runs(read_system(gap_systems.PENDULUM), logs, 0.1)
    assert found.value < 1e-4
    assert found.floor < 1e-4
    assert set(found.per_experiment) == {"run0", "run1"}


def test_the_true_shaker_with_a_hidden_current_has_no_gap(tmp_path: Path) -> None:
    system = system_of(OSCILLATOR, tmp_path)
    experiments = []
    for i, m in enumerate((0.5, 0.8)):
        t, u = clock(500), 5.0 * drive(clock(500), i)

        def rate(t: float, x: Array, V: float, m: float = m) -> list[float]:
            force = 4.0 * x[2] - 300.0 * x[0] - 1.5 * x[1]
            return [x[1], force / m, (V - 2.0 * x[2] - 4.0 * x[1]) / 0.04]

        experiments.append({"t": t, "x": truth(rate, t, u, [0.01, 0.0, 0.4])[:, 0], "V": u})
    logs = logs_of(system, tmp_path / "logs", experiments, m=[0.5, 0.8])
    assert logs.measured == (True, True, False)
    assert free_runs(system, logs, 0.1).value < 1e-4


@settings(max_examples=15)
@given(
    horizon=st.sampled_from([0.001, 0.01, 0.07, 0.1, 0.5, 40.0]),
    lengths=st.lists(st.integers(50, 140), min_size=1, max_size=4).map(tuple),
    friction=st.floats(0.1, 2.0),
)
def test_missing_coulomb_friction_in_closed_form(
    tmp_path_factory: pytest.TempPathFactory, horizon: float, lengths: tuple[int, ...], friction: float
) -> None:
    """The speed's error grows by F_c h/m with every sample of a window."""
    folder = tmp_path_factory.mktemp("sled")
    system = system_of(SLED, folder)
    logs = sled_logs(system, folder / "logs", friction, lengths)
    found = free_runs(system, logs, horizon)
    steps = max(1, round(horizon / 0.01))
    scale = within(logs)
    errors = [friction / 2.0 * 0.01 * (np.arange(n - 1) % steps + 1) / scale for n in lengths]
    assert max(e.max() for e in errors) < LARGEST_ERROR
    assert found.value == pytest.approx(np.sqrt(np.mean(np.concatenate(errors) ** 2)), rel=1e-8)
    for name, error in zip(logs.ids, errors, strict=True):
        assert found.per_experiment[name] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-8)
    for i, n in enumerate(lengths):
        own = logs.rows(i)
        assert found.run.counted[own].sum() == n - 1 and not found.run.counted[own][0]
        assert found.run.window[own].max() == (n - 2) // steps


def test_a_law_in_the_file_closes_the_gap(tmp_path: Path) -> None:
    known = system_of(SLED, tmp_path)
    law = system_of(SLED.replace("velocity: v}", "velocity: v, law: 0.8*sign(v)}"), tmp_path)
    logs = sled_logs(known, tmp_path / "logs", 0.8, (100, 80))
    assert free_runs(known, logs, 0.1).value > 1e-3
    assert free_runs(law, logs, 0.1).value < 1e-10


def test_missing_friction_of_a_pendulum_against_another_integrator(tmp_path: Path) -> None:
    logs = pendulum_logs(tmp_path, friction=0.1)
    found = free_runs(read_system(gap_systems.PENDULUM), logs, 0.1)
    square = []
    for i in range(2):
        t, theta, u = logs.t[logs.rows(i)], logs.y[logs.rows(i), 0], logs.u[logs.rows(i), 0]
        states = truth(swing(0.1), t, u, [0.3, 0.0])
        for a in range(0, len(t) - 1, 50):
            part = slice(a, min(a + 51, len(t)))
            simulated = truth(swing(), t[part], u[part], states[a].tolist())[:, 0]
            square.append((simulated - theta[part])[1:] ** 2)
    expected = np.sqrt(np.mean(np.concatenate(square))) / within(logs)
    assert found.value == pytest.approx(expected, rel=2e-3)
    assert found.value > 0.01


@pytest.mark.parametrize("sigma", [3e-4, 3e-3])
def test_noise_leaves_about_the_floor(tmp_path: Path, sigma: float) -> None:
    logs = pendulum_logs(tmp_path, sigma=sigma, lengths=(800, 700, 600))
    found = free_runs(read_system(gap_systems.PENDULUM), logs, 0.1)
    assert found.floor > sigma / within(logs)  # the noise of the states at the starts comes on top
    assert 0.8 < found.value / found.floor < 1.25


def test_a_long_horizon_is_the_whole_experiment(tmp_path: Path) -> None:
    system = system_of(SLED, tmp_path)
    logs = sled_logs(system, tmp_path / "logs", 0.5, (100, 80))
    exact, longer = free_runs(system, logs, 0.99), free_runs(system, logs, 1e300)
    assert longer.value == exact.value
    assert not longer.run.window.any()
    assert any("each is simulated as a whole" in note for note in longer.notes)
    assert exact.notes == ("run1 is shorter than the horizon of 0.99 s: simulated as a whole",)


@pytest.mark.parametrize(("horizon", "words"), [(0.001, "1 of 0.01 s"), (0.024, "2 of 0.01 s")])
def test_a_horizon_between_samples_is_rounded(tmp_path: Path, horizon: float, words: str) -> None:
    system = system_of(SLED, tmp_path)
    found = free_runs(system, sled_logs(system, tmp_path / "logs", 0.5, (100,)), horizon)
    assert words in found.notes[0]


@pytest.mark.parametrize("horizon", [0.0, -1.0, math.nan, math.inf, "soon", True, None])
def test_a_horizon_that_is_none(tmp_path: Path, horizon: float) -> None:
    system = system_of(SLED, tmp_path)
    logs = sled_logs(system, tmp_path / "logs", 0.5, (100,))
    with pytest.raises(BadInput, match=r"^horizon: must be a positive number of seconds, got"):
        free_runs(system, logs, horizon)


def test_some_experiments_are_as_if_there_were_no_others(tmp_path: Path) -> None:
    system = system_of(SLED, tmp_path)
    all_logs = sled_logs(system, tmp_path / "all", 0.5, (100, 60, 80))
    some = free_runs(system, all_logs, 0.1, runs=[1])
    alone = free_runs(system, sled_logs(system, tmp_path / "alone", 0.5, (60,)), 0.1)
    ratio = alone.scale["v"] / some.scale["v"]  # the scale is that of all experiments
    assert ratio != pytest.approx(1.0, rel=1e-3)
    assert some.value == pytest.approx(ratio * alone.value, rel=1e-12)
    assert some.units["v"].at_horizon == pytest.approx(alone.units["v"].at_horizon, rel=1e-12)
    assert some.scale == free_runs(system, all_logs, 0.1).scale
    assert list(some.per_experiment) == ["run1"]
    assert np.isnan(some.run.y[all_logs.rows(0)]).sum() == 99 + 1


def test_outputs_weigh_the_same(tmp_path: Path) -> None:
    """The second output shows the speed in another unit."""
    second = "\n  p: {unit: kg m/s, expression: 100*m*v, column: v2}\nparameters:"
    system = system_of(SLED.replace("\nparameters:", second), tmp_path)
    plain = system_of(SLED, tmp_path)
    one = sled_logs(plain, tmp_path / "logs", 0.5, (100,))
    log = {"t": one.t, "v": one.y[:, 0], "v2": 200.0 * one.y[:, 0], "F": one.u[:, 0]}
    found = free_runs(system, logs_of(system, tmp_path / "two", [log]), 0.1)
    assert found.per_output["p"] == pytest.approx(found.per_output["v"])
    assert found.value == pytest.approx(free_runs(plain, one, 0.1).value)


def test_logs_of_other_states_are_a_mistake(tmp_path: Path) -> None:
    logs = pendulum_logs(tmp_path)
    with pytest.raises(ValueError, match="must have the states of sled"):
        free_runs(system_of(SLED, tmp_path), logs, 0.1)
