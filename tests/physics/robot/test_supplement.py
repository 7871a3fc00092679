"""Supplements of robot files: what they do to a model of MuJoCo, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import unmodelled as um
from unmodelled.engine.robot.supplement import SCHEMA, Supplement

CART = """<mujoco><option gravity="0 0 0"/><worldbody><body name="cart"><joint name="rail-x" type="slide"/>
<geom size="0.1" mass="2"/></body></worldbody>
<actuator><position name="servo" joint="rail-x" kp="10"/></actuator></mujoco>"""


def acceleration(supplement: Supplement, q: float, qd: float, u: float, applied: float = 0.0) -> float:
    model = mujoco.MjModel.from_xml_string(CART)
    forces = supplement.complete(model)
    data = mujoco.MjData(model)
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
    model = mujoco.MjModel.from_xml_string(CART)
    forces = Supplement({}, {"rail_x": "z + w"}, values, rates, starts).complete(model)
    data = mujoco.MjData(model)
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
def test_what_is_no_supplement_of_the_robot_is_refused_in_one_line(
    content: Any, message: str, tmp_path: Path
) -> None:
    path = tmp_path / "supplement.json"
    path.write_text(json.dumps({"schema": SCHEMA, **content} if isinstance(content, dict) else content))
    with pytest.raises(um.BadInput, match=message) as refused:
        um.supplement(mujoco.MjModel.from_xml_string(CART), path)
    assert str(refused.value).startswith(str(path))


def test_a_supplement_without_forces_adds_none() -> None:
    model = mujoco.MjModel.from_xml_string(CART)
    data = mujoco.MjData(model)
    Supplement().complete(model)(model, data)
    assert not np.any(data.qfrc_passive)
