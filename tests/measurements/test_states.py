"""States along experiments: read, also behind a filter, differentiated, integrated."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from tests.diagnosis.benches import pendulum
from tests.diagnosis.studies import effect
from tests.machines.folders import logs_of
from tests.measurements.systems import ANGLE, SPEED, J, L, R, i, k, m, motor, omega, run, theta, write_folder
from unmodelled import BadInput, Logs, System, read_logs
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.effects.added import with_numbers
from unmodelled.effects.place import Place
from unmodelled.effects.scales import Scales
from unmodelled.logs.readings import readings
from unmodelled.systems.functions import sgn
from unmodelled.systems.model import Output, State, symbol


def grown(system: System, *more: tuple[State, sp.Expr]) -> System:
    states, rates = zip(*more, strict=True)
    return replace(system, states=(*system.states, *states), dynamics=(*system.dynamics, *rates))


def test_outputs_are_read_and_velocities_differentiated(tmp_path: Path) -> None:
    logs = read_logs(write_folder(tmp_path, {"a": run(), "b": run(300)}), motor([ANGLE]))
    assert logs.measured == (True, True, False)
    np.testing.assert_array_equal(logs.x[:, 0], logs.y[:, 0])
    for row, n in enumerate((400, 300)):
        np.testing.assert_allclose(logs.x[logs.rows(row), 1], run(n)["speed"], atol=1e-3)
    note = "omega was estimated from theta by smoothing differentiation over"
    assert any(n.startswith(note) for n in logs.notes)


def test_a_measured_velocity_is_not_differentiated(tmp_path: Path) -> None:
    logs = read_logs(write_folder(tmp_path, {"a": run()}), motor([ANGLE, SPEED]))
    np.testing.assert_array_equal(logs.x[:, 1], run()["speed"])
    assert not any("differentiation" in note for note in logs.notes)


def test_affine_sensors_are_inverted(tmp_path: Path) -> None:
    """A tachometer with gain and offset, scaled by the operating point too."""
    tacho = Output("tacho", "V", "tacho", R * (m + 1) * omega + L)
    log = run()
    log["tacho"] = 2.0 * 1.5 * log["speed"] + 0.05
    logs = read_logs(write_folder(tmp_path, {"a": log}), motor([ANGLE, tacho]))
    np.testing.assert_allclose(logs.x[:, 1], log["speed"], atol=1e-12)
    assert logs.measured == (True, True, False)
    assert any(note.startswith("omega was read from tacho = ") for note in logs.notes)


@pytest.mark.parametrize(
    "expression",
    [omega**2, omega + sgn(omega), omega + theta, 0 * omega + R, omega * (m - sp.Rational(1, 2))],
)
def test_other_sensors_are_not_inverted(tmp_path: Path, expression: sp.Expr) -> None:
    other = Output("other", "V", "speed", expression)
    logs = read_logs(write_folder(tmp_path, {"a": run()}), motor([other, ANGLE]))
    assert any("omega was estimated from theta" in note for note in logs.notes)
    np.testing.assert_array_equal(logs.x[:, 0], run()["angle"])


@pytest.mark.parametrize("speed", [False, True], ids=["angle", "speed and angle"])
def test_an_encoder_off_its_axis_is_read(tmp_path: Path, speed: bool) -> None:
    """The angle is shown with an error of 20 mrad twice a turn, the speed as the slope of the shown angle."""
    slope, wave = 1 + 0.04 * sp.cos(2 * theta + 0.5), 0.02 * sp.sin(2 * theta + 0.5)
    outputs = [Output("w", "rad/s", "w", sp.expand(omega * slope))] if speed else []
    log, system = run(), motor([*outputs, Output("q", "rad", "q", theta + wave)])
    log["q"] = log["angle"] + 0.02 * np.sin(2 * log["angle"] + 0.5)
    log["w"] = log["speed"] * (1 + 0.04 * np.cos(2 * log["angle"] + 0.5))
    logs = read_logs(write_folder(tmp_path, {"a": log}), system)
    np.testing.assert_allclose(logs.x[:, 0], log["angle"], atol=5e-5)
    np.testing.assert_allclose(logs.x[:, 1], log["speed"], atol=1e-4 if speed else 2e-3)
    assert logs.measured == (True, True, False)
    assert [r.output for r in readings(system)] == ([1, 0] if speed else [0, 0])


def test_a_reading_beside_an_input_is_inverted(tmp_path: Path) -> None:
    """The voltage at the terminals shows the current beside a part that the input drives, delayed alike."""
    system = motor(inductance=0.05)
    (voltage,) = system.u
    terminal = Output("U", "A", "U", 2 * i + 0.5 * voltage + m, delay=0.004)
    log = run()
    shown = np.cos(log["t"])
    log["U"] = np.concatenate([[np.nan] * 2, (2 * shown + 0.5 * log["voltage"] + 0.5)[:-2]])
    log["U"][:2] = log["U"][2]
    logs = read_logs(write_folder(tmp_path, {"a": log}), motor([ANGLE, terminal]))
    np.testing.assert_allclose(logs.x[:-2, 2], shown[:-2], atol=1e-9)
    assert logs.measured == (True, True, True)


def test_a_state_is_read_beside_one_that_inputs_alone_drive(tmp_path: Path) -> None:
    """The current beside the memory of a low-pass filter of the voltage, which starts at rest."""
    z = symbol("z")
    beside = motor([ANGLE, Output("U", "V", "U", 2 * i - 3 * z)])
    (voltage,) = beside.u
    system = grown(beside, (State("z", "A"), (voltage - z) / 0.1))
    log = run()
    log["voltage"] = np.full_like(log["t"], 6.0)
    log["U"] = 2 * np.cos(log["t"]) - 3 * 6.0 * (1 - np.exp(-log["t"] / 0.1))
    logs = read_logs(write_folder(tmp_path, {"a": log}), system)
    np.testing.assert_allclose(logs.x[:, 2], np.cos(log["t"]), atol=1e-6)
    assert logs.measured == (True, True, True, False)


@pytest.mark.parametrize("outputs", [[ANGLE], [ANGLE, SPEED]], ids=["position", "position and speed"])
def test_a_position_and_its_speed_are_read_from_a_difference(tmp_path: Path, outputs: list[Output]) -> None:
    """A sensor between two bodies, beside sensors of one of them: a deflection of a spring."""
    x, v = symbol("x"), symbol("v")
    alone = motor([*outputs, Output("d", "rad", "d", x - theta)])
    system = grown(alone, (State("x", "rad"), v), (State("v", "rad/s"), -x))
    log = run()
    log["d"] = np.cos(2 * log["t"]) - log["angle"]
    logs = read_logs(write_folder(tmp_path, {"a": log}), system)
    np.testing.assert_allclose(logs.x[:, 3], np.cos(2 * log["t"]), atol=1e-12)
    np.testing.assert_allclose(logs.x[:, 4], -2 * np.sin(2 * log["t"]), atol=5e-3)
    assert logs.measured == (True, True, False, True, True)


def test_a_speed_is_not_read_from_an_acceleration(tmp_path: Path) -> None:
    """Its noise would be divided by a small damping."""
    push = Output("a", "rad/s^2", "a", -theta - sp.Rational(1, 100) * i)
    log = run()
    log["a"] = -log["angle"]
    logs = read_logs(write_folder(tmp_path, {"a": log}), motor([ANGLE, push]))
    assert logs.measured == (True, True, False)


def test_an_output_shows_the_past(tmp_path: Path) -> None:
    late = replace(ANGLE, delay=0.011)
    logs = read_logs(write_folder(tmp_path, {"a": run(), "b": run()}), motor([late]))
    ahead = 0.011 + run()["t"]
    inside = slice(0, 390)
    for run_index in range(2):
        x = logs.x[logs.rows(run_index)]
        np.testing.assert_allclose(x[inside, 0], (np.sin(3.0 * ahead) + 0.1 * ahead)[inside], atol=1e-6)
        np.testing.assert_allclose(x[inside, 1], (3.0 * np.cos(3.0 * ahead) + 0.1)[inside], atol=1e-3)
        np.testing.assert_array_equal(x[-5:, :2], x[-5:-4, :2].repeat(5, axis=0))
        np.testing.assert_array_equal(logs.y[logs.rows(run_index), 0], run()["angle"])
    assert "what theta shows is held over the last 0.011 s, its delay" in logs.notes


def current(log: dict[str, np.ndarray], inductance: float) -> np.ndarray:
    """The current that the motor's equation asks for, by an adaptive method."""

    def rate(t: float, i: np.ndarray) -> np.ndarray:
        voltage = np.interp(t, log["t"], log["voltage"])
        return np.asarray((voltage - 2.0 * i - 0.3 * (3.0 * np.cos(3.0 * t) + 0.1)) / inductance)

    end = log["t"][-1]
    found = solve_ivp(rate, (0.0, end), [0.5], "LSODA", log["t"], rtol=1e-8, atol=1e-10, max_step=1e-3)
    return np.asarray(found.y[0])


@pytest.mark.parametrize("inductance", [0.05, 0.0002])
def test_a_hidden_state_is_integrated(tmp_path: Path, inductance: float) -> None:
    """The second motor's current is too fast for four steps per sample."""
    system = motor([ANGLE, SPEED], inductance=inductance)
    logs = read_logs(write_folder(tmp_path, {"a": run(200), "b": run(100)}), system)
    assert logs.measured == (True, True, False)
    np.testing.assert_allclose(logs.x[:200, 2], current(run(200), inductance), atol=2e-4)
    np.testing.assert_allclose(logs.x[200:, 2], logs.x[:100, 2], atol=1e-12)
    assert logs.x[0, 2] == 0.5
    note = "i: no output shows it, integrated from the start of each record"
    assert any(n.startswith(note) for n in logs.notes)


def started(initial: sp.Expr, other: sp.Expr = sp.S.Zero) -> System:
    """The motor whose current starts at `initial`, with a second hidden state that starts at `other`."""
    system = motor([ANGLE, SPEED])
    current = replace(system.states[2], initial=initial)
    heat = State("H", "A", other)
    return grown(replace(system, states=(*system.states[:2], current)), (heat, sp.S.Zero))


def test_a_hidden_state_starts_where_its_expression_says(tmp_path: Path) -> None:
    """Of measured states, inputs, parameters, the operating point and another hidden state."""
    log = {**run(), "angle": run()["angle"] + 0.7}
    folder = write_folder(tmp_path, {"a": log})
    (voltage,) = motor().u
    logs = read_logs(folder, started(voltage / R + theta - m, 2 * i + omega))
    assert logs.x[0, 2] == pytest.approx(log["voltage"][0] / 2.0 + 0.7 - 0.5)
    assert logs.x[-1, 3] == pytest.approx(2 * logs.x[0, 2] + log["speed"][0])


def test_hidden_states_that_start_at_each_other_are_refused(tmp_path: Path) -> None:
    folder = write_folder(tmp_path, {"a": run()})
    with pytest.raises(BadInput, match=r"states.i.initial: depends on i, which no output shows, in a circle"):
        read_logs(folder, started(2 * symbol("H"), i + theta))


def test_a_known_law_acts_on_hidden_states(tmp_path: Path) -> None:
    """The speed alone is hidden: it is integrated with the port's law in place."""
    system = motor([Output("i", "A", "speed", motor().x[2])])
    port = replace(system.ports[0], law=0.4 * omega)
    braked = replace(system, ports=(port,))
    folder = write_folder(tmp_path, {"a": run()})
    free, slowed = read_logs(folder, system), read_logs(folder, braked)
    assert free.measured == (False, False, True)
    inertia = 0.02 + 0.5
    torque = 0.3 * run()["speed"]
    expected = np.concatenate([[0.0], np.cumsum(0.5 * (torque[1:] + torque[:-1]) * 0.002)]) / inertia
    np.testing.assert_allclose(free.x[:, 1], expected, atol=1e-9)
    assert slowed.x[-1, 1] < free.x[-1, 1]


def unstable() -> System:
    system = motor([ANGLE])
    i, rate = system.x[2], sp.sympify((system.u[0] + k * system.x[2] ** 3) / L)
    assert i in rate.free_symbols and J not in rate.free_symbols
    return replace(system, dynamics=(*system.dynamics[:2], rate))


def test_a_hidden_state_that_diverges_is_refused(tmp_path: Path) -> None:
    folder = write_folder(tmp_path, {"a": run()})
    words = r"system motor: dynamics.i diverges in experiment a at t = .* value 0.5"
    with pytest.raises(BadInput, match=words):
        read_logs(folder, unstable())


PERIOD, TIME, RATE = 0.002, 0.02, 6.0


@pytest.fixture
def filtered(tmp_path: Path) -> tuple[System, Logs]:
    """A pendulum whose angle, sin(RATE*t), passes a filter of the time constant TIME, and its logs."""
    t = PERIOD * np.arange(1000)
    shown = np.sin(RATE * t - np.arctan(RATE * TIME)) / np.hypot(1.0, RATE * TIME)
    known = pendulum(tmp_path)
    logs = logs_of(known, tmp_path / "logs", [{"t": t, "theta": shown, "torque": 0.0 * t}] * 2)
    sizes = Scales.measured(known, logs.period, logs.offsets, logs.t, logs.x, logs.u, logs.c)
    added = effect("sensor_lag").add(known, Place("sensor", "theta"), sizes)
    return with_numbers(added.system, [added], {"c_y": 1.0, "T_y": TIME}), logs


def test_a_filtered_angle_and_its_speed_are_read(filtered: tuple[System, Logs], tmp_path: Path) -> None:
    grown, _ = filtered
    logs = read_logs(tmp_path / "logs", grown)
    inner = slice(50, 950)
    assert_allclose(logs.x[inner, 0], np.sin(RATE * logs.t[inner]), atol=1e-4)
    assert_allclose(logs.x[inner, 1], RATE * np.cos(RATE * logs.t[inner]), atol=1e-2)
    assert_allclose(logs.x[inner, 2], logs.y[inner, 0], atol=1e-3)


def test_windows_start_at_the_angle_before_the_filter(filtered: tuple[System, Logs]) -> None:
    grown, logs = filtered
    simulation = Simulation(grown, Recording.of(logs, 0.1))
    values = simulation.values[None, None]
    tables = simulation.reader(np.repeat(values, 2, axis=0), simulation.recording)
    assert_allclose(tables.x[0, 100:900, 0], np.sin(RATE * logs.t[100:900]), atol=1e-4)
    assert_allclose(tables.x[0, 100:900, 1], RATE * np.cos(RATE * logs.t[100:900]), atol=0.02 * RATE)


def test_a_state_that_follows_another_one_is_read_from_its_own_output(filtered: tuple[System, Logs]) -> None:
    grown, _ = filtered
    (output,) = grown.outputs
    own = replace(grown, outputs=(replace(output, expression=grown.x[2]),))
    assert [(r.state, r.lag) for r in readings(own)] == [(2, 0)]
