"""The gap between a system and measured experiments, against independent integrators and closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from pipeline.errors import BadInput
from pipeline.evaluation.free_run import free_run
from pipeline.evaluation.gap import LARGEST_ERROR, gap, noise_floor
from pipeline.measurements.folder import read_logs
from pipeline.measurements.logs import Logs
from pipeline.models.nnap import Integration
from pipeline.physics.system.model import System
from pipeline.physics.system.reader import read_system

Array = NDArray[np.float64]
Rate = Callable[[float, Array, float], list[float]]

SYSTEMS = Path(__file__).parents[2] / "systems"
PENDULUM = SYSTEMS / "pendulum.yaml"

OSCILLATOR = """
schema: system/1
name: shaker
states:
  x: {unit: m}
  v: {unit: m/s}
  i: {unit: A, initial: 0.4}
inputs:
  V: {unit: V}
outputs:
  x: {unit: m}
operating_point:
  m: {unit: kg}
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

SLED = """
schema: system/1
name: sled
states:
  v: {unit: m/s}
inputs:
  F: {unit: N}
outputs:
  v: {unit: m/s}
parameters:
  m: {value: 2.0, unit: kg}
ports:
  rail: {effort: F_r, unit: N, velocity: v}
dynamics:
  v: (F - F_r)/m
"""

DECAY = """
schema: system/1
name: decay
states:
  x: {unit: m}
inputs:
  u: {unit: m}
outputs:
  x: {unit: m}
parameters:
  k: {value: 1.0, unit: 1/s}
dynamics:
  x: k*(u - x)
"""


def system_of(text: str, folder: Path) -> System:
    (folder / "system.yaml").write_text(text)
    return read_system(folder / "system.yaml")


def clock(n: int, period: float = 0.002) -> Array:
    return np.asarray(np.arange(n) * period)


def drive(t: Array, i: int) -> Array:
    return np.asarray(np.sin((3.0 + i) * t) + 0.4 * np.sin((7.0 + 2.0 * i) * t + 1.0))


def truth(rate: Rate, t: Array, u: Array, x0: list[float]) -> Array:
    """States (n, states) by an adaptive method; the input runs straight from sample to sample."""

    def f(time: float, x: Array) -> list[float]:
        return rate(time, x, float(np.interp(time, t, u)))

    found = solve_ivp(f, (t[0], t[-1]), x0, "DOP853", t, rtol=1e-10, atol=1e-12, max_step=t[1] - t[0])
    return np.asarray(found.y.T)


def logs_of(
    system: System, folder: Path, experiments: list[dict[str, Array]], **columns: list[float]
) -> Logs:
    """Written as a log folder and read back."""
    ids = [f"run{i}" for i in range(len(experiments))]
    folder.mkdir(exist_ok=True)
    for name, log in zip(ids, experiments, strict=True):
        pd.DataFrame(log).to_csv(folder / f"{name}.csv", index=False)
    table = {"id": ids, "file": [f"{name}.csv" for name in ids], **columns}
    pd.DataFrame(table).to_csv(folder / "experiments.csv", index=False)
    return read_logs(folder, system)


def swing(friction: float = 0.0) -> Rate:
    def rate(t: float, x: Array, u: float) -> list[float]:
        theta, omega = x
        load = friction * math.tanh(omega / 0.05)
        return [omega, (u - 0.01 * omega - 1.2 * math.sin(theta) - load) / 0.02]

    return rate


def pendulum_logs(
    folder: Path, sigma: float = 0.0, friction: float = 0.0, lengths: tuple[int, ...] = (400, 333)
) -> Logs:
    rng, experiments = np.random.default_rng(0), []
    for i, n in enumerate(lengths):
        t, u = clock(n), drive(clock(n), i)
        theta = truth(swing(friction), t, u, [0.3, 0.0])[:, 0]
        experiments.append({"t": t, "theta": theta + sigma * rng.standard_normal(n), "torque": u})
    return logs_of(read_system(PENDULUM), folder, experiments)


def sled_logs(system: System, folder: Path, friction: float, lengths: tuple[int, ...]) -> Logs:
    """A sled that never turns round: its speed is known in closed form."""
    experiments = []
    for n in lengths:
        t = clock(n, 0.01)
        F = 4.0 + 3.0 * np.cos(4.0 * t)
        v = 1.0 + np.concatenate([[0.0], np.cumsum(0.5 * (F[1:] + F[:-1]) * 0.01)]) / 2.0 - friction / 2.0 * t
        experiments.append({"t": t, "v": v, "F": F})
    return logs_of(system, folder, experiments)


def test_the_true_pendulum_has_no_gap(tmp_path: Path) -> None:
    logs = pendulum_logs(tmp_path)
    found = gap(read_system(PENDULUM), logs, 0.1)
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
    assert gap(system, logs, 0.1).value < 1e-4


def test_the_true_slider_crank_has_no_gap(tmp_path: Path) -> None:
    """Its equation is written here a second time, with the energies' derivatives by finite differences."""
    m1, m2, m3, l1, l2, J1, B_m, g = 0.23, 0.35, 0.77, 0.05, 0.29, 0.0034, 0.007, 9.81

    def inertia(theta: float) -> float:
        s, c = math.sin(theta), math.cos(theta)
        q = math.sqrt(1.0 - (l1 / l2 * s) ** 2)
        slope = l1 * c / (l2 * q)
        k = -l1 * s - l1 * s * slope
        rod = (-l1 * s - 0.5 * l1 * s * slope) ** 2 + (0.5 * l1 * c) ** 2
        return J1 + m2 * rod + m2 * l2**2 / 12.0 * slope**2 + m3 * k**2

    def rate(t: float, x: Array, T: float) -> list[float]:
        theta, omega = x
        slope = (inertia(theta + 1e-5) - inertia(theta - 1e-5)) / 2e-5
        weight = g * l1 * math.cos(theta) / 2.0 * (m1 + m2)
        return [omega, (T - B_m * omega - weight - 0.5 * slope * omega**2) / inertia(theta)]

    t = clock(600)
    u = 0.5 + 0.3 * drive(t, 0)
    theta, omega = truth(rate, t, u, [0.2, 5.0]).T
    log = {"t": t, "theta": theta, "omega": omega, "T": u}
    system = read_system(SYSTEMS / "slider_crank.yaml")
    logs = logs_of(system, tmp_path, [log])
    assert np.ptp(theta) > 2.0 * np.pi
    assert gap(system, logs, 0.1).value < 1e-4


@settings(max_examples=15, deadline=None)
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
    found = gap(system, logs, horizon)
    steps = max(1, round(horizon / 0.01))
    errors = [friction / 2.0 * 0.01 * (np.arange(n - 1) % steps + 1) / np.std(logs.y) for n in lengths]
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
    assert gap(known, logs, 0.1).value > 1e-3
    assert gap(law, logs, 0.1).value < 1e-10


def test_missing_friction_of_a_pendulum_against_another_integrator(tmp_path: Path) -> None:
    logs = pendulum_logs(tmp_path, friction=0.1)
    found = gap(read_system(PENDULUM), logs, 0.1)
    square = []
    for i in range(2):
        t, theta, u = logs.t[logs.rows(i)], logs.y[logs.rows(i), 0], logs.u[logs.rows(i), 0]
        states = truth(swing(0.1), t, u, [0.3, 0.0])
        for a in range(0, len(t) - 1, 50):
            part = slice(a, min(a + 51, len(t)))
            simulated = truth(swing(), t[part], u[part], states[a].tolist())[:, 0]
            square.append((simulated - theta[part])[1:] ** 2)
    expected = np.sqrt(np.mean(np.concatenate(square))) / np.std(logs.y)
    assert found.value == pytest.approx(expected, rel=2e-3)
    assert found.value > 0.01


@pytest.mark.parametrize("sigma", [3e-4, 3e-3])
def test_noise_leaves_about_the_floor(tmp_path: Path, sigma: float) -> None:
    logs = pendulum_logs(tmp_path, sigma=sigma, lengths=(800, 700, 600))
    found = gap(read_system(PENDULUM), logs, 0.1)
    assert found.floor == pytest.approx(sigma / np.std(logs.y), rel=0.1)
    assert found.floor < found.value < 2.0 * found.floor
    assert noise_floor(logs, [0, 1, 2])[0] == pytest.approx(found.floor)


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


@pytest.mark.parametrize("delay", [0.0, 0.02, 0.0205, 0.0015, 0.15])
def test_a_late_sensor_is_compared_with_the_past(tmp_path: Path, delay: float) -> None:
    system, logs = delayed(delay, tmp_path)
    found = gap(system, logs, 0.1)
    assert found.value < 1e-4
    whole = math.floor(delay / 0.002 + 1e-6)
    nothing = np.isnan(found.run.y)
    assert nothing[:, 0].sum() == nothing[:, 0][: whole + 1].sum() == (whole + 1 if delay else 0)
    assert nothing[:, 1].sum() == nothing[:, 1][400 - whole :].sum() == whole
    if delay:
        prompt = replace(system, outputs=tuple(replace(o, delay=0.0) for o in system.outputs))
        assert gap(prompt, logs.for_system(prompt), 0.1).value > 1e-3


def test_a_delay_hides_no_gap(tmp_path: Path) -> None:
    """Not even a delay longer than the horizon."""
    gaps = []
    for delay in (0.0, 0.02, 0.15):
        (tmp_path / str(delay)).mkdir()
        system, logs = delayed(delay, tmp_path / str(delay), friction=0.1)
        gaps.append(gap(system, logs, 0.1).per_output["theta"])
    assert gaps[0] > 0.01
    assert gaps[1:] == pytest.approx([gaps[0]] * 2, rel=0.3)


@pytest.mark.parametrize("horizon", [0.01, 0.02, 0.03, 0.5])
def test_a_late_sensor_shows_the_input_of_then(tmp_path: Path, horizon: float) -> None:
    """Windows of any length can be read between samples."""
    late = "  a: {unit: m/s^2, expression: F/m + 0*v, delay: 0.043}\nparameters:"
    system = system_of(SLED.replace("\nparameters:", "\n" + late), tmp_path)
    one = sled_logs(system_of(SLED, tmp_path), tmp_path / "one", 0.0, (100,))
    then = np.interp(one.t - 0.043, one.t, one.u[:, 0]) / 2.0
    log = {"t": one.t, "v": one.y[:, 0], "a": then, "F": one.u[:, 0]}
    assert gap(system, logs_of(system, tmp_path / "two", [log]), horizon).value < 1e-10


def test_a_delay_as_long_as_an_experiment_is_refused(tmp_path: Path) -> None:
    logs = pendulum_logs(tmp_path)
    system = read_system(PENDULUM)
    late = replace(system, outputs=(replace(system.outputs[0], delay=0.7),))
    with pytest.raises(
        BadInput, match=r"outputs.theta.delay: 0.7 s is too long for experiment run1 of 0.664"
    ):
        gap(late, logs, 0.1)


def test_a_long_horizon_is_the_whole_experiment(tmp_path: Path) -> None:
    system = system_of(SLED, tmp_path)
    logs = sled_logs(system, tmp_path / "logs", 0.5, (100, 80))
    exact, longer = gap(system, logs, 0.99), gap(system, logs, 1e300)
    assert longer.value == exact.value
    assert not longer.run.window.any()
    assert any("each is simulated as a whole" in note for note in longer.notes) and not exact.notes


@pytest.mark.parametrize(("horizon", "words"), [(0.001, "1 of 0.01 s"), (0.024, "2 of 0.01 s")])
def test_a_horizon_between_samples_is_rounded(tmp_path: Path, horizon: float, words: str) -> None:
    system = system_of(SLED, tmp_path)
    found = gap(system, sled_logs(system, tmp_path / "logs", 0.5, (100,)), horizon)
    assert words in found.notes[0]


@pytest.mark.parametrize("horizon", [0.0, -1.0, math.nan, math.inf, "soon", True, None])
def test_a_horizon_that_is_none(tmp_path: Path, horizon: float) -> None:
    system = system_of(SLED, tmp_path)
    logs = sled_logs(system, tmp_path / "logs", 0.5, (100,))
    with pytest.raises(BadInput, match=r"^horizon: must be a positive number of seconds, got"):
        gap(system, logs, horizon)


def test_some_experiments_are_as_if_there_were_no_others(tmp_path: Path) -> None:
    system = system_of(SLED, tmp_path)
    all_logs = sled_logs(system, tmp_path / "all", 0.5, (100, 60, 80))
    some = gap(system, all_logs, 0.1, runs=[1])
    alone = gap(system, sled_logs(system, tmp_path / "alone", 0.5, (60,)), 0.1)
    assert some.value == pytest.approx(alone.value, rel=1e-12) and some.floor == alone.floor
    assert list(some.per_experiment) == ["run1"]
    assert np.isnan(some.run.y[all_logs.rows(0)]).sum() == 99 + 1


def test_outputs_weigh_the_same(tmp_path: Path) -> None:
    """The second output shows the speed in another unit."""
    text = SLED.replace(
        "  v: {unit: m/s}\nparameters:",
        "  v: {unit: m/s}\n  p: {unit: kg m/s, expression: 100*m*v, column: v2}\nparameters:",
    )
    system = system_of(text, tmp_path)
    plain = system_of(SLED, tmp_path)
    one = sled_logs(plain, tmp_path / "logs", 0.5, (100,))
    log = {"t": one.t, "v": one.y[:, 0], "v2": 200.0 * one.y[:, 0], "F": one.u[:, 0]}
    found = gap(system, logs_of(system, tmp_path / "two", [log]), 0.1)
    assert found.per_output["p"] == pytest.approx(found.per_output["v"])
    assert found.value == pytest.approx(gap(plain, one, 0.1).value)


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
    found = gap(system, logs, 0.5)
    assert found.value < 1e-6
    assert not found.notes
    assert (found.substeps == 1) == (stiffness == 2.0)


def test_more_substeps_change_less_than_a_tenth_of_the_floor(tmp_path: Path) -> None:
    system, t = read_system(PENDULUM), clock(400, 0.04)
    u = drive(t, 0)
    theta = truth(swing(), t, u, [0.3, 0.0])[:, 0] + 1e-4 * np.random.default_rng(0).standard_normal(400)
    logs = logs_of(system, tmp_path, [{"t": t, "theta": theta, "torque": u}])
    found = gap(system, logs, 0.5)
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
    found = gap(system, logs_of(system, tmp_path / "logs", [log]), 0.1)
    assert found.per_output["s"] > 5.0
    assert 5.0 < found.value <= LARGEST_ERROR
    assert np.isfinite(found.run.y).all()
    assert any(note.startswith("x: ") and "diverged" in note for note in found.notes)
    assert any("has not converged" in note for note in found.notes)


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
    found = gap(system, logs, 0.1)
    assert 0.0 < found.per_output["r"] <= LARGEST_ERROR
    assert any(note.startswith("r: ") for note in found.notes)


def test_logs_of_other_states_are_a_mistake(tmp_path: Path) -> None:
    logs = pendulum_logs(tmp_path)
    with pytest.raises(ValueError, match="must have the states of sled"):
        gap(system_of(SLED, tmp_path), logs, 0.1)


def test_results_are_deterministic(tmp_path: Path) -> None:
    logs = pendulum_logs(tmp_path, sigma=1e-3)
    first, second = (gap(read_system(PENDULUM), logs, 0.1) for _ in range(2))
    assert first.value == second.value
    np.testing.assert_array_equal(first.run.y, second.run.y)
