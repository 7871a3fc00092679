"""System files with a robot: defaults, overrides, refusals, and what is written."""

import pickle
from pathlib import Path

import pytest
import sympy as sp

from pipeline.chapters.equations import equations
from tests.machines.folders import changed
from tests.machines.known import refusals, written_again
from tests.physics.robot.mechanisms import random_tree, system_of
from unmodelled import BadInput, read_system, write_system
from unmodelled.systems.model import System, symbol
from unmodelled.systems.procedure import expanded

ARM = """<robot name="arm">
<link name="base"/>
<joint name="shoulder-pan" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="5" velocity="3"/><dynamics damping="0.2" friction="0.1"/></joint>
<link name="upper"><inertial><origin xyz="0 0 -0.2"/><mass value="0.6"/>
<inertia ixx="0.03" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><mesh filename="package://arm/upper.stl"/></geometry></visual></link>
<joint name="elbow" type="prismatic"><parent link="upper"/><child link="tip"/><axis xyz="0 0 1"/>
<limit lower="0" upper="1" effort="5" velocity="3"/></joint>
<link name="tip"><inertial><mass value="0.3"/>
<inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"""
SERVO = """<mujoco><default><joint armature="0.01" damping="0.1" frictionloss="0.2"/></default><worldbody>
<body name="rod"><joint name="1" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.02"/>
</body></worldbody><actuator><position name="1" joint="1" kp="8" kv="0.5" forcerange="-3 3"/></actuator>
</mujoco>"""


def arm(folder: Path, more: str = "") -> System:
    return system_of(folder, ARM, more, "arm.urdf")


def refused(folder: Path, robot: str, more: str = "") -> str:
    message = refusals(lambda: system_of(folder, robot, more))[0]
    assert message.isprintable() and len(message) < 500
    return message.replace(f"{folder}/", "")


def test_numbers_of_the_robot_can_be_added_to_a_written_file(tmp_path: Path) -> None:
    inputs = "inputs: {i: {unit: A}, tau_elbow: {}}"
    drive = "parameters: {k: {value: 2, unit: N m/A}}\nsignals: {drive_shoulder_pan: k*i}"
    system = arm(tmp_path, f"{inputs}\n{drive}")
    path = tmp_path / "written.yaml"
    write_system(system, path)
    text = path.read_text()
    assert "acceleration_" not in text and "dynamics" not in text
    assert read_system(path) == system
    path.write_text(text.replace("parameters:\n", "parameters:\n  tip_mass: {unit: kg}\n"))
    assert {p.name: p.value for p in read_system(path).parameters} == {"tip_mass": 0.3, "k": 2.0}


def test_a_urdf_gives_states_torques_and_measured_positions(tmp_path: Path) -> None:
    system = arm(tmp_path)
    units = {"q_shoulder_pan": "rad", "q_elbow": "m", "qd_shoulder_pan": "rad/s", "qd_elbow": "m/s"}
    assert [(s.name, s.unit) for s in system.states] == [*units.items()]
    drives = [(u.name, u.unit, u.column) for u in system.inputs]
    assert drives == [("tau_shoulder_pan", "N m", "tau_shoulder_pan"), ("tau_elbow", "N", "tau_elbow")]
    sensors = [(y.name, y.column) for y in system.outputs]
    assert sensors == [("q_shoulder_pan", "shoulder-pan"), ("q_elbow", "elbow")]
    port = system.port("elbow")
    known = port.effort, port.unit, port.load, *port.coordinates
    assert known == ("load_elbow", "N", "drive_elbow", "q_elbow", "qd_elbow")
    assert system.text["signals.torque_shoulder_pan"] == "drive_shoulder_pan - 0.2*qd_shoulder_pan"
    assert system.parameters == ()
    friction, limits = system.notes
    assert "friction" in friction and "shoulder-pan" in friction and "elbow" not in friction
    assert "limits of shoulder-pan, elbow" in limits


def test_an_mjcf_gives_the_laws_of_its_servos(tmp_path: Path) -> None:
    system = system_of(tmp_path, SERVO, "identify: ['*.armature', '*.k[pv]']\n")
    assert [(u.name, u.unit) for u in system.inputs] == [("u_j1", "rad")]
    assert system.text["signals.drive_j1"] == "clip(j1_kp*(u_j1 - q_j1) - j1_kv*qd_j1, -3.0, 3.0)"
    assert {p.name: (p.value, p.unit, p.limits) for p in system.parameters} == {
        "j1_armature": (0.01, "kg m^2", (0.005, 0.02)),
        "j1_kp": (8.0, "N m/rad", (4.0, 16.0)),
        "j1_kv": (0.5, "N m s/rad", (0.25, 1.0)),
    }


def test_what_moves_nothing_is_not_read(tmp_path: Path) -> None:
    assets = '<asset><mesh name="m" file="/none.stl"/><material name="paint"/></asset>'
    shapes = '<geom type="mesh" mesh="m"/><frame><geom type="mesh" mesh="m" material="paint"/></frame>'
    shown = '<site name="s"/><camera name="c"/><geom type="capsule" material="paint"'
    world = ("<worldbody>", f"{assets}<worldbody>{shapes}")
    robot = changed(SERVO, world, ('<geom type="capsule"', shown))
    assert system_of(tmp_path, robot).dynamics == system_of(tmp_path, SERVO).dynamics


def test_a_servo_with_a_time_constant_has_its_activation_as_a_state(tmp_path: Path) -> None:
    slow = SERVO.replace('kv="0.5"', 'kv="0.5" timeconst="0.1" ctrlrange="-1 1"')
    system = system_of(tmp_path, slow, "identify: ['*.timeconst']\n")
    assert [s.name for s in system.states] == ["q_j1", "qd_j1", "act_j1"]
    assert str(system.states[-1].initial) == "minimum(maximum(u_j1, -1.0), 1.0)"
    assert system.text["dynamics.act_j1"] == "(clip(u_j1, -1.0, 1.0) - act_j1)/j1_timeconst"
    assert system.text["signals.drive_j1"] == "clip(8.0*(act_j1 - q_j1) - 0.5*qd_j1, -3.0, 3.0)"
    assert [(p.name, p.value, p.unit) for p in system.parameters] == [("j1_timeconst", 0.1, "s")]
    # a torque of the system file has no servo
    assert len(system_of(tmp_path, slow, "signals: {drive_j1: 2*i}\ninputs: {i: {unit: N m}}\n").states) == 2


def test_what_simulators_and_ros_add_to_a_urdf_is_not_read(tmp_path: Path) -> None:
    plugin = '<gazebo><plugin name="ros_control" filename="libgazebo_ros_control.so"/></gazebo>'
    transmission = '<transmission name="t"><joint name="elbow"/><actuator name="m"/></transmission>'
    with_more = ARM.replace("</robot>", f"{plugin}{transmission}</robot>")
    (tmp_path / "plain").mkdir()
    assert system_of(tmp_path, with_more, "", "arm.urdf").dynamics == arm(tmp_path / "plain").dynamics


def test_force_limits_of_joints_are_noted(tmp_path: Path) -> None:
    robot = SERVO.replace('name="1" axis', 'name="1" actuatorfrcrange="-1 1" axis')
    assert any("force limits (actuatorfrcrange) of 1" in note for note in system_of(tmp_path, robot).notes)


def test_entries_of_the_file_replace_those_of_the_robot(tmp_path: Path) -> None:
    system = arm(
        tmp_path,
        "inputs: {i: {unit: A}, tau_elbow: {column: F2}}\n"
        "outputs: {qd_elbow: {}, q_elbow: {column: travel}}\n"
        "parameters: {k: {value: 3.0, unit: N m/A}, upper_mass: {identify: true, bounds: [0.5, 0.7]}}\n"
        "signals: {drive_shoulder_pan: k*i}\n"
        "ports: {elbow: {law: 0.4*sign(qd_elbow)}}\n",
    )
    assert [(u.name, u.unit, u.column) for u in system.inputs] == [("i", "A", "i"), ("tau_elbow", "N", "F2")]
    sensors = [(y.name, y.unit, y.column) for y in system.outputs]
    assert sensors == [("qd_elbow", "m/s", "qd_elbow"), ("q_elbow", "m", "travel")]
    assert {p.name: p.value for p in system.parameters} == {"upper_mass": 0.6, "k": 3.0}
    assert system.uncertain == ("upper_mass",)
    k, i, speed = map(symbol, ("k", "i", "qd_shoulder_pan"))
    assert system.signals["torque_shoulder_pan"] == k * i - 0.2 * speed
    assert system.port("elbow").law is not None
    assert symbol("load_elbow") in system.dynamics[3].free_symbols


def test_accelerations_and_mobilities_are_functions_of_expressions(tmp_path: Path) -> None:
    more = "outputs: {q_elbow: {}, m: {unit: 1/kg, expression: 'mobility_elbow()'}}\n"
    system = arm(tmp_path, more)
    effort = symbol("load_elbow")
    assert sp.diff(system.dynamics[3], effort) == -system.outputs[1].expression
    assert written_again(system, tmp_path) == system


def test_a_locked_joint_has_no_states_and_no_input(tmp_path: Path) -> None:
    system = arm(tmp_path, "locked: {shoulder-pan: 0.3}\n")
    assert [s.name for s in system.states] == ["q_elbow", "qd_elbow"]
    assert [u.name for u in system.inputs] == ["tau_elbow"]
    weight = system.dynamics[1].xreplace({symbol("load_elbow"): 0, symbol("tau_elbow"): 0})
    steps, (value,) = expanded([weight])
    assert not steps
    assert float(value) == pytest.approx(-9.81 * 0.9553364891, rel=1e-9)


def test_numbers_without_influence_are_not_identified(tmp_path: Path) -> None:
    system = arm(tmp_path, "locked: {elbow: 0.1}\nidentify: ['upper.inertia_??']\n")
    assert system.uncertain == ("upper_inertia_yy",)
    assert any("upper_inertia_xx has no influence" in note for note in system.notes)
    zeros = next(note for note in system.notes if "are 0" in note)
    assert "upper_inertia_xy, upper_inertia_xz, upper_inertia_yz are 0 in the robot file" in zeros


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 3])
def test_what_is_written_is_read_back(tmp_path: Path, seed: int) -> None:
    more = "locked: {j2a: 0.1}\nidentify: ['*.armature', 'b1.mass']\n"
    system = system_of(tmp_path, random_tree(seed), more)
    write_system(system, tmp_path / "copy.yaml")
    again = read_system(tmp_path / "copy.yaml")
    assert again == system
    assert (tmp_path / "copy_robot.xml").read_text() == (tmp_path / "robot.xml").read_text()
    assert all(note.startswith("copy_robot.xml: ") for note in again.notes[:1])
    shown = equations(system)
    assert all(each.mathml.startswith("<math") for each in shown)
    assert sum("acceleration" in each.text for each in shown) == len(system.ports)


def test_a_system_with_a_robot_can_go_to_another_process(tmp_path: Path) -> None:
    system = arm(tmp_path)
    assert pickle.loads(pickle.dumps(system)) == system


LINK = '<body><joint axis="1 0 0"/><geom size="0.1"/></body>'
FREE = """<mujoco><worldbody><body name="box"><freejoint name="fly"/><geom size="0.1"/></body></worldbody>
</mujoco>"""


GEOM = '<geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.02"/>'
INCLUDE = '<include file="/etc/passwd"/>'
WELD = '<equality><weld name="e" body1="rod"/></equality>'
PLUGIN = '<extension><plugin plugin="a"/></extension>'
DRIVE = '<position name="1" joint="1" kp="8"'
STATE = '<intvelocity name="1" joint="1" actrange="-1 1" kp="8"'
FILTER = '<general name="1" joint="1" dyntype="filter" actrange="-1 1"'
CHAIN = LINK.replace("</body>", "") * 60 + "</body>" * 60
DOCTYPE = '<!DOCTYPE a [<!ENTITY b SYSTEM "/etc/passwd">]><robot name="r">&b;</robot>'
AXIS = '<axis xyz="0 0 1"/>'
STILL = "a free joint: has no equations here: remove it (the body then stands still)"
#: Robot files with other words in place of some, and what is said of them.
REFUSED = [
    (FREE, FREE, "<mujoco>", "robot.xml: line 1: not an XML file"),
    (FREE, FREE, "<sdf/>", "must begin with <mujoco> (MJCF) or <robot> (URDF), got <sdf>"),
    (FREE, FREE, DOCTYPE, "has no DOCTYPE"),
    (FREE, FREE, FREE, f"joint 'fly': {STILL}"),
    (FREE, 'freejoint name="fly"', 'joint name="b" type="ball"', "joint 'b': a ball joint: has"),
    (FREE, '<freejoint name="fly"/>', "", "has no joint"),
    (SERVO, "<worldbody>", f"{INCLUDE}<worldbody>", "include: cannot be followed: copy"),
    (SERVO, "<worldbody>", f"{PLUGIN}<worldbody>", "remove the plugin"),
    (SERVO, "<geom", f"{'<body/>' * 1001}<geom", "bodies, at most 1000 are read"),
    (SERVO, "<geom", f"{LINK * 140}<geom", "has 141 joints, at most 128 are read"),
    (
        SERVO,
        "<geom",
        f"{CHAIN}<geom",
        "has 61 joints between the base and it, at most 50 are read: fix some of them",
    ),
    (SERVO, "<actuator>", f"{WELD}<actuator>", "equality weld 'e': a closed chain"),
    (SERVO, DRIVE, STATE, "actuator '1': has a state of its own"),
    (SERVO, f'{DRIVE} kv="0.5"', FILTER, "actuator '1': limits its activation (actrange)"),
    (SERVO, GEOM, '<geom type="mesh" mesh="m"/>', "body 'rod': its mass comes from a mesh"),
    (SERVO, 'name="rod"', 'name="rod" gravcomp="1"', "body 'rod': has gravity compensation"),
    (SERVO, 'size="0.02"', 'size="big"', "MuJoCo: "),
    (ARM, "<inertial><origin", f"<inertial>{INCLUDE}<origin", "include: cannot be followed"),
    (ARM, 'type="prismatic"', 'type="floating"', "joint 'elbow': of type floating"),
    (
        *(ARM, AXIS, f'{AXIS}<mimic joint="shoulder-pam"/>'),
        "joint 'elbow': mimic: the file has no joint 'shoulder-pam': correct the name",
    ),
    (ARM, 'name="elbow"', 'name="shoulder_pan"', "has the same name as 'shoulder-pan': rename one of them"),
]


@pytest.mark.parametrize(("robot", "old", "new", "words"), REFUSED)
def test_what_the_equations_cannot_follow_is_refused(
    tmp_path: Path, robot: str, old: str, new: str, words: str
) -> None:
    message = refused(tmp_path, changed(robot, (old, new)))
    assert words in message and message.startswith("robot.xml: ")


#: Entries of a system file with a robot, and what is said of them.
WRONG = {
    "locked: {elbo: 0}\n": "line 4: locked.elbo: the robot has no joint 'elbo'; did you mean 'elbow'?",
    "locked: {elbow: 0, shoulder-pan: 0}\n": "line 4: locked: all joints are locked",
    "identify: ['*.mas']\n": "line 4: identify[0]: names no number of the robot",
    "identify: ['*.armature']\n": "identify[0]: is 0 in the robot file",
    "inputs: {tau_elbow: {}}": "line 4: inputs: the input 'tau_shoulder_pan' of the robot is missing: add it",
    "events: {e: {expression: q_elbow}}": "line 4: events: a system with a robot has no events",
    "dynamics: {qd_elbow: acceleration_elbow(1.0)}": "'acceleration_elbow' takes 2 arguments "
    "(torque_shoulder_pan, torque_elbow), got 1",
    "dynamics: {qd_elbow: 'acceleration_elbow(q_elbow, tau_elbow)'}": "q_elbow': unit must be N m, got m",
    "signals: {drive_elbow: acceleration_elbow}": "'acceleration_elbow' is a function",
}


@pytest.mark.parametrize(("more", "words"), WRONG.items())
def test_wrong_entries_name_their_line(tmp_path: Path, more: str, words: str) -> None:
    assert words in refused(tmp_path, ARM, more)


def test_a_robot_file_lies_beside_the_system_file(tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    for name, words in (("../arm.urdf", "must lie in the folder"), ("none.urdf", "no such file beside")):
        file.write_text(f"schema: system/1\nname: robot\nmodel: {name}\n")
        with pytest.raises(BadInput, match=words):
            read_system(file)
    file.write_text("schema: system/1\nname: robot\nlocked: {a: 1}\n")
    with pytest.raises(BadInput, match="belongs to a robot: add model"):
        read_system(file)
