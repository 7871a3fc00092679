"""Accelerations of robots: closed forms, MuJoCo on random trees, derivatives, energy."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
import sympy as sp

from tests.physics.robot.mechanisms import OFF, forward, order_of, random_tree, system_of
from unmodelled.engine.machine.program import Program
from unmodelled.systems.model import System, symbol
from unmodelled.systems.numeric import SystemFunction, numpy_system_function

PENDULUM = """<mujoco><option gravity="0 0 -10"/><worldbody><body name="rod">
<joint name="pivot" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="0.1 0.1 0.01"/>
</body></worldbody></mujoco>"""
DOUBLE = """<robot name="double">
<link name="world"/>
<joint name="one" type="continuous"><parent link="world"/><child link="upper"/><axis xyz="1 0 0"/></joint>
<link name="upper"><inertial><origin xyz="0 0 -0.2"/><mass value="0.6"/>
<inertia ixx="0.03" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="two" type="continuous"><origin xyz="0.1 0 -0.3"/><parent link="upper"/><child link="lower"/>
<axis xyz="1 0 0"/></joint>
<link name="lower"><inertial><origin xyz="0 0 -0.15"/><mass value="0.5"/>
<inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"""


def rates(system: System, q: np.ndarray, qd: np.ndarray, u: np.ndarray) -> np.ndarray:
    program = Program.of(system, system.dynamics)
    found = program.evaluate(np.zeros(()), np.concatenate([q, qd]), u, np.array(system.values), np.empty(0))
    return found[len(q) :]


def test_a_pendulum_swings_as_in_closed_form(tmp_path: Path) -> None:
    system = system_of(tmp_path, PENDULUM)
    found = rates(system, np.array([0.7]), np.array([2.0]), np.array([0.3]))
    assert found == pytest.approx([(0.3 - 2 * 10 * 0.5 * np.sin(0.7)) / (0.1 + 2 * 0.25)], rel=1e-14)


def test_a_rotor_that_gravity_does_not_turn_needs_no_steps(tmp_path: Path) -> None:
    system = system_of(tmp_path, PENDULUM.replace('axis="0 1 0"', 'axis="0 0 1" armature="0.5"'))
    assert rates(system, np.array([0.7]), np.array([2.0]), np.array([0.3])) == pytest.approx([0.3 / 0.51])


def test_a_double_pendulum_swings_as_in_closed_form(tmp_path: Path) -> None:
    system = system_of(tmp_path, DOUBLE, name="robot.urdf")
    q, v, u = np.array([0.4, -1.1]), np.array([1.5, -0.8]), np.array([0.2, -0.1])
    i1, i2, m2, l1, r2 = 0.03 + 0.6 * 0.04, 0.02 + 0.5 * 0.0225, 0.5, 0.3, 0.15
    c, h = m2 * l1 * r2 * np.cos(q[1]), m2 * l1 * r2 * np.sin(q[1])
    mass = np.array([[i1 + i2 + m2 * l1**2 + 2 * c, i2 + c], [i2 + c, i2]])
    lower = 9.81 * m2 * r2 * np.sin(q.sum())
    upper = 9.81 * (0.6 * 0.2 + m2 * l1) * np.sin(q[0]) + lower
    torque = u + np.array([h * (2 * v[0] * v[1] + v[1] ** 2) - upper, -h * v[0] ** 2 - lower])
    assert rates(system, q, v, u) == pytest.approx(np.linalg.solve(mass, torque), rel=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_random_trees_accelerate_as_in_mujoco(tmp_path: Path, seed: int) -> None:
    text = random_tree(seed)
    system, model = system_of(tmp_path, text), mujoco.MjModel.from_xml_string(text)
    model.opt.disableflags |= int(OFF)
    rng = np.random.default_rng(seed)
    order = order_of(model, system)
    for _ in range(5):
        q, qd, u = rng.normal(size=len(order)), rng.normal(size=len(order)), 2 * rng.normal(size=4)
        wanted = forward(model, q, qd, u).qacc[order]
        found = rates(system, q[order], qd[order], u)
        assert np.max(np.abs(found - wanted)) < 1e-9 * np.max(np.abs(wanted))


def test_locked_joints_accelerate_as_in_mujoco_with_a_rotor_that_no_torque_turns(tmp_path: Path) -> None:
    text = random_tree(3)
    system, model = system_of(tmp_path, text, "locked: {j1b: 0.4}\n"), mujoco.MjModel.from_xml_string(text)
    order, k = order_of(model, system), model.joint("j1b").id
    assert {*range(model.njnt)} - {*order} == {k}
    model.dof_armature[k], model.jnt_stiffness[k] = 1e9, 0.0
    rng = np.random.default_rng(1)
    q, qd = rng.normal(size=model.nq), rng.normal(size=model.nv)
    q[k], qd[k] = 0.4, 0.0
    data = forward(model, q, qd, [0.3, 0.1, 0.0, -0.2])
    found = rates(system, data.qpos[order], data.qvel[order], data.ctrl[[0, 1, 3]])
    assert found == pytest.approx(data.qacc[order], rel=1e-6)


@pytest.mark.long
def test_parameters_of_the_file_are_where_they_act(tmp_path: Path) -> None:
    text = random_tree(4)
    system = system_of(tmp_path, text, "identify: ['b2.*', 'j2a.*', 'm.gear', 'p.k?', 'g.gain']\n")
    model = mujoco.MjModel.from_xml_string(text)
    order = order_of(model, system)
    known = {p.name: p.value for p in system.parameters}
    assert {"b2_inertia_xy", "m_gear", "p_kv", "g_gain"} <= {*known}
    assert all(p.identify and p.limits[0] < p.value < p.limits[1] for p in system.parameters)
    body, joint = model.body("b2").id, model.joint("j2a").id
    model.body_mass[body] *= 1.7
    model.body_ipos[body] *= 1.2
    model.dof_armature[joint] *= 2.0
    model.dof_damping[joint] *= 3.0
    model.actuator_gear[0, 0] *= 0.5
    model.actuator_gainprm[1, 0] *= 1.3
    model.actuator_biasprm[1, 1] *= 1.3
    factors = {"b2_mass": 1.7, "j2a_armature": 2.0, "j2a_damping": 3.0, "m_gear": 0.5, "p_kp": 1.3}
    factors |= {f"b2_com_{axis}": 1.2 for axis in "xyz"}
    changed = system.with_values({name: known[name] * factor for name, factor in factors.items()})
    rng = np.random.default_rng(1)
    data = forward(model, rng.normal(size=model.nq), rng.normal(size=model.nv), 0.3)
    found = rates(changed, data.qpos[order], data.qvel[order], np.array(data.ctrl))
    assert found == pytest.approx(data.qacc[order], rel=1e-9)


@pytest.mark.long
def test_derivatives_are_those_of_differences(tmp_path: Path) -> None:
    system = system_of(tmp_path, random_tree(2), "identify: ['*.armature', 'b1.mass']\n")
    names = [*system.x, *system.e, symbol("j2a_armature"), symbol("b1_mass")]
    rng = np.random.default_rng(0)
    x, u, e = (rng.normal(size=n) for n in (len(system.x), len(system.u), len(system.e)))
    given = np.concatenate([x, e, system.values])
    known = [*system.x, *system.e, *system.p]
    value = numpy_system_function(system, system.dynamics)
    slopes = numpy_system_function(system, [sp.diff(f, s) for f in system.dynamics for s in names])

    def at(function: SystemFunction, numbers: np.ndarray) -> np.ndarray:
        x, e, p = np.split(numbers, [len(system.x), len(system.x) + len(system.e)])
        return function(0.0, x, u, e, p, np.empty(0))

    found = at(slopes, given).reshape(len(system.x), len(names))
    for k, s in enumerate(names):
        step = 1e-6 * np.eye(len(given))[known.index(s)]
        wanted = (at(value, given + step) - at(value, given - step)) / 2e-6
        assert found[:, k] == pytest.approx(wanted, rel=1e-5, abs=1e-6)
