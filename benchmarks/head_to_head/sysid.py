"""Parameters by the optimiser of mujoco.sysid: all joint parameters of MuJoCo and those of the file."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import redirect_stdout
from io import StringIO
from typing import Any

import numpy as np

from benchmarks.head_to_head.joints import QUANTITIES, JointFit
from benchmarks.head_to_head.method import Model
from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.study import Study

#: Largest number of iterations of the optimiser.
ITERATIONS = 50
#: Initial distance of a number from its bound, in plausible sizes: the optimiser stalls at bounds.
OFF = 0.02


def without_stiffness() -> MujocoSysid:
    """Return the method without the stiffness, which few robots have at their joints."""
    return MujocoSysid(("damping", "frictionloss", "armature"))


class WithLinks:
    """Damping, dry friction and armature of the joints, and mass, centre of mass and inertia of the links.

    Only for robots. Links have the pseudo-inertia of `mujoco.sysid.body_inertia_param`, ten numbers per link
    with its default bounds.
    """

    name, needs = "mujoco.sysid, links", ("mujoco",)

    def fit(self, study: Study) -> Model:
        from benchmarks.head_to_head.in_mujoco import LinkFit

        robot = LinkFit(study)
        return robot.model(*optimised(robot.errors, robot.start, robot.bounds, scaled=False))


class MujocoSysid:
    """`mujoco.sysid.optimize` over the free runs of the training experiments.

    The joint parameters are damping, dry friction, armature and stiffness, or some of them. The residual is
    that of the gap. A robot runs in MuJoCo (`in_mujoco.RobotFit`). Another machine runs in the project's free
    runs, with the same joint parameters at its mechanical ports.
    """

    needs = ("mujoco",)

    def __init__(self, quantities: tuple[str, ...] = tuple(QUANTITIES)) -> None:
        self.families = [QUANTITIES[name] for name in quantities]

    @property
    def name(self) -> str:
        """Name in tables."""
        return "mujoco.sysid" if len(self.families) == len(QUANTITIES) else "mujoco.sysid, no stiffness"

    def fit(self, study: Study) -> Model:
        if study.system.robot is not None:
            from benchmarks.head_to_head.in_mujoco import RobotFit

            robot = RobotFit(study, self.families)
            return robot.model(*optimised(robot.errors, robot.start, robot.bounds))
        joints = JointFit.of(study, self.families)
        return joints.model(*optimised(joints.errors, joints.start, joints.bounds))


def optimised(
    errors: Callable[[Array], Array], start: Array, bounds: tuple[Array, Array], scaled: bool = True
) -> tuple[Array, str]:
    """Minimise the sum of squared errors with mujoco.sysid, and return the vector and the iterations.

    `errors` of vectors (sets, entries) are (errors, sets). The optimiser scales the entries by their slopes
    if `scaled`; it stalls so where an entry, such as a product of inertia of a plane mechanism, changes
    nothing.
    """
    from mujoco import sysid

    low, high = (np.where(np.isfinite(b), b, sign * 1e3) for b, sign in zip(bounds, (-1.0, 1.0), strict=True))
    room = np.minimum(OFF, 0.25 * (high - low))
    first = np.clip(start, low + room, high - room)
    parameters = sysid.ParameterDict({"z": sysid.Parameter("z", first, low, high)})
    count = 0

    def residual(x: Array, _: Any) -> tuple[list[Array], None, None]:
        nonlocal count
        sets = x.reshape(len(start), -1).T
        count += len(sets)
        found = errors(sets)
        return [found[:, 0] if x.ndim == 1 else found], None, None

    how = {"optimizer": "mujoco", "verbose": False, "max_iters": ITERATIONS}
    with redirect_stdout(StringIO()):  # the table of iterations
        best, result = sysid.optimize(parameters, residual, x_scale="jac" if scaled else 1.0, **how)
    steps = len(result.extras.get("objective", ()))
    return best.as_vector(), f"{steps or 'at most ' + str(ITERATIONS)} iterations, {count} simulations"
