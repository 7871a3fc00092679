"""Robot files with other numbers, and supplements for what they lack: what MuJoCo makes of them."""

import json
import xml.etree.ElementTree as ET
from math import inf, pi
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import unmodelled as um
from tests.physics.robot.mechanisms import random_tree, system_of
from tests.physics.robot.test_motion import DOUBLE, rates
from unmodelled.base.errors import BadInput
from unmodelled.diagnosis.gates.robot_numbers import of_parameters
from unmodelled.engine.robot.supplement import SCHEMA, Supplement
from unmodelled.systems.robot.compile import compiled
from unmodelled.systems.robot.efforts import Efforts
from unmodelled.systems.robot.numbers import OF_BODIES, Key, differing, numbers
from unmodelled.systems.robot.patch import patched

#: Unnamed elements, a frame, a class with defaults, angles in degrees, comments.
ODD = """<?xml version="1.0"?>
<!-- Copyright somebody -->
<mujoco model="odd">
  <default><default class="geared"><joint armature="0.01" damping="0.3"/></default></default>
  <worldbody>
    <!-- first link -->
    <body><joint class="geared" axis="0 1 0" stiffness="2" springref="10"/>
      <geom type="capsule" size="0.02" fromto="0 0 0 0 0 0.3" mass="0.4"/>
      <frame pos="0 0 0.3">
        <body name="slider"><joint name="rail-x" type="slide" springref="0.2" stiffness="3"/>
          <inertial pos="0 0 0.1" mass="0.2" diaginertia="0.001 0.002 0.002" euler="0 30 0"/></body>
      </frame>
    </body>
  </worldbody>
  <actuator><!-- drive -->
    <position joint="rail-x" kp="20" dampratio="1"/></actuator>
</mujoco>
"""


def scaled(text: str, share: float = 0.02) -> dict[Key, float]:
    """All numbers of a file, each changed by a few per cent."""
    rng = np.random.default_rng(0)
    return {k: v * rng.uniform(1 - share, 1 + share) for k, v in numbers(compiled(text, "robot")).items()}


def pseudo_inertia(found: dict[Key, float], body: str) -> np.ndarray:
    """Second moments of the mass of a body, first moments and mass (4, 4): positive for a solid body."""
    mass, *com = (found[body, quantity] for quantity in OF_BODIES[:4])
    inertia = np.zeros((3, 3))
    for quantity in OF_BODIES[4:]:
        i, j = ("xyz".index(axis) for axis in quantity[-2:])
        inertia[i, j] = inertia[j, i] = found[body, quantity]
    c = np.array(com)
    inertia += mass * (c @ c * np.eye(3) - np.outer(c, c))
    second = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    return np.block([[second, mass * c[:, None]], [mass * c[None], np.array([[mass]])]])


@pytest.mark.parametrize("seed", range(12))
def test_every_patched_link_is_that_of_a_solid_body(tmp_path: Path, seed: int) -> None:
    """Any masses, factors of the inertias and centres of mass: no number of a link changes by itself."""
    text, rng = random_tree(seed), np.random.default_rng(seed)
    system = system_of(tmp_path, text, "identify: ['*.mass', '*.inertia_scale', '*.com_x']\n")
    efforts = Efforts(system, compiled(text, "robot.xml"))
    values = {p.name: p.value * float(np.exp(rng.uniform(-2.0, 2.0))) for p in system.parameters}
    file = patched(text, "robot.xml", of_parameters(efforts, values))
    found, given = numbers(compiled(file.text, "robot.xml")), numbers(efforts.robot)
    assert not file.missing
    for body in {element for element, quantity in given if quantity == "mass"}:
        a, b, c = np.linalg.eigvalsh(_tensor(found, body))
        assert a > 0.0 and a + b >= c * (1.0 - 1e-6)
        assert np.linalg.eigvalsh(pseudo_inertia(found, body))[0] > 0.0
        mass = values.get(f"{body}_mass", given[body, "mass"])
        factor = mass / given[body, "mass"] * values.get(f"{body}_inertia_scale", 1.0)
        assert _tensor(found, body) == pytest.approx(factor * _tensor(given, body), rel=1e-6, abs=1e-12)


def _tensor(found: dict[Key, float], body: str) -> np.ndarray:
    x, y, z, xy, xz, yz = (found[body, quantity] for quantity in OF_BODIES[4:])
    return np.array([[x, xy, xz], [xy, y, yz], [xz, yz, z]])


def test_the_equations_of_a_heavier_link_are_those_of_its_patched_file(tmp_path: Path) -> None:
    text = random_tree(1)
    system = system_of(tmp_path, text, "identify: ['b2.mass', 'b1.inertia_scale']\n")
    values = {"b2_mass": 1.7 * numbers(compiled(text, "a"))["b2", "mass"], "b1_inertia_scale": 2.5}
    efforts = Efforts(system, compiled(text, "robot.xml"))
    file = patched(text, "robot.xml", of_parameters(efforts, values))
    (tmp_path / "patched").mkdir()
    other = system_of(tmp_path / "patched", file.text)
    q, qd, u = np.random.default_rng(1).normal(size=(3, len(system.ports)))
    u = np.resize(u, len(system.inputs))
    assert rates(system.with_values(values), q, qd, u) == pytest.approx(rates(other, q, qd, u), rel=1e-7)


@pytest.mark.parametrize("seed", range(4))
def test_mujoco_reads_all_numbers_of_a_patched_mjcf(seed: int) -> None:
    text = random_tree(seed)
    wanted = scaled(text)
    file = patched(text, "robot.xml", wanted)
    # the elements position and velocity have one number for gain and feedback
    assert file.missing.keys() == {("p", "gain"), ("v", "gain")}
    again = numbers(compiled(file.text, "robot.xml"))
    assert again["b1", "inertia_xy"] == pytest.approx(wanted["b1", "inertia_xy"], rel=1e-6)
    assert again["g", "bias"] == pytest.approx(wanted["g", "bias"])


def test_mujoco_reads_all_numbers_of_a_patched_urdf_but_those_that_urdf_lacks() -> None:
    wanted = {**scaled(DOUBLE), ("one", "damping"): 0.3, ("two", "frictionloss"): 0.1}
    assert patched(DOUBLE, "robot.urdf", wanted).missing == {}
    lacking = {("one", "armature"): 0.02, ("two", "stiffness"): 3.0}
    file = patched(DOUBLE, "robot.urdf", {**wanted, **lacking})
    assert file.missing == lacking
    dynamics = ET.fromstring(file.text).find("joint[@name='two']/dynamics")
    assert dynamics is not None and dynamics.attrib == {"friction": "0.1"}


def test_odd_elements_are_found_and_the_rest_of_the_file_stays() -> None:
    wanted = {
        ("joint1", "springref"): pi / 4,
        ("joint1", "damping"): 0.5,
        ("rail_x", "springref"): 0.5,
        ("rail_x", "armature"): 0.07,
        ("actuator1", "kv"): 1.5,
        ("actuator1", "ctrl_low"): -0.3,
        ("actuator1", "ctrl_high"): 0.4,
    }
    file = patched(ODD, "odd.xml", wanted)
    assert not file.missing
    given, new = numbers(compiled(ODD, "odd.xml")), numbers(compiled(file.text, "odd.xml"))
    assert differing(new, given).keys() == wanted.keys()
    for words in ("<!-- Copyright somebody -->", "<!-- first link -->", "<!-- drive -->", "euler", "<?xml"):
        assert words in file.text
    joint = next(ET.fromstring(file.text).iter("joint"))
    assert joint.get("class") == "geared" or next(iter([joint])).get("armature") == "0.01"
    assert 'springref="45"' in file.text and 'springref="0.5"' in file.text and "dampratio" not in file.text


def test_a_mass_that_came_from_geoms_gets_an_inertial() -> None:
    given = numbers(compiled(ODD, "odd.xml"))
    file = patched(ODD, "odd.xml", {("body1", "mass"): 0.5})
    new = numbers(compiled(file.text, "odd.xml"))
    assert not file.missing and new["body1", "mass"] == 0.5
    assert new["body1", "inertia_xx"] == pytest.approx(given["body1", "inertia_xx"], rel=1e-8)


def test_the_gain_of_a_motor_is_written_as_its_gear() -> None:
    arm = """<mujoco><worldbody><body><joint name="j" axis="0 1 0"/><geom size="0.1"/></body></worldbody>
    <actuator><motor name="m" joint="j" gear="2" forcerange="-3 3"/></actuator></mujoco>"""
    file = patched(arm, "arm.xml", {("m", "gain"): 1.5})
    new = numbers(compiled(file.text, "arm.xml"))
    assert (new["m", "gear"], new["m", "force_high"], new["m", "ctrl_high"]) == (3.0, 2.0, inf)


def test_numbers_without_a_change_leave_the_file_as_it_is() -> None:
    assert patched(ODD, "odd.xml", numbers(compiled(ODD, "odd.xml"))).text == ODD


def test_an_inertia_that_no_body_has_is_refused_in_one_line() -> None:
    with pytest.raises(BadInput, match=r"^odd.xml: MuJoCo: .*inertia"):
        patched(ODD, "odd.xml", {("slider", "inertia_xx"): 1.0})


CART = """<mujoco><option gravity="0 0 0"/><worldbody><body name="cart"><joint name="rail-x" type="slide"/>
<geom size="0.1" mass="2"/></body></worldbody>
<actuator><position name="servo" joint="rail-x" kp="10"/></actuator></mujoco>"""


def cart() -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(CART)
    return model, mujoco.MjData(model)


def acceleration(supplement: Supplement, q: float, qd: float, u: float, applied: float = 0.0) -> float:
    model, data = cart()
    forces = supplement.complete(model)
    data.qpos[0], data.qvel[0], data.ctrl[0], data.qfrc_applied[0], data.time = q, qd, u, applied, 2.0
    mujoco.set_mjcb_passive(forces)
    mujoco.mj_forward(model, data)
    mujoco.set_mjcb_passive(None)
    return float(data.qacc[0])


def test_numbers_and_forces_act_as_they_say() -> None:
    assert acceleration(Supplement(), 0.1, 1.0, 0.3) == pytest.approx(10 * (0.3 - 0.1) / 2)
    numbers = {"armature": 0.5, "damping": 0.2, "stiffness": 4.0, "springref": 0.6}
    found = acceleration(Supplement({"rail_x": numbers}), 0.1, 1.0, 0.3)
    assert found == pytest.approx((2.0 - 0.2 + 4.0 * 0.5) / 2.5)
    found = acceleration(Supplement({"servo": {"gain": 12.0, "bias": 0.5, "kv": 0.1}}), 0.1, 1.0, 0.3)
    assert found == pytest.approx((12 * 0.3 - 10 * 0.1 + 0.5 - 0.1) / 2)
    law = "-c*qd_rail_x*abs(qd_rail_x) - 3*q_rail_x + u_servo + 0.1*applied_rail_x + t"
    found = acceleration(Supplement({}, {"rail_x": law}, {"c": 0.5}), 0.1, 1.0, 0.3, applied=4.0)
    assert found == pytest.approx((2.0 + 4.0 - 0.5 - 0.3 + 0.3 + 0.4 + 2.0) / 2)


def test_a_force_remembers_by_its_states() -> None:
    """A state that follows the time with a lag, far faster than the time step: exact where linear."""
    values, rates, starts = {"T": 1e-5}, {"z": "(3*q_rail_x - z)/T", "w": "1"}, {"w": 0.5}
    model, data = cart()
    forces = Supplement({}, {"rail_x": "z + w"}, values, rates, starts).complete(model)
    for time, z, w in ((1.0, 0.0, 0.5), (1.25, 0.6, 0.75), (1.25, 0.6, 0.75), (0.5, 0.0, 0.5)):
        data.time, data.qpos[0], data.qfrc_passive[0] = time, 0.2, 0.0
        forces(model, data)
        assert data.qfrc_passive[0] == pytest.approx(z + w)  # an earlier time is a new run
    forces.begin(0.5, np.array([2.0, 0.0]))
    data.qfrc_passive[0] = 0.0
    forces(model, data)
    assert data.qfrc_passive[0] == pytest.approx(2.0)


def test_a_supplement_is_read_as_it_was_written(tmp_path: Path) -> None:
    memory = {"z": "qd_rail_x - z"}, {"z": 0.1}
    supplement = Supplement({"rail_x": {"armature": 0.5}}, {"rail_x": "-c*z"}, {"c": 0.5}, *memory)
    supplement.write(tmp_path / "supplement.json")
    assert Supplement.read(tmp_path / "supplement.json") == supplement


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ([], "schema: must be 'supplement/1'"),
        ({"schema": "other"}, "schema: must be 'supplement/1'"),
        ({"numbers": 3}, "must be objects"),
        ({"forces": {"rail_x": 3}}, "a force or a rate must be a text"),
        ({"rates": {"z": 3}}, "a force or a rate must be a text"),
        ({"rates": {"z": "q_elbow"}}, "rates.z: unknown symbol 'q_elbow'"),
        ({"values": {"c": None}}, "missing or not finite"),
        ({"numbers": {"rail_x": {"armature": True}}}, "missing or not finite"),
        ({"numbers": {"rail_x": {"armatur": 1.0}}}, "did you mean 'armature'"),
        ({"numbers": {"rail_y": {"armature": 1.0}}}, "no joint 'rail_y'; did you mean 'rail_x'"),
        ({"forces": {"elbow": "1"}}, "no joint 'elbow'"),
        ({"forces": {"rail_x": "__import__('os').system('ls')"}}, "forces.rail_x: "),
        ({"forces": {"rail_x": "qd_elbow"}}, "unknown symbol 'qd_elbow'"),
    ],
)
def test_what_is_no_supplement_of_the_robot_is_refused(content: Any, message: str, tmp_path: Path) -> None:
    path = tmp_path / "supplement.json"
    path.write_text(json.dumps({"schema": SCHEMA, **content} if isinstance(content, dict) else content))
    with pytest.raises(um.BadInput, match=message) as refused:
        um.supplement(cart()[0], path)
    assert str(refused.value).startswith(str(path))


def test_a_supplement_without_forces_adds_none() -> None:
    model, data = cart()
    Supplement().complete(model)(model, data)
    assert not np.any(data.qfrc_passive)
