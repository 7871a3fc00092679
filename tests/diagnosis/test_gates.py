"""What leaves an answer: read back, with possible numbers, and no worse over whole runs."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.diagnoses import FRICTION, HELD_OUT, Said, diagnosis, known, told
from tests.diagnosis.studies import ANGLE, JOINT, TORQUE, scales_of
from tests.machines.folders import text_of
from unmodelled.diagnosis.answer.augmented import FILE, write_augmented
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.result import DiagnosedEffect, Diagnosis, Estimate
from unmodelled.diagnosis.gates.effect_numbers import impossible_numbers
from unmodelled.diagnosis.gates.robot_numbers import impossible_robot
from unmodelled.diagnosis.gates.system_file import reason_against_system
from unmodelled.diagnosis.gates.whole_runs import Errors, WholeRuns, worse
from unmodelled.effects.added import with_numbers
from unmodelled.effects.columns import extended
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import Constant
from unmodelled.systems.robot.compile import compiled
from unmodelled.systems.robot.numbers import Key, numbers

UNITS = {"theta": "rad"}


def unbounded(found: Diagnosis) -> Diagnosis:
    """As if a search had no bounds of its numbers."""
    system = found.augmented.system
    free = tuple(replace(p, bounds=None) for p in system.parameters)
    return replace(found, augmented=replace(found.augmented, system=replace(system, parameters=free)))


def checked(found: Diagnosis, folder: Path) -> tuple[str, list[str]]:
    write_augmented(found, folder / "out")
    reason, notes = reason_against_system(found, folder / "out" / FILE)
    return reason, list(notes)


@pytest.mark.parametrize("said", [(FRICTION,), ()], ids=["a law that helps", "the given system itself"])
def test_what_is_no_worse_leaves(tmp_path: Path, said: tuple[Said, ...]) -> None:
    assert checked(diagnosis(tmp_path, *said), tmp_path) == ("", [])


def test_what_its_own_reader_refuses_does_not_leave(tmp_path: Path) -> None:
    found = diagnosis(tmp_path, FRICTION)
    write_augmented(found, tmp_path)
    text = (tmp_path / FILE).read_text()
    (tmp_path / FILE).write_text(text.replace("F_c: {value: 0.06, unit: N m", "F_c: {value: 0.06, unit: N"))
    reason, _ = reason_against_system(found, tmp_path / FILE)
    assert reason.startswith("it cannot be read back (line ") and "N m" in reason


def test_a_number_that_new_logs_do_not_have_does_not_leave(tmp_path: Path) -> None:
    found = diagnosis(tmp_path, FRICTION)
    system = found.augmented.system
    wear = Constant("wear", "1", dict.fromkeys(found.logs.ids, 0.1))
    write_augmented(found, tmp_path)
    text = (tmp_path / FILE).read_text()
    assert "operating_point" not in text and "wear" not in {c.name for c in system.operating_point}
    values = ", ".join(f"{name}: 0.1" for name in wear.values or ())
    own = f"operating_point:\n  wear: {{unit: '1', values: {{{values}}}}}\nparameters:"
    (tmp_path / FILE).write_text(text.replace("parameters:", own, 1))
    reason, _ = reason_against_system(found, tmp_path / FILE)
    assert reason == "new logs have no value of wear, which only the diagnosed experiments have"
    (tmp_path / FILE).write_text(text.replace("parameters:", own.replace("}}\n", "}, other: 0.1}\n"), 1))
    assert reason_against_system(found, tmp_path / FILE) == ("", ())


OF_B = Place("parameter", "b")
IMPOSSIBLE = {
    "the mass or inertia at joint would be -0.5 times that of the file as given": Said(
        "inertia_error", JOINT, {"dM": -0.03}
    ),
    "with g = -0.96, sensor gain at sensor theta leaves 4 % of theta, which switches it off": Said(
        "sensor_gain", ANGLE, {"g": -0.96}
    ),
    "with g = -1, actuator gain at input torque leaves 0 % of torque, which switches it off": Said(
        "actuator_gain", TORQUE, {"g": -1.0}
    ),
    "with g_a = 0.99, actuator asymmetry at input torque leaves 1 % of torque": Said(
        "actuator_asymmetry", TORQUE, {"g_a": 0.99}
    ),
    "leaves 0 % of torque": Said("actuator_dead_zone", TORQUE, {"c_u": 1.0, "u_d": 50.0}),
    "b would fall to -0.2": Said("drift", OF_B, {"b_rate": -1.0}, "parameter"),
    "b would fall to -0.02 N m s/rad in a part of the logs": Said(
        "parameter_change", replace(OF_B, factor="group", level="old"), {"b_change": -0.05}
    ),
}


@pytest.mark.parametrize("words", IMPOSSIBLE)
def test_a_number_that_no_machine_has_does_not_leave(words: str, tmp_path: Path) -> None:
    assert words in impossible_numbers(unbounded(diagnosis(tmp_path, IMPOSSIBLE[words])))


def test_a_friction_that_drives_does_not_leave(tmp_path: Path) -> None:
    found = diagnosis(tmp_path, Said("viscous_friction", JOINT, {"d": -0.01}))
    assert impossible_numbers(found) == "d = -0.01 N m s/rad is below its lowest possible value, 0"


@pytest.mark.long
def test_every_effect_of_the_library_may_leave_with_plausible_numbers(tmp_path: Path) -> None:
    system, logs = known(tmp_path)
    scales = scales_of(system, logs)
    tried = [(e, place) for e in effects() if not e.beside for place in e.places(system)]
    assert len(tried) > 50
    given = told(system, logs)
    for effect, place in tried:
        added = effect.add(system, place, scales)
        if added.per_experiment:
            continue
        values = {n: 1.0 if n in added.shares else 0.5 * added.scales[n] for n in added.amplitudes}
        values |= {n: grid[len(grid) // 2] for n, grid in added.shapes.items()}
        grown = with_numbers(added.system, [added], values)
        model = replace(given.known, system=grown, logs=prepare(grown, extended(logs, added.columns)))
        fitted = {n: Estimate(added.units[n], np.nan, v, (0.8 * v, 1.2 * v)) for n, v in values.items()}
        found = DiagnosedEffect(added, fitted, {}, 0.9, 0.8, (0.7, 0.9), ())
        assert impossible_numbers(replace(given, augmented=model, effects=(found,))) == "", added.key


def test_possible_numbers_are_no_reason(tmp_path: Path) -> None:
    said = [
        Said("inertia_error", JOINT, {"dM": -0.01}),
        FRICTION,
        Said("drift", JOINT, {"F_t": -0.01}, "dry_friction"),
        Said("actuator_gain", TORQUE, {"g": -0.3}),
        Said("sensor_offset", ANGLE, {"y_0": -0.4}),
        Said("actuator_dead_zone", TORQUE, {"c_u": 1.0, "u_d": 0.01}),
    ]
    assert impossible_numbers(diagnosis(tmp_path, *said)) == ""


def test_a_friction_that_falls_below_zero_does_not_leave(tmp_path: Path) -> None:
    fading = Said("drift", JOINT, {"F_t": -1.0}, "dry_friction")
    found = unbounded(diagnosis(tmp_path, FRICTION, fading))
    assert impossible_numbers(found) == "the friction at joint would drive it in a part of the logs"


def test_an_end_of_an_interval_may_not_switch_a_gain_off(tmp_path: Path) -> None:
    found = diagnosis(tmp_path, Said("sensor_gain", ANGLE, {"g": -0.3}))
    assert impossible_numbers(found) == ""
    (effect,) = found.effects
    wide = {n: replace(e, interval=(-1.0, 0.4)) for n, e in effect.estimates.items()}
    unsure = replace(found, effects=(replace(effect, estimates=wide),))
    assert impossible_numbers(unsure).startswith("with g = -1, an end of its interval, sensor gain at")


def test_a_parameter_of_the_file_keeps_its_sign(tmp_path: Path) -> None:
    found = unbounded(diagnosis(tmp_path, FRICTION))
    system = found.augmented.system.with_values({"b": -0.01})
    wrong = replace(found, augmented=replace(found.augmented, system=system))
    assert impossible_numbers(wrong) == "b would be -0.01 N m s/rad, which is never negative"


def test_a_file_that_is_worse_over_whole_runs_does_not_leave(tmp_path: Path) -> None:
    """A load that the pendulum does not carry."""
    heavy = Said("constant_load", JOINT, {"F_0": 1.5})
    reason, notes = checked(diagnosis(tmp_path, heavy), tmp_path)
    assert reason.startswith("over whole experiments (run1, run3) theta is ") and not notes
    assert reason.endswith(" rad off with the file as given")


def test_the_part_to_which_numbers_were_fitted_does_not_count(tmp_path: Path) -> None:
    """A damping of its own in every experiment, that is exact as far as it was fitted."""
    own = Said("scatter", OF_B, {}, own={"b_deviation": (0.0, 0.1, 0.0, -0.1)})
    found = diagnosis(tmp_path, own)
    model = found.augmented
    runs = WholeRuns.of(model.system, model.logs, model.gap.substeps)
    half = runs.off.shape[1] // 2
    exact = replace(runs, off=np.where(np.arange(2 * half + 1)[:, None] < half, 0.0, runs.off))
    whole, late = runs.errors(HELD_OUT)["theta"], exact.errors(HELD_OUT, since=0.5)["theta"]
    assert whole is not None and late is not None and late > whole
    early = exact.errors(HELD_OUT)["theta"]
    assert early is not None and late == pytest.approx(2**0.5 * early, rel=0.02)


def test_where_the_given_file_is_lost_too_nothing_is_compared(tmp_path: Path) -> None:
    """An inverted pendulum runs away with any numbers: the file leaves, with a note."""
    system, logs = known(tmp_path, ("- mgl*sin(theta)", "+ 60*mgl*theta"))
    found = told(system, logs, Said("coulomb_friction", JOINT, {"F_c": 0.06, "v_c": 1.0}))
    assert found.known.gap.units["theta"].whole_run is None
    reason, notes = checked(found, tmp_path)
    assert reason == ""
    (note,) = notes
    for words in ("augmented_system.yaml diverges", "in 4 of 4 experiments", " after 0."):
        assert words in note


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    _, logs = known(tmp_path_factory.mktemp("whole"))
    return Recording.whole(logs, HELD_OUT)


@pytest.mark.parametrize(
    ("before", "after", "is_worse"),
    [
        *(
            (0.2, 0.1, False),
            (0.2, 0.21, False),
            (1e-3, 2e-3, False),
            (0.2, 0.3, True),
            (0.2, None, True),
            (0.0, 0.1, True),
        ),
        *((None, 0.2, False), (None, None, False), (400.0, 900.0, False), (1e-7, 2e-7, False)),
    ],
)
def test_what_is_worse(
    before: float | None, after: float | None, is_worse: bool, recording: Recording
) -> None:
    errors: list[Errors] = [{"theta": value} for value in (before, after)]
    assert bool(worse(errors[0], errors[1], recording, UNITS)) == is_worse


def test_errors_over_whole_runs_are_those_of_the_gap(tmp_path: Path) -> None:
    found = diagnosis(tmp_path, FRICTION)
    model = found.augmented
    runs = WholeRuns.of(model.system, model.logs, model.gap.substeps)
    wanted = {name: off.whole_run for name, off in model.gap.units.items()}
    assert runs.errors(HELD_OUT) == pytest.approx(wanted, rel=1e-9)


CRANE = text_of("crane.xml")
CHANGED: dict[str, tuple[Mapping[Key, float], str]] = {
    "mass": ({("beam", "mass"): -0.1}, "beam.mass would be -0.1 kg, which is never negative"),
    "armature": ({("pivot", "armature"): -1e-4}, "pivot.armature would be -0.0001 kg m^2"),
    "damping": ({("pivot", "damping"): -0.2}, "pivot.damping would be -0.2 N m s/rad"),
    "dry friction": ({("pivot", "frictionloss"): -0.2}, "pivot.frictionloss would be -0.2 N m"),
    "inertia": ({("beam", "inertia_xx"): 0.5}, "the principal inertias of beam would be 0.15, 0.2 and 0.5"),
    "gear": ({("winch", "gear"): -20.0}, "winch.gear would be -20 instead of 20"),
    "gain": ({("winch", "gain"): 0.0}, "winch.gain would be 0 instead of 1"),
    "limits": ({("winch", "ctrl_low"): 1.5}, "winch.ctrl_low would be 1.5 N m, not below ctrl_high"),
    "upper limit": ({("winch", "ctrl_high"): -4.0}, "winch.ctrl_high would be -4 N m, not above ctrl_low"),
    "nothing": ({("pivot", "armature"): np.nan}, "pivot.armature would have no value"),
    "possible": ({("pivot", "armature"): 0.0, ("winch", "gear"): 15.0, ("pivot", "stiffness"): -3.0}, ""),
}


@pytest.mark.parametrize("name", CHANGED)
def test_a_number_that_no_robot_has(name: str) -> None:
    changed, words = CHANGED[name]
    robot = compiled(CRANE, "crane.xml")
    assert impossible_robot(robot, numbers(robot)) == ""
    said = impossible_robot(robot, {**numbers(robot), **changed})
    assert said.startswith(words) and bool(said) == bool(words)
