"""Random robots as MJCF, and their motion by MuJoCo."""

from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from unmodelled import System, read_system

#: Terms that no equation here has, and that MuJoCo must then not have either.
OFF = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
#: A carriage of some mass on a rail, which nothing drives but the torque of its joint.
CART = """<mujoco><worldbody><body name="cart"><joint name="rail" type="slide" axis="1 0 0"/>
  <inertial pos="0 0 0" mass="{}" diaginertia="1 1 1"/></body></worldbody></mujoco>"""


def system_of(folder: Path, robot: str, more: str = "", name: str = "robot.xml") -> System:
    """Write a robot file with a system file, and read the system."""
    (folder / name).write_text(robot)
    file = folder / "robot.yaml"
    file.write_text(f"schema: system/1\nname: robot\nmodel: {name}\n{more}")
    return read_system(file)


def random_tree(seed: int, joints: int = 4) -> str:
    """Bodies on hinges and slides in random places, some welded, some with two joints, with actuators."""
    rng = np.random.default_rng(seed)
    bodies: list[str] = []
    parents = [int(rng.integers(-1, k)) if k else -1 for k in range(joints)]
    for k in range(joints):
        kinds = ["hinge", "slide"][int(rng.random() < 0.3)], "hinge"
        moving = "".join(_joint(rng, f"j{k}{'ab'[n]}", kinds[n]) for n in range(2 if k == 1 else 1))
        welded = f'<body pos="{_row(rng, 3)}">{_inertial(rng)}</body>' if k % 2 else ""
        place = f'pos="{_row(rng, 3)}" quat="{_row(rng, 4)}"'
        bodies.append(f'<body name="b{k}" {place}>{moving}{_inertial(rng)}{welded}@{k}@</body>')
    for k in reversed(range(joints)):
        if parents[k] >= 0:
            mother = bodies[parents[k]]
            bodies[parents[k]] = mother.replace(f"@{parents[k]}@", f"{bodies[k]}@{parents[k]}@")
    roots = "".join(body for body, parent in zip(bodies, parents, strict=True) if parent < 0)
    for k in range(joints):
        roots = roots.replace(f"@{k}@", "")
    return (
        f'<mujoco><option gravity="{_row(rng, 3)}"/><worldbody>{roots}</worldbody><actuator>'
        '<motor name="m" joint="j0a" gear="3" ctrlrange="-1 1"/>'
        '<position name="p" joint="j1a" kp="7" kv="0.4" gear="2" forcerange="-3 3"/>'
        '<velocity name="v" joint="j1b" kv="0.7"/>'
        '<general name="g" joint="j2a" gainprm="2" biastype="affine" biasprm="0.3 -0.5 -0.2"/>'
        "</actuator></mujoco>"
    )


def _joint(rng: np.random.Generator, name: str, kind: str) -> str:
    keys = ("armature", "damping", "stiffness", "springref", "ref")
    numbers = " ".join(f'{key}="{rng.random():.6g}"' for key in keys)
    return f'<joint name="{name}" type="{kind}" axis="{_row(rng, 3)}" pos="{_row(rng, 3)}" {numbers}/>'


def _inertial(rng: np.random.Generator) -> str:
    a, b = rng.uniform(0.1, 0.2, 2)
    place = f'pos="{_row(rng, 3)}" quat="{_row(rng, 4)}"'
    return f'<inertial mass="{rng.uniform(0.5, 2):.6g}" {place} diaginertia="{a:.6g} {b:.6g} 0.15"/>'


def _row(rng: np.random.Generator, n: int) -> str:
    return " ".join(f"{x:.6g}" for x in rng.normal(size=n))


def forward(model: mujoco.MjModel, q: ArrayLike, qd: ArrayLike, u: ArrayLike = ()) -> mujoco.MjData:
    """What MuJoCo computes of a state, for actuators that are given `u`."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.ctrl[:] = q, qd, u
    mujoco.mj_forward(model, data)
    return data


def order_of(model: mujoco.MjModel, system: System) -> list[int]:
    """Numbers of the joints of a model that are the ports of a system."""
    names = [model.joint(k).name for k in range(model.njnt)]
    return [names.index(port) for port in system.port_names]
