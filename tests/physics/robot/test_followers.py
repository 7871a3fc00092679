"""Joints that follow others, and masses that no solid body has: equations, notes, refusals, free runs."""

import os
from pathlib import Path

import mujoco
import numpy as np
import pytest

from tests.machines.folders import changed
from tests.machines.known import Array, refusals
from tests.physics.robot.mechanisms import forward, system_of
from tests.physics.robot.test_motion import rates
from unmodelled.base.errors import BadInput
from unmodelled.diagnosis.answer.take_home import take_home
from unmodelled.engine.free_run import Integration, Windows, free_run
from unmodelled.engine.machine.program import Program
from unmodelled.engine.robot.mujoco_runs import RobotInMujoco
from unmodelled.systems.robot.compile import compiled
from unmodelled.systems.robot.files import DEEPEST, robot_text
from unmodelled.systems.robot.loading import loaded
from unmodelled.systems.robot.numbers import numbers
from unmodelled.systems.robot.patch import patched


def link(name: str, mass: float, scale: float = 1.0) -> str:
    """A link off its joint's axis, with turned axes of inertia."""
    numbers = {"ixx": 0.03, "iyy": 0.02, "izz": 0.025, "ixy": 0.002, "ixz": -0.001, "iyz": 0.0}
    moments = " ".join(f'{key}="{scale * value!r}"' for key, value in numbers.items())
    origin = '<origin xyz="0.05 0.03 -0.2" rpy="0.2 0.1 0.4"/>'
    inertial = f'<inertial>{origin}<mass value="{mass}"/><inertia {moments}/></inertial>'
    return f'<link name="{name}">{inertial}</link>'


def joint(name: str, kind: str, ends: tuple[str, str], axis: str, more: str = "") -> str:
    parent, child = ends
    place = '<origin xyz="0.1 0.05 -0.3" rpy="0.5 0.3 0"/><limit lower="-1" upper="1"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<axis xyz="{axis}"/>{place}{more}</joint>'
    )


SLIDE_FOLLOWS = '<mimic joint="upper" multiplier="0.3" offset="0.05"/>'
UPPER_FOLLOWS = '<mimic joint="lower" multiplier="-1.7" offset="0.4"/>'
#: A follower before its leader in the file, one on top of the other, with a moving link on top of them, and a
#: slide that follows the follower.
CRANE = (
    '<robot name="crane"><link name="base"/>'
    + "".join(link(name, mass) for name, mass in (("a", 0.6), ("b", 0.4), ("c", 0.3), ("d", 0.2)))
    + joint("slide", "prismatic", ("c", "d"), "0 0.6 0.8", f'<dynamics damping="0.7"/>{SLIDE_FOLLOWS}')
    + joint("lower", "revolute", ("base", "a"), "0 1 0", '<dynamics damping="0.2"/>')
    + joint("upper", "revolute", ("a", "b"), "1 0 0", f'<dynamics damping="0.1"/>{UPPER_FOLLOWS}')
    + joint("wrist", "revolute", ("b", "c"), "0 1 0")
    + "</robot>"
)
#: Two fingers of one motor in MJCF, the second with a spring, a rest position and a servo of its own.
FINGERS = """<mujoco><option gravity="1 0 -9.81"/><worldbody>
<body name="left"><joint name="l" axis="0 1 0" armature="0.01" ref="0.2"/>
  <inertial mass="0.3" pos="0.1 0 -0.1" diaginertia="0.002 0.003 0.002"/></body>
<body name="right"><joint name="r" axis="0 1 0" ref="-0.1" stiffness="0.4" springref="0.1" damping="0.05"/>
  <inertial mass="0.2" pos="0.1 0 0.1" diaginertia="0.002 0.003 0.002"/></body></worldbody>
<equality><joint joint1="r" joint2="l" polycoef="0.3 -0.8 0 0 0"/></equality>
<actuator><motor name="m" joint="l" gear="2"/><position name="p" joint="r" kp="3" kv="0.2"/></actuator>
</mujoco>"""


AGAIN = '<joint joint1="r" joint2="l"/>'


def lagrange(text: str, leaders: list[str], y: Array, yd: Array, applied: Array, ctrl: Array) -> Array:
    """Accelerations of the leaders: G^T M G ydd = G^T (efforts), with the mass matrix of the free joints."""
    model, robot = loaded(text, "robot").model, compiled(text, "robot")
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    names = [each.name for each in robot.joints]
    gears, start = np.zeros((len(names), len(leaders))), np.zeros(len(names))
    for k, gear in robot.following({}).items():
        gears[k, leaders.index(names[gear.leader or 0])], start[k] = gear.ratio, gear.offset
    for n, name in enumerate(leaders):
        gears[names.index(name), n] = 1.0
    data = forward(model, gears @ y + start, gears @ yd, ctrl)
    mass = np.empty((len(names), len(names)))
    for k, column in enumerate(np.eye(len(names))):
        mujoco.mj_mulM(model, data, mass[k], column)
    efforts = data.qfrc_passive + data.qfrc_actuator - data.qfrc_bias
    found: Array = np.linalg.solve(gears.T @ mass @ gears, gears.T @ efforts + applied)
    return found


def test_followers_move_by_lagrange_s_equations(tmp_path: Path) -> None:
    system = system_of(tmp_path, CRANE, "", "crane.urdf")
    assert [state.name for state in system.states] == ["q_lower", "q_wrist", "qd_lower", "qd_wrist"]
    assert [each.name for each in system.inputs] == ["tau_lower", "tau_wrist"]
    assert any("joints that follow others (slide, upper) have no coord" in note for note in system.notes)
    rng = np.random.default_rng(0)
    for _ in range(4):
        y, yd, u = rng.normal(size=(3, 2))
        wanted = lagrange(CRANE, ["lower", "wrist"], y, yd, u, np.empty(0))
        assert rates(system, y, yd, u) == pytest.approx(wanted, rel=1e-10)


def test_a_gear_of_an_mjcf_has_springs_and_servos_on_both_sides(tmp_path: Path) -> None:
    system = system_of(tmp_path, FINGERS)
    assert [each.name for each in system.inputs] == ["u_m", "u_p"]
    for seed in range(3):
        q, qd, *u = np.random.default_rng(seed).normal(size=4)
        wanted = lagrange(FINGERS, ["l"], np.array([q]), np.array([qd]), np.zeros(1), np.array(u))
        assert rates(system, np.array([q]), np.array([qd]), np.array(u)) == pytest.approx(wanted, rel=1e-10)


def test_numbers_of_a_follower_are_parameters_and_its_position_an_output(tmp_path: Path) -> None:
    more = "identify: ['d.mass', 'slide.damping']\noutputs: {q_lower: {}, q_slide: {}}\n"
    system = system_of(tmp_path, CRANE, more, "crane.urdf")
    slide = system.outputs[1]
    assert (slide.unit, slide.column) == ("m", "slide")
    assert float(slide.expression.xreplace({system.x[0]: 1.0})) == pytest.approx(0.3 * (-1.7 + 0.4) + 0.05)
    heavier = changed(CRANE, ('damping="0.7"', 'damping="1.4"'), (link("d", 0.2), link("d", 0.3, 0.3 / 0.2)))
    y, yd, u = np.random.default_rng(1).normal(size=(3, 2))
    other = system.with_values({"d_mass": 0.3, "slide_damping": 1.4})
    wanted = lagrange(heavier, ["lower", "wrist"], y, yd, u, np.empty(0))
    assert rates(other, y, yd, u) == pytest.approx(wanted, rel=1e-10)


@pytest.mark.parametrize("locked", ["{upper: 0.3}", "{lower: 0.5}"])
def test_a_locked_joint_follows_no_other_and_is_followed(tmp_path: Path, locked: str) -> None:
    """The lock of a follower leaves its leader free; that of a leader stops its followers."""
    system = system_of(tmp_path, CRANE, f"locked: {locked}\n", "crane.urdf")
    assert system.robot is not None
    if "upper" in locked:
        assert system.robot.locked == pytest.approx({"upper": 0.3, "slide": 0.3 * 0.3 + 0.05})
        assert any("upper: locked, so that it follows no other joint" in note for note in system.notes)
    else:
        upper = 0.4 - 1.7 * 0.5
        wanted = {"lower": 0.5, "upper": upper, "slide": 0.3 * upper + 0.05}
        assert system.robot.locked == pytest.approx(wanted)
    without = changed(CRANE, (SLIDE_FOLLOWS, ""), (UPPER_FOLLOWS, ""))
    each = ", ".join(f"{name}: {value!r}" for name, value in system.robot.locked.items())
    (tmp_path / "free").mkdir()
    free = system_of(tmp_path / "free", without, f"locked: {{{each}}}\n", "crane.urdf")
    assert system.dynamics == free.dynamics


@pytest.mark.long
def test_mujoco_runs_a_robot_with_followers_as_the_equations_do(tmp_path: Path) -> None:
    """The replay of an answer, of a patched file that keeps its gears."""
    system = system_of(tmp_path, CRANE, "identify: ['d.mass']\n", "crane.urdf")
    assert system.robot is not None
    home = take_home(system, system.with_values({"d_mass": 0.25}), [])
    assert {c.element for c in home.changes} == {"d"} and home.changes[0].quantity == "mass"
    assert all(c.patched == pytest.approx(1.25 * c.given) for c in home.changes)
    assert home.text.count("<mimic") == 2
    t, nothing = np.arange(0.0, 0.5, 0.01), np.zeros(1, np.int64)
    u = np.stack([np.sin(5 * t), 0.3 * np.cos(3 * t)], 1)
    windows = Windows(u, t, nothing, nothing + len(t) - 1, nothing, nothing)
    given = np.array([[[0.25]]]), np.empty((1, 0)), np.array([[[0.2, -0.3, 0.0, 0.0]]])
    how = Integration(0.01, "rk4", 10)
    robot = RobotInMujoco(home.text, "crane.urdf", [], home.efforts.applied(system), system.robot.locked)
    ours = free_run(Program.of(system, system.x), windows, *given, how)
    theirs = free_run(robot(system, system.x), windows, *given, how)
    assert np.max(np.abs(ours[0, 0, -1])) > 0.1
    assert np.max(np.abs(theirs - ours)) < 0.02 * np.max(np.abs(ours))


def test_a_patched_file_keeps_its_gears(tmp_path: Path) -> None:
    found = numbers(compiled(FINGERS, "fingers.xml"))
    file = patched(FINGERS, "fingers.xml", {**found, ("r", "damping"): 0.3, ("left", "mass"): 0.5})
    assert not file.missing and "polycoef" in file.text
    assert compiled(file.text, "fingers.xml").following({}) == compiled(FINGERS, "fingers.xml").following({})


@pytest.mark.parametrize(
    ("robot", "old", "new", "words"),
    [
        (CRANE, 'joint="lower"', 'joint="slide"', "follows itself: remove one of the gears"),
        (CRANE, 'joint="lower"', 'joint="lowr"', "joint 'upper': mimic: the file has no joint 'lowr'"),
        (CRANE, '"-1.7"', '"many"', "joint 'upper': mimic multiplier: must be a finite number, got"),
        (FINGERS, "-0.8 0", "-0.8 0.1", "joint 'r': follows another joint by a curve"),
        (FINGERS, "</equality>", f"{AGAIN}</equality>", "joint 'r': follows two joints"),
    ],
)
def test_gears_that_have_no_equations_are_refused(robot: str, old: str, new: str, words: str) -> None:
    (message,) = refusals(lambda: compiled(changed(robot, (old, new)), "robot.xml"))
    assert words in message and len(message) < 200


def test_a_joint_that_follows_a_fixed_one_stands_still() -> None:
    robot = compiled(CRANE.replace('name="lower" type="revolute"', 'name="lower" type="fixed"'), "crane")
    upper = [joint.name for joint in robot.joints].index("upper")
    assert robot.resting({})[upper] == 0.4


def test_a_gripper_that_no_input_names_stands_still(tmp_path: Path) -> None:
    """Logs of an arm have no column of its gripper."""
    grip = joint("grip", "prismatic", ("d", "finger"), "0 1 0")
    thumb = joint("thumb", "prismatic", ("d", "other"), "0 1 0", '<mimic joint="grip" multiplier="-1"/>')
    text = CRANE.replace("</robot>", f"{link('finger', 0.1)}{link('other', 0.1)}{grip}{thumb}</robot>")
    more = "inputs: {tau_lower: {}, tau_wrist: {}}\n"
    system = system_of(tmp_path, text, more, "crane.urdf")
    assert system.robot is not None and system.robot.locked == {"grip": 0.0, "thumb": 0.0}
    assert any("grip are in no input and no output" in note for note in system.notes)
    with pytest.raises(BadInput, match="the input 'tau_grip' of the robot is missing"):
        system_of(tmp_path, text, f"{more}outputs: {{q_grip: {{}}}}\n", "crane.urdf")


#: Mass and all six numbers of the inertia alike, as exporters write it: no body has these.
ALIKE = " ".join(f'i{axes}="0.01"' for axes in ("xx", "yy", "zz", "xy", "xz", "yz"))
PLACEHOLDER = f'<inertial><mass value="0.01"/><inertia {ALIKE}/></inertial>'


NONE = 'ixx="0" iyy="0" izz="0"'


def slider(rail: str = "", tool: str = "", base: str = "", inertia: str = NONE) -> str:
    """A carriage on a rail with a rod that hangs from it, and a tool at the end of the rod."""
    rod = f'<inertial><origin xyz="0 0 -0.5"/><mass value="2"/><inertia {inertia}/></inertial>'
    return f"""<robot name="slider"><link name="base">{base}</link><link name="rail">{rail}</link>
    <link name="car"><inertial><mass value="3"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial></link>
    <link name="rod">{rod}</link><link name="tool">{tool}</link>
    <joint name="stand" type="fixed"><parent link="base"/><child link="rail"/></joint>
    <joint name="x" type="prismatic"><parent link="rail"/><child link="car"/><axis xyz="1 0 0"/></joint>
    <joint name="swing" type="continuous"><parent link="car"/><child link="rod"/><axis xyz="0 1 0"/></joint>
    <joint name="grip" type="continuous"><parent link="rod"/><child link="tool"/><axis xyz="0 0 1"/></joint>
    </robot>"""


def test_placeholders_of_links_that_do_not_move_are_not_used(tmp_path: Path) -> None:
    (tmp_path / "plain").mkdir()
    plain = system_of(tmp_path / "plain", slider(), "", "slider.urdf")
    system = system_of(tmp_path, slider(rail=PLACEHOLDER, base=PLACEHOLDER), "", "slider.urdf")
    assert system.dynamics == plain.dynamics
    assert any("masses and inertias of base, rail are not used: these links" in n for n in system.notes)


def test_a_last_link_without_mass_stands_still(tmp_path: Path) -> None:
    system = system_of(tmp_path, slider(), "", "slider.urdf")
    assert system.port_names == ("x", "swing")
    assert any("joints that move no mass (grip) stand still at 0: to" in note for note in system.notes)
    assert system.robot is not None and system.robot.locked == {"grip": 0.0}
    # a mass on the axis of its joint turns nothing either, and one beside it does
    on_axis = '<inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0"/></inertial>'
    assert compiled(slider(tool=on_axis), "slider.urdf").massless == (2,)
    beside = on_axis.replace("<mass", '<origin xyz="0 0.1 0"/><mass')
    assert compiled(slider(tool=beside), "slider.urdf").massless == ()


def test_a_file_that_names_a_last_link_without_mass_is_read(tmp_path: Path) -> None:
    """All joints of an arm are logged, though the file of the robot knows no mass of the last link."""
    more = "inputs: {tau_x: {}, tau_swing: {}, tau_grip: {column: i3}}\noutputs: {q_x: {}, q_grip: {}}\n"
    more += "parameters: {grip_armature: {value: 0.1}}\nports: {grip: {law: 0.1*qd_grip}}\n"
    system = system_of(tmp_path, slider(), more, "slider.urdf")
    assert [each.name for each in system.inputs] == ["tau_x", "tau_swing"]
    assert [each.name for each in system.outputs] == ["q_x"] and system.port_names == ("x", "swing")
    (note,) = [note for note in system.notes if "not used" in note]
    names = "inputs.tau_grip, outputs.q_grip, parameters.grip_armature, ports.grip"
    assert note.endswith(f"{names}: not used, because its joint stands still")


def test_another_input_of_the_name_of_a_joint_that_stands_still_stays(tmp_path: Path) -> None:
    more = "inputs: {tau_x: {}, tau_grip: {unit: N m}}\nsignals: {drive_swing: 0.5*tau_grip}\n"
    system = system_of(tmp_path, slider(), more, "slider.urdf")
    assert [each.name for each in system.inputs] == ["tau_x", "tau_grip"]


#: A hand of two fingers that no gear connects, on the wrist of the crane.
FINGERED = CRANE.replace(
    "</robot>",
    link("f", 0.1)
    + link("g", 0.1)
    + joint("left", "prismatic", ("d", "f"), "0 1 0")
    + joint("right", "prismatic", ("d", "g"), "0 -1 0")
    + "</robot>",
)


def test_fingers_that_a_file_does_not_name_stand_still(tmp_path: Path) -> None:
    """Neither inputs nor outputs name them; a joint on the way to one that is named moves."""
    more = "inputs: {tau_lower: {}, tau_wrist: {}}\noutputs: {q_lower: {}, q_wrist: {}}\n"
    system = system_of(tmp_path, FINGERED, more, "crane.urdf")
    assert system.robot is not None and system.robot.locked == {"left": 0.0, "right": 0.0}
    (note,) = [note for note in system.notes if "are in no input and no output" in note]
    assert "left, right are" in note
    with pytest.raises(BadInput, match="the input 'tau_lower' of the robot is missing"):
        system_of(
            tmp_path, FINGERED, more.replace("tau_lower: {}, ", "").replace("q_lower: {}, ", ""), "crane.urdf"
        )


def test_a_servo_that_a_file_does_not_name_stands_still(tmp_path: Path) -> None:
    tool = FINGERS.replace("<equality>", "<!-- <equality>").replace("</equality>", "</equality> -->")
    system = system_of(tmp_path, tool, "inputs: {u_m: {}}\noutputs: {q_l: {}}\n")
    assert system.port_names == ("l",) and any("r are in no input" in note for note in system.notes)


def test_a_rod_without_inertia_of_its_own_is_a_mass_on_a_string(tmp_path: Path) -> None:
    """A point mass m at length l below a carriage M: closed form of the crane."""
    system = system_of(tmp_path, slider(), "", "slider.urdf")
    big, m, length, q, qd, u = 3.0, 2.0, 0.5, 0.7, 1.3, 0.4
    c, s = np.cos(q), np.sin(q)
    mass = np.array([[big + m, -m * length * c], [-m * length * c, m * length**2]])
    efforts = np.array([u - m * length * s * qd**2, -m * 9.81 * length * s])
    found = rates(system, np.array([0.1, q]), np.array([0.0, qd]), np.array([u, 0.0]))
    assert found == pytest.approx(np.linalg.solve(mass, efforts), rel=1e-12)


def test_inertias_of_no_solid_body_are_used_as_written(tmp_path: Path) -> None:
    text = slider(inertia='ixx="0.01" iyy="0.3" izz="0.02"')
    system = system_of(tmp_path, text, "", "slider.urdf")
    note = next(note for note in system.notes if "no solid body" in note)
    assert "the inertias of rod are those of no solid body: they are used as written" in note
    assert numbers(compiled(text, "slider.urdf"))["rod", "inertia_yy"] == 0.3
    file = patched(text, "slider.urdf", {("rod", "inertia_yy"): 0.4, ("rod", "mass"): 1.9})
    assert not file.missing and numbers(compiled(file.text, "slider.urdf"))["rod", "inertia_yy"] == 0.4


def test_inertias_are_those_that_mujoco_reads() -> None:
    """Turned axes and off-diagonal numbers, of links that MuJoCo accepts too."""
    text = CRANE.replace("<mimic", "<removed").replace("</robot>", "<mujoco><compiler/></mujoco></robot>")
    model = mujoco.MjModel.from_xml_string(text.replace("<compiler/>", '<compiler fusestatic="false"/>'))
    robot = compiled(text, "crane.urdf")
    for k, body in enumerate(robot.bodies, start=1):
        axes = np.empty(9)
        mujoco.mju_quat2Mat(axes, model.body_iquat[k])
        turned = axes.reshape(3, 3)
        wanted = turned @ np.diag(model.body_inertia[k]) @ turned.T
        assert body.inertia == pytest.approx(wanted, abs=1e-12)
        assert (body.mass, *body.com) == pytest.approx((model.body_mass[k], *model.body_ipos[k]))


def test_what_mujoco_mends_in_a_urdf_is_mended() -> None:
    options = 'balanceinertia="true" boundmass="0.05" boundinertia="0.001"'
    mended = ("</robot>", f"<mujoco><compiler {options}/></mujoco></robot>")
    text = changed(slider(inertia='ixx="0.01" iyy="0.3" izz="0.02"'), mended)
    robot = compiled(text, "slider.urdf")
    assert numbers(robot)["rod", "inertia_xx"] == pytest.approx(0.11)
    assert numbers(robot)["tool", "mass"] == 0.05 and robot.massless == ()


HINGE = """<mujoco><worldbody><body name="rod"><joint name="pin" axis="0 1 0"/>
<inertial mass="1" pos="0 0 -0.1" diaginertia="0.01 0.01 0.01"/></body></worldbody></mujoco>"""
DEEP = changed(HINGE, ("<body", "<frame>" * 990 + "<body"), ("</body>", "</body>" + "</frame>" * 990))


@pytest.mark.parametrize(
    ("robot", "old", "new", "words"),
    [
        (HINGE, 'mass="1"', 'mass="inf"', "body 'rod': its mass is not a finite number"),
        (HINGE, 'axis="0 1 0"', 'axis="0 1 0" armature="nan"', "'pin': its armature is not a finite"),
        (DEEP, "", "", f"at most {DEEPEST} elements inside each other are read"),
        (HINGE, "<worldbody>", '<Include file="/etc/passwd"/><worldbody>', "Include: cannot be followed"),
        (slider(), NONE, 'ixx="inf" iyy="0" izz="0"', "link 'rod': inertia ixx: must be a finite number"),
        (slider(), NONE, 'ixx="0" iyy="0"', "link 'rod': inertia has no izz: add it"),
        (slider(), NONE, 'ixx="0" iyy="-3" izz="0"', "joint 'swing': what it moves has no positive inertia"),
        (slider(), 'value="2"', 'value="-2"', "link 'rod': has -2 kg: a mass must not be negative"),
        (slider(), '<parent link="rail"/>', "", "joint 'x': has no parent or no child"),
        (slider(), '<child link="tool"/>', '<child link="tol"/>', "the file has no link 'tol', its child"),
        (slider(), 'name="x" type="prismatic"', 'name="x" type="floating"', "write type fixed (the base"),
    ],
)
def test_robots_without_a_motion_are_refused_in_one_line(robot: str, old: str, new: str, words: str) -> None:
    (message,) = refusals(lambda: compiled(changed(robot, (old, new)), "robot"))
    assert words in message and len(message) < 200


def test_devices_and_pipes_are_no_robot_files(tmp_path: Path) -> None:
    pipe = tmp_path / "robot.urdf"
    os.mkfifo(pipe)
    for path in (Path("/dev/zero"), pipe):
        with pytest.raises(BadInput, match="not a regular file"):
            robot_text(path)
    large = tmp_path / "large.urdf"
    large.write_bytes(b" " * 10_000_001)
    with pytest.raises(BadInput, match="has more than 10000000 bytes"):
        robot_text(large)


def test_a_robot_that_moves_nothing_is_refused(tmp_path: Path) -> None:
    arm = slider().replace('<mass value="3"/>', '<mass value="0"/>').replace('<mass value="2"/>', "")
    arm = arm.replace('"0.1"', '"0"').replace("<inertial><origin", "<inertial><mass value='0'/><origin")
    with pytest.raises(BadInput, match="no joint moves a mass, so that nothing moves"):
        system_of(tmp_path, arm, "", "slider.urdf")
