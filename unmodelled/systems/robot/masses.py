"""Inertia that the joints of a robot move: joints without any, and files of which no motion follows."""

from __future__ import annotations

from typing import Any

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.systems.robot.bodies import Robot

#: Poses at which the inertias are computed; in a few of them, links can be aligned by chance.
_POSES = 3
#: Inertia (kg m^2) or mass (kg) that is none, also relative to that of the bodies about other axes: MuJoCo's
#: smallest number (mjMINVAL), and rounding.
_NONE, _ROUNDED = 1e-15, 1e-12


def massless(model: Any, robot: Robot, where: str) -> tuple[int, ...]:
    """Return the numbers of the joints that move no inertia in any pose."""
    for body in robot.bodies:
        if body.mass < 0.0:
            words = "a mass must not be negative: correct it"
            raise BadInput(f"{where}: link {body.name!r}: has {body.mass:.4g} kg: {words}")
    poses = [_pose(model, robot, seed) for seed in range(_POSES)]
    leaders = poses[0][0]
    still = [
        all(abs(mass[n, n]) <= max(_NONE, _ROUNDED * most[n]) for _, mass, most in poses)
        for n in range(len(leaders))
    ]
    left = np.flatnonzero(~np.array(still, bool))
    for _, mass, _ in poses:
        part = mass[np.ix_(left, left)]
        sizes = np.sqrt(np.abs(part.diagonal()))
        least, ways = np.linalg.eigh(part / np.outer(sizes, sizes)) if len(left) else ([1.0], None)
        if least[0] < _ROUNDED and ways is not None:
            name = robot.joints[leaders[left[int(np.argmax(np.abs(ways[:, 0])))]]].written
            words = "correct masses and inertias of its links, or fix the joint"
            raise BadInput(f"{where}: joint {name!r}: what it moves has no positive inertia: {words}")
    return tuple(k for k, none in zip(leaders, still, strict=True) if none)


def _pose(model: Any, robot: Robot, seed: int) -> tuple[list[int], Array, Array]:
    """Joints that move by themselves, their mass matrix in a pose, and bounds of its diagonal."""
    import mujoco

    resting, following = robot.resting({}), robot.following({})
    leaders = [k for k in range(len(robot.joints)) if k not in resting and k not in following]
    gears = np.zeros((len(robot.joints), len(leaders)))
    for n, k in enumerate(leaders):
        gears[k, n] = 1.0
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0 + np.random.default_rng(seed).uniform(-1.0, 1.0, len(robot.joints))
    for k, value in resting.items():
        data.qpos[k] = value
    for k, gear in following.items():
        assert gear.leader is not None
        gears[k, leaders.index(gear.leader)] = gear.ratio
        data.qpos[k] = gear.ratio * data.qpos[gear.leader] + gear.offset
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mass, most = np.diag(model.dof_armature) @ gears, np.zeros(len(leaders))
    mass = gears.T @ mass
    for k, body in enumerate(robot.bodies, start=1):
        linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacBodyCom(model, data, linear, angular, k)
        linear, angular = linear @ gears, angular @ gears
        turned = data.xmat[k].reshape(3, 3).T @ angular
        mass += body.mass * linear.T @ linear + turned.T @ body.inertia @ turned
        most += body.mass * (linear**2).sum(0) + np.abs(body.inertia).max() * (angular**2).sum(0)
    return leaders, mass, most
