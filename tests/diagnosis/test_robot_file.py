"""The robot file of an answer, patched, run in MuJoCo and shown."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

import unmodelled as um
from tests.diagnosis.diagnoses import Said, told
from tests.diagnosis.rods import FRICTION, GIVEN_ROTOR, MJCF, ROTOR, URDF, write_rod
from tests.machines.folders import Array, read_case
from tests.physics.effects.benches import SYSTEMS
from tests.physics.robot.mechanisms import system_of
from unmodelled.base.files import read_json
from unmodelled.cli.verbs.diagnose import diagnose
from unmodelled.diagnosis.answer import diagnose as story
from unmodelled.diagnosis.answer.robot_file import RobotFile, offered
from unmodelled.diagnosis.answer.said_numbers import phrase
from unmodelled.diagnosis.answer.sentences import robot_sentences
from unmodelled.diagnosis.answer.take_home import take_home
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.result import Diagnosis
from unmodelled.diagnosis.fitting.simulation import MakeBackend, Simulation
from unmodelled.diagnosis.gates.refusal import Refusal
from unmodelled.effects.place import Place
from unmodelled.engine.machine.program import Program
from unmodelled.engine.robot.mujoco_runs import RobotInMujoco
from unmodelled.logs.preparation import prepare
from unmodelled.report.diagnosis_tables import robot_sentence
from unmodelled.systems.model import System
from unmodelled.systems.robot.compile import compiled
from unmodelled.systems.robot.numbers import numbers

PIN, DRIVE = Place("port", "pin"), Place("actuator", "u_drive")
RK4 = '<option integrator="RK4" timestep="0.01"/>'
DRY = Said("coulomb_friction", PIN, {"F_c": FRICTION, "v_c": 0.02})
ALL = DRY, Said("inertia_error", PIN, {"dM": ROTOR - GIVEN_ROTOR})
#: The URDF has no rotor at all.
OF_URDF = DRY, Said("inertia_error", PIN, {"dM": ROTOR})


def rod(folder: Path, *said: Said, robot: str = MJCF) -> Diagnosis:
    """A diagnosis that says which effects the rod has."""
    write_rod(folder, robot)
    system, logs = read_case(folder)
    return told(system, prepare(system, logs), *said)


def outputs(
    system: System, recording: Recording, backend: MakeBackend = Program.of, substeps: int = 1
) -> Array:
    """What the system shows in the windows of a recording, or the robot file in MuJoCo."""
    simulation = Simulation(system, recording, backend=backend)
    return np.asarray(simulation(simulation.values[None, None], substeps=substeps).y)


def off(found: Array, expected: Array) -> float:
    return float(np.nanmax(np.abs(found - expected)))


def test_mujoco_moves_as_the_augmented_system(tmp_path: Path) -> None:
    """With the same integrator and step, windows and whole runs are the same to rounding."""
    exact = MJCF.replace("<worldbody>", RK4 + "<worldbody>")
    said = [
        Said("viscous_friction", PIN, {"d": 0.03}),
        Said("inertia_error", PIN, {"dM": 0.01}),
        Said("actuator_gain", DRIVE, {"g": 0.2}),
        Said("quadratic_drag", PIN, {"c_d": 0.004}),
    ]
    found = rod(tmp_path, *said, robot=exact)
    file, model = RobotFile.of(found), found.augmented
    backend = RobotInMujoco(file.found.text, "rod.xml", ["u_drive"], {}, {}, file.found.supplement)
    for recording in (Recording.of(model.logs, 0.2), Recording.whole(model.logs)):
        ours = outputs(model.system, recording)
        assert np.nanmax(np.abs(ours)) > 0.5
        assert off(outputs(model.system, recording, backend), ours) < 1e-9


@pytest.mark.parametrize(
    "actuator",
    [
        'motor name="drive"',
        'position name="drive" kp="2"',
        'general name="drive" dyntype="filter" dynprm="0.02"',
    ],
)
def test_the_lag_of_an_actuator_is_its_activation_in_mujoco(actuator: str, tmp_path: Path) -> None:
    """Windows begin with the lagging input of their first sample. A lag in the file is known physics."""
    text = MJCF.replace("<worldbody>", '<option timestep="0.0001"/><worldbody>')  # of order one in the step
    lag = Said("actuator_lag", DRIVE, {"c_u": 1.0, "T_u": 0.02})
    said = () if "filter" in actuator else (lag,)
    diagnosis = rod(tmp_path, *said, robot=text.replace('motor name="drive"', actuator))
    model = diagnosis.augmented
    home = take_home(diagnosis.system, model.system, diagnosis.effects)
    assert not home.missing and not home.supplement
    assert numbers(compiled(home.text, "rod.xml"))["drive", "timeconst"] == 0.02
    states = home.activations
    backend = RobotInMujoco(home.text, "rod.xml", ["u_drive"], {}, {}, activations=states)
    recording = Recording.of(model.logs, 0.2).thinned(6)
    ours = outputs(model.system, recording)
    awake = outputs(model.system, recording, replace(backend, activations={}))
    assert off(outputs(model.system, recording, backend), ours) < 5e-3 * np.nanmax(np.abs(ours))
    assert off(awake, ours) > 1e-2 * np.nanmax(np.abs(ours))


def test_the_lag_of_an_effort_is_simulated_beside_the_robot(tmp_path: Path) -> None:
    """A URDF has no actuator that could lag."""
    exact = URDF.replace("</robot>", '<mujoco><option timestep="0.0001"/></mujoco></robot>')
    lag = Said("actuator_lag", Place("actuator", "tau_pin"), {"c_u": 1.0, "T_u": 0.02})
    diagnosis = rod(tmp_path, lag, robot=exact)
    model = diagnosis.augmented
    home = take_home(diagnosis.system, model.system, diagnosis.effects)
    backend = RobotInMujoco(home.text, "rod.urdf", [], home.efforts.applied(model.system))
    recording = Recording.of(model.logs, 0.2).thinned(6)
    ours, given = outputs(model.system, recording), diagnosis.known
    assert off(outputs(model.system, recording, backend), ours) < 5e-3 * np.nanmax(np.abs(ours))
    assert off(outputs(given.system, Recording.of(given.logs, 0.2).thinned(6)), ours) > 1e-2


def test_locked_joints_do_not_move_in_mujoco(tmp_path: Path) -> None:
    """The arm above its waist keeps its posture against gravity, and the waist feels its inertia."""
    text = (SYSTEMS / "arm.xml").read_text().replace("<worldbody>", RK4 + "<worldbody>").replace("0.05", "0")
    more = "locked: {shoulder: 0.7, elbow: -0.4}\ninputs: {u_waist: {column: u, hold: true}}\n"
    more += "outputs: {q_waist: {column: pin}}\n"
    system = system_of(tmp_path, text, more)
    write_rod(tmp_path)
    logs = prepare(system, um.read_logs(tmp_path / "logs", system))
    robot, recording = system.robot, Recording.of(logs, 0.2)
    assert robot is not None
    backend = RobotInMujoco(text, "robot.xml", ["u_waist"], {}, robot.locked)
    ours = outputs(system, recording)
    assert np.nanmax(np.abs(ours)) > 0.5 and off(outputs(system, recording, backend), ours) < 1e-8


def test_the_gate_sees_that_friction_and_rotor_were_missing(tmp_path: Path) -> None:
    found = rod(tmp_path, *ALL)
    file = RobotFile.of(found)
    run = file.replay
    assert not file.reason_against(found) and run.supplemented is None
    assert run.patched.gap < 0.2 * run.given.gap
    after, before = run.patched.units["q_pin"], run.given.units["q_pin"]
    assert after.whole_run is not None and before.whole_run is not None
    assert after.whole_run < 0.1 * before.whole_run


@pytest.mark.long
def test_a_sensor_with_a_memory_is_simulated_beside_the_robot(tmp_path: Path) -> None:
    exact = MJCF.replace("<worldbody>", '<option integrator="RK4" timestep="0.001"/><worldbody>')
    lag = Said("sensor_lag", Place("sensor", "q_pin"), {"c_y": 1.0, "T_y": 0.02})
    diagnosis = rod(tmp_path, lag, robot=exact)
    file, model = RobotFile.of(diagnosis), diagnosis.augmented
    (missing,) = file.found.missing
    assert missing.reason == "the sensor is no part of the robot: correct what it shows"
    backend = RobotInMujoco(file.found.text, "rod.xml", ["u_drive"], {}, {})
    recording = Recording.of(model.logs, 0.2)
    ours = outputs(model.system, recording)
    assert off(outputs(model.system, recording, backend), ours) < 1e-3
    assert off(outputs(diagnosis.known.system, Recording.of(diagnosis.known.logs, 0.2)), ours) > 0.05


@pytest.mark.long
def test_a_law_with_a_memory_is_in_the_supplement(tmp_path: Path) -> None:
    bristles = Said("hysteresis", PIN, {"F_h": 0.3, "x_h": 0.002}, "dahl")
    diagnosis = rod(tmp_path, bristles)
    file = RobotFile.of(diagnosis)
    assert [m.supplemented for m in file.found.missing] == [True]
    assert file.found.supplement.rates.keys() == {"z"}
    model = diagnosis.augmented
    recording = Recording.of(model.logs, 0.2)
    backend = RobotInMujoco(file.found.text, "rod.xml", ["u_drive"], {}, {}, file.found.supplement)
    ours = outputs(model.system, recording, substeps=8)
    assert off(outputs(model.system, recording, backend, 8), ours) < 0.02 * np.nanstd(ours)


@pytest.mark.long
def test_the_urdf_lacks_the_rotor_that_its_supplement_holds(tmp_path: Path) -> None:
    found = rod(tmp_path, *OF_URDF, robot=URDF)
    file = RobotFile.of(found)
    run = file.replay
    assert run.supplemented is not None and not file.reason_against(found)
    assert run.supplemented.gap < 0.2 * run.patched.gap
    assert [(m.what, m.supplemented) for m in file.found.missing] == [("pin.armature = 0.008 kg m^2", True)]
    assert numbers(compiled(file.found.text, "rod.urdf"))["pin", "frictionloss"] == pytest.approx(FRICTION)


@pytest.mark.parametrize(
    ("said", "words"),
    [
        (Said("viscous_friction", PIN, {"d": 3.0}), "its gap in MuJoCo is "),
        (Said("linear_spring", PIN, {"k": -60.0}), "its gap in MuJoCo is "),
        (Said("inertia_error", PIN, {"dM": -0.006}), "pin.armature would be -0.004 kg m^2"),
        (Said("viscous_friction", PIN, {"d": -0.02}), "d = -0.02 N m s/rad is below its lowest"),
        (Said("actuator_gain", DRIVE, {"g": -0.97}), "with g = -0.97, actuator gain at "),
    ],
    ids=["worse", "diverges", "armature", "friction", "gain"],
)
def test_what_no_machine_has_and_what_is_worse_is_not_offered(said: Said, words: str, tmp_path: Path) -> None:
    found = rod(tmp_path, said)
    parameters = found.augmented.system.parameters
    if said.family == "actuator_gain":  # as if its limits were wider
        wide = tuple(replace(p, bounds=(-2.0, 2.0)) if p.name == "g" else p for p in parameters)
        model = replace(found.augmented, system=replace(found.augmented.system, parameters=wide))
        found = replace(found, augmented=model)
    refused = offered(found)
    assert isinstance(refused, Refusal) and words in refused.reason
    assert (refused.file, refused.given) == ("robot/rod.xml", "rod.xml")


def test_an_impossible_number_of_the_supplement_is_not_offered(tmp_path: Path) -> None:
    refused = offered(rod(tmp_path, Said("inertia_error", PIN, {"dM": -0.004}), robot=URDF))
    assert isinstance(refused, Refusal)
    assert refused.reason == "pin.armature would be -0.004 kg m^2, which is never negative"


def test_a_file_that_needs_its_supplement_says_so(tmp_path: Path) -> None:
    file = RobotFile.of(rod(tmp_path, *ALL))
    run = file.replay
    alone = replace(file, replay=replace(run, patched=run.given, supplemented=run.patched))
    said, usual = ("\n".join(robot_sentences(each.content)) for each in (alone, file))
    assert "robot/rod.xml alone is no improvement: load it with" in said
    assert "alone is no improvement" in robot_sentence(alone.content)
    assert "alone" not in usual and "alone" not in robot_sentence(file.content)


def test_a_file_without_another_number_is_not_offered(tmp_path: Path) -> None:
    refused = offered(rod(tmp_path))
    assert isinstance(refused, Refusal) and refused.reason == "no number of it differs"


def saved(found: Diagnosis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The answer of the command line, without a search."""
    monkeypatch.setattr(story, "diagnose_gap", lambda *_, **__: found)
    diagnose(tmp_path / "system.yaml", tmp_path / "logs", tmp_path / "answer", found.horizon, 3)
    return tmp_path / "answer"


@pytest.mark.long
def test_answer_and_page_have_the_file_and_its_supplement(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    late = Said("input_delay", Place("actuator", "tau_pin"), {"T_d_tau_pin": 0.01})
    answer = saved(rod(tmp_path, *OF_URDF, late, robot=URDF), tmp_path, monkeypatch)
    robot = read_json(answer / "diagnosis.json")["robot"]
    assert (robot["file"], robot["supplement"]) == ("robot/rod.urdf", "robot/rod_supplement.json")
    assert {p.name for p in (answer / "robot").iterdir()} == {"rod.urdf", "rod_supplement.json"}
    said, page = capsys.readouterr().out, (answer / "index.html").read_text()
    for words in ("pin.frictionloss", "robot files have no delay: apply the input 0.01 s later"):
        assert words in said and words in page
    assert "In MuJoCo, the gap of all experiments is" in page
    assert f"{robot['replay']['supplemented']['gap']:.3g}" in said
    model = mujoco.MjModel.from_xml_path(str(answer / "robot" / "rod.urdf"))
    um.supplement(model, answer / "robot" / "rod_supplement.json")
    assert model.dof_armature[0] == pytest.approx(ROTOR)
    assert model.dof_frictionloss[0] == pytest.approx(FRICTION)


def test_a_robot_file_that_vanished_is_written_as_it_was_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = rod(tmp_path, *ALL)
    system, logs = found.system, um.read_logs(tmp_path / "logs", found.system)
    (tmp_path / "rod.xml").unlink()
    monkeypatch.setattr(story, "diagnose_gap", lambda *_, **__: found)
    um.diagnose(system, logs, found.horizon).save(tmp_path / "answer", pages=False)
    assert "<!-- of a flyer -->" in (tmp_path / "answer" / "robot" / "rod.xml").read_text()


@pytest.mark.long
def test_what_cannot_be_patched_is_a_note_with_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = rod(tmp_path, *ALL)

    def absent(_: Diagnosis) -> RobotFile:
        raise ModuleNotFoundError("No module named 'mujoco'", name="mujoco")

    monkeypatch.setattr(RobotFile, "of", absent)
    content = read_json(saved(found, tmp_path, monkeypatch) / "diagnosis.json")
    assert "robot" not in content and not (tmp_path / "answer" / "robot").exists()
    (note,) = (n for n in content["notes"] if "not patched" in n)
    assert note == 'rod.xml was not patched: mujoco is not installed: pip install "mujoco>=3.3"'


@pytest.mark.long
def test_a_file_that_mujoco_refuses_is_a_note(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = rod(tmp_path, *ALL)
    robot = found.system.robot
    assert robot is not None
    odd = replace(robot, text=MJCF.replace("<joint", '<joint class="missing"'))
    broken = replace(found, system=replace(found.system, robot=odd))
    notes = read_json(saved(broken, tmp_path, monkeypatch) / "diagnosis.json")["notes"]
    (note,) = (n for n in notes if "not patched" in n)
    assert note.startswith("rod.xml was not patched: rod.xml: MuJoCo: ") and "\n" not in note


@pytest.mark.parametrize(
    ("number", "off", "words"),
    [
        ("rod_mass", 0.022, "link rod is 22 g heavier than the 0.8 kg of the robot file"),
        ("rod_mass", -0.022, "link rod is 22 g lighter than the 0.8 kg of the robot file"),
        (
            "rod_com_z",
            -0.0125,
            "centre of mass of link rod is 12.5 mm further along -z than in the robot file",
        ),
        ("rod_inertia_scale", 0.5, "moments of inertia of link rod are 1.5 times those of the robot file"),
        ("pin_armature", 0.001, "pin_armature = 0.003 kg m² instead of 0.002"),
    ],
)
def test_a_wrong_number_of_the_file_is_said_in_words(
    tmp_path: Path, number: str, off: float, words: str
) -> None:
    system_file = write_rod(tmp_path)
    system_file.write_text(f"{system_file.read_text()}parameters: {{{number}: {{}}}}\n")
    system, logs = read_case(tmp_path)
    said = Said("parameter_error", Place("parameter", number), {f"{number}_error": off})
    (found,) = told(system, prepare(system, logs), said).effects
    assert phrase(found, ()).replace("\xa0", " ").replace("−", "-") == words
