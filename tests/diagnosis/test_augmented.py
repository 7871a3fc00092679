"""The augmented system as a file: it simulates the user's own folder with the gap that was reported."""

from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from tests.diagnosis.diagnoses import FRICTION, HELD_OUT, Said, diagnosis
from tests.diagnosis.studies import ANGLE, HORIZON, JOINT, TORQUE
from unmodelled.diagnosis.answer.augmented import FILE, augmented_system, write_augmented
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.effects.place import Place
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system

pytestmark = pytest.mark.long

GROUP = replace(FRICTION, place=replace(JOINT, factor="group", level="old"))
DAHL = Said("hysteresis", JOINT, {"F_h": 0.05, "x_h": 0.01}, "dahl")
ORDER = Said("drift", JOINT, {"F_n": 0.02}, "load_by_order")
SCATTER = Said("scatter", Place("parameter", "b"), {}, own={"b_deviation": (0.01, 0.0, -0.02, 0.005)})
LATE = Said("input_delay", TORQUE, {"T_d_torque": 0.0037})
SENSOR = Said("sensor_delay", ANGLE, {"T_d_theta": 0.005})
LAG = Said("actuator_lag", TORQUE, {"c_u": 1.0, "T_u": 0.01})
GAIN = Said("sensor_gain", ANGLE, {"g": 0.05})
MASS = Said("inertia_error", JOINT, {"dM": 0.004})
PLAY = Said("backlash", JOINT, {"m_b": 0.002}, "load")

CASES: dict[str, tuple[list[Said], float]] = {
    "nothing": ([], 0.0),
    "coulomb": ([FRICTION], 0.0),
    "group": ([GROUP], 0.0),
    "memory": ([DAHL], -0.0004),
    "order": ([ORDER], 0.0),
    "scatter": ([SCATTER], -0.0011),
    "late_input": ([LATE], 0.0),
    "late_sensor": ([SENSOR, GAIN], 0.0007),
    "lag": ([LAG], 0.0),
    "inertia": ([MASS, FRICTION], 0.0),
    "play": ([PLAY], 0.0),
    "many": ([GROUP, SCATTER, ORDER, DAHL], -0.0004),
}


@pytest.mark.parametrize("name", CASES)
def test_simulating_the_file_on_the_users_folder_gives_the_gap_that_was_reported(
    tmp_path: Path, name: str
) -> None:
    said, timing = CASES[name]
    found = diagnosis(tmp_path, *said, timing=timing)
    assert not said or found.augmented.gap.value != found.known.gap.value
    write_augmented(found, tmp_path / "out")
    system = read_system(tmp_path / "out" / FILE)
    logs = read_logs(tmp_path / "logs", system)
    reported = pytest.approx(found.augmented.gap.value, rel=1e-9)
    assert free_runs(system, logs, HORIZON, HELD_OUT).value == reported
    found.logs.write(tmp_path / "store")
    stored = read_logs(tmp_path / "store", system)
    assert free_runs(system, stored, HORIZON, HELD_OUT).value == reported


def test_what_a_new_experiment_has(tmp_path: Path) -> None:
    found = diagnosis(tmp_path, GROUP, SCATTER, ORDER)
    constants = {c.name: c for c in augmented_system(found).operating_point}
    assert constants["in_group"].values == {"run0": 0.0, "run1": 1.0, "run2": 1.0, "run3": 0.0}
    assert constants["in_group"].other == 0.0
    assert constants["b_deviation"].other == pytest.approx(-0.00125)
    assert constants["experiment_number"].other == 3.0
    write_augmented(found, tmp_path / "out")
    table = pd.read_csv(tmp_path / "logs" / "experiments.csv").replace({"id": {"run2": "new"}})
    table.to_csv(tmp_path / "logs" / "experiments.csv", index=False)
    logs = read_logs(tmp_path / "logs", read_system(tmp_path / "out" / FILE))
    assert dict(zip(logs.constants, logs.c[2], strict=True)) == {
        "in_group": 0.0,
        "b_deviation": pytest.approx(-0.00125),
        "experiment_number": 3.0,
    }


def test_what_rounding_puts_beyond_a_bound_is_read(tmp_path: Path) -> None:
    found = diagnosis(tmp_path, FRICTION)
    system = found.augmented.system.with_values({"b": 0.1 + 2e-17, "F_c": -1e-18})
    assert system.values[1] > 0.1
    write_augmented(replace(found, augmented=replace(found.augmented, system=system)), tmp_path / "out")
    values = {p.name: p.value for p in read_system(tmp_path / "out" / FILE).parameters}
    assert (values["b"], values["F_c"]) == (0.1, 0.0)


def test_the_known_physics_and_its_words_are_kept(tmp_path: Path) -> None:
    found = diagnosis(tmp_path, FRICTION)
    write_augmented(found, tmp_path / "out")
    system = read_system(tmp_path / "out" / FILE)
    assert system.text["dynamics.omega"] == "(torque - b*omega - mgl*sin(theta) - tau)/J"
    assert system.text["ports.joint.law"] == "F_c*tanh(omega/v_c)"
    assert (system.name, system.uncertain) == ("pendulum", ("b", "mgl", "F_c", "v_c"))
