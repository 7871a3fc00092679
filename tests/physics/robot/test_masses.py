"""Masses and inertias that no solid body has: what is read with a note, and what is refused."""

from __future__ import annotations

import os
from pathlib import Path

import mujoco
import numpy as np
import pytest

from tests.physics.robot.mechanisms import system_of
from tests.physics.robot.test_followers import CRANE
from tests.physics.robot.test_motion import rates
from unmodelled.base.errors import BadInput
from unmodelled.systems.robot.compile import compiled
from unmodelled.systems.robot.files import DEEPEST, robot_text
from unmodelled.systems.robot.numbers import numbers
from unmodelled.systems.robot.patch import patched

#: Mass and all six numbers of the inertia alike, as exporters write it: no body has these.
ALIKE = " ".join(f'i{axes}="0.01"' for axes in ("xx", "yy", "zz", "xy", "xz", "yz"))
PLACEHOLDER = f'<inertial><mass value="0.01"/><inertia {ALIKE}/></inertial>'


def slider(rail: str = "", tool: str = "", base: str = "", inertia: str = 'ixx="0" iyy="0" izz="0"') -> str:
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
    mended = (
        '<mujoco><compiler balanceinertia="true" boundmass="0.05" boundinertia="0.001"/></mujoco></robot>'
    )
    text = slider(inertia='ixx="0.01" iyy="0.3" izz="0.02"').replace("</robot>", mended)
    robot = compiled(text, "slider.urdf")
    assert numbers(robot)["rod", "inertia_xx"] == pytest.approx(0.11)
    assert numbers(robot)["tool", "mass"] == 0.05 and robot.massless == ()


HINGE = """<mujoco><worldbody><body name="rod"><joint name="pin" axis="0 1 0"/>
<inertial mass="1" pos="0 0 -0.1" diaginertia="0.01 0.01 0.01"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize(
    ("robot", "words"),
    [
        (HINGE.replace('mass="1"', 'mass="inf"'), "body 'rod': its mass is not a finite number"),
        (HINGE.replace('axis="0 1 0"', 'axis="0 1 0" armature="nan"'), "'pin': its armature is not a finite"),
        (slider(inertia='ixx="inf" iyy="0" izz="0"'), "link 'rod': inertia ixx: must be a finite number"),
        (slider(inertia='ixx="0" iyy="0"'), "link 'rod': inertia has no izz: add it"),
        (slider(inertia='ixx="0" iyy="-3" izz="0"'), "joint 'swing': what it moves has no positive inertia"),
        (slider().replace('value="2"', 'value="-2"'), "link 'rod': has -2 kg: a mass must not be negative"),
        (slider().replace('<parent link="rail"/>', ""), "joint 'x': has no parent or no child"),
        (
            slider().replace('<child link="tool"/>', '<child link="tol"/>'),
            "the file has no link 'tol', its child",
        ),
        (
            slider().replace('name="x" type="prismatic"', 'name="x" type="floating"'),
            "write type fixed (the base",
        ),
        (
            HINGE.replace("<body", "<frame>" * 990 + "<body").replace(
                "</body>", "</body>" + "</frame>" * 990
            ),
            f"at most {DEEPEST} elements inside each other are read",
        ),
        (
            HINGE.replace("<worldbody>", '<Include file="/etc/passwd"/><worldbody>'),
            "Include: cannot be followed",
        ),
    ],
)
def test_what_no_motion_follows_from_is_refused_in_one_line(robot: str, words: str) -> None:
    with pytest.raises(BadInput) as caught:
        compiled(robot, "robot")
    assert words in str(caught.value) and len(str(caught.value)) < 200


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
