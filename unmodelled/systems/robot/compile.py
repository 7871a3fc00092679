"""Bodies, joints and actuators of a robot file, as MuJoCo compiles them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from unmodelled.base.errors import BadInput, first_few
from unmodelled.systems.robot.bodies import Actuator, Body, Coupling, Joint, Robot
from unmodelled.systems.robot.links import clean
from unmodelled.systems.robot.loading import Loaded, check_finite, couplings, loaded
from unmodelled.systems.robot.masses import massless

KINDS = ("body", "joint", "actuator")
#: Most joints of a robot, and most on the way from its base to a tip: equations of about a minute (45 in a
#: row take 33 s, 101 of which at most 15 are in a row 23 s; the time grows with the cube of those in a row).
MOST_JOINTS, MOST_IN_A_ROW = 128, 50
#: Arrays of a compiled model that must be zero, what they stand for, and what to do.
_ZERO = (
    ("body_gravcomp", "gravity compensation", "remove gravcomp, and add its force in signals"),
    ("dof_dampingpoly", "polynomial damping", "write it as the law of the joint's port"),
    ("jnt_stiffnesspoly", "a polynomial spring", "write it as the law of the joint's port"),
    ("actuator_delay", "a delay", "remove it, and give the input a delay"),
    ("actuator_armature", "an armature", "add it to that of the joint"),
    ("actuator_damping", "damping", "add it to that of the joint"),
    ("actuator_dampingpoly", "polynomial damping", "write it as the law of the joint's port"),
)


def compiled(text: str, where: str) -> Robot:
    """Return the robot of an MJCF or URDF file."""
    return _Compiled(loaded(text, where), where).robot()


def written_names(model: Any, kind: str) -> list[str]:
    """Return the names of all bodies, joints or actuators; elements without a name are numbered."""
    import mujoco

    code, first = getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), int(kind != "body")
    count = {"body": model.nbody, "joint": model.njnt, "actuator": model.nu}[kind]
    return [mujoco.mj_id2name(model, code, k) or f"{kind}{k + first}" for k in range(count)]


def plain_name(written: str) -> str:
    """Return the name of an element as a name of a system file.

    Examples:
        >>> plain_name("left-knee"), plain_name("1")
        ('left_knee', 'j1')
    """
    plain = re.sub(r"\W", "_", written, flags=re.ASCII)
    return plain if plain[:1].isalpha() else f"j{plain}"


class _Compiled:
    def __init__(self, file: Loaded, where: str) -> None:
        import mujoco

        self.model, self.where, self.file, self.mujoco = file.model, where, file, mujoco
        self.bodies, self.joints, self.actuators = (written_names(file.model, kind) for kind in KINDS)
        self.couplings: dict[int, Coupling] = {}

    def robot(self) -> Robot:
        model, mujoco = self.model, self.mujoco
        self._check()
        weightless = model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY
        self.couplings = couplings(model, self.joints, self.where)
        robot = Robot(
            tuple(self._body(k, name) for k, name in enumerate(self._names(self.bodies)) if k > 0),
            tuple(self._joint(k, name) for k, name in enumerate(self._names(self.joints))),
            tuple(self._actuator(k, name) for k, name in enumerate(self._names(self.actuators))),
            np.zeros(3) if weightless else np.array(model.opt.gravity),
            tuple(self._notes()),
        )
        return self._held(robot)

    def _held(self, robot: Robot) -> Robot:
        """The robot with the joints that move nothing, and a note on them."""
        held = massless(self.model, robot, self.where)
        words = "stand still at 0: to let them move, give their links masses and inertias"
        note = f"joints that move no mass ({first_few([self.joints[k] for k in held])}) {words}"
        return replace(robot, massless=held, notes=(*robot.notes, note)) if held else robot

    def _wrong(self, what: str, problem: str) -> BadInput:
        return BadInput(f"{self.where}: {what}: {problem}")

    def _names(self, written: list[str]) -> list[str]:
        """Names of a system file."""
        found: dict[str, str] = {}
        for name in written:
            plain = plain_name(name)
            if plain in found:
                raise self._wrong(name, f"has the same name as {found[plain]!r}: rename one of them")
            found[plain] = name
        return [*found]

    def _check(self) -> None:
        model, mujoco = self.model, self.mujoco
        if model.njnt > MOST_JOINTS:
            words = f"at most {MOST_JOINTS} are read: fix those that do not move"
            raise BadInput(f"{self.where}: has {model.njnt} joints, {words}")
        in_a_row = np.zeros(model.nbody, int)
        for body in range(1, model.nbody):
            in_a_row[body] = in_a_row[model.body_parentid[body]] + model.body_jntnum[body]
        if in_a_row.max() > MOST_IN_A_ROW:
            words = f"has {in_a_row.max()} joints between the base and it, at most {MOST_IN_A_ROW} are read"
            raise self._wrong(f"body {self.bodies[int(in_a_row.argmax())]!r}", f"{words}: fix some of them")
        if model.njnt == 0:
            raise BadInput(f"{self.where}: has no joint, so that nothing moves: add a hinge or slide joint")
        free = int(mujoco.mjtJoint.mjJNT_FREE)
        for k in np.flatnonzero(model.jnt_type <= int(mujoco.mjtJoint.mjJNT_BALL)):
            kind = "free" if model.jnt_type[k] == free else "ball"
            words = "has no equations here: remove it (the body then stands still), or use hinges and slides"
            raise self._wrong(f"joint {self.joints[k]!r}", f"a {kind} joint: {words}")
        names = dict(zip(KINDS, (self.bodies, self.joints, self.actuators), strict=True))
        check_finite(model, names, self.where)
        for array, what, advice in _ZERO:
            values = np.asarray(getattr(model, array, np.zeros(0)))  # older MuJoCo has fewer of them
            for row in np.flatnonzero(values.reshape(len(values), -1).any(-1)) if len(values) else ():
                words = f"has {what}, which has no equation here: {advice}"
                raise self._wrong(self._named(array, int(row)), words)
        for number in range(model.nu):
            self._check_actuator(number)

    def _named(self, array: str, k: int) -> str:
        if array.startswith("body"):
            return f"body {self.bodies[k]!r}"
        if array.startswith("actuator"):
            return f"actuator {self.actuators[k]!r}"
        return f"joint {self.joints[k if array.startswith('jnt') else self.model.dof_jntid[k]]!r}"

    def _check_actuator(self, k: int) -> None:
        model, mujoco, what = self.model, self.mujoco, f"actuator {self.actuators[k]!r}"
        if int(model.actuator_trntype[k]) > int(mujoco.mjtTrn.mjTRN_JOINTINPARENT):
            raise self._wrong(what, "only actuators of a joint have equations here: remove it")
        filters = mujoco.mjtDyn.mjDYN_FILTER, mujoco.mjtDyn.mjDYN_FILTEREXACT
        if int(model.actuator_dyntype[k]) not in map(int, (mujoco.mjtDyn.mjDYN_NONE, *filters)):
            words = "use filterexact (timeconst), or remove dyntype and add a state in the system file"
            raise self._wrong(what, f"has a state of its own, which has no equation here: {words}")
        if model.actuator_actlimited[k]:
            words = "limit its input (ctrlrange) instead"
            raise self._wrong(what, f"limits its activation (actrange), which has no equation here: {words}")
        gain, bias = int(model.actuator_gaintype[k]), int(model.actuator_biastype[k])
        straight = gain == int(mujoco.mjtGain.mjGAIN_FIXED) or (
            gain == int(mujoco.mjtGain.mjGAIN_AFFINE) and not np.any(model.actuator_gainprm[k, 1:])
        )
        if not straight or bias > int(mujoco.mjtBias.mjBIAS_AFFINE):
            words = "use motor, position, velocity or general with an affine bias"
            raise self._wrong(what, f"has a law without equation here: {words}")

    def _body(self, k: int, name: str) -> Body:
        model, first = self.model, int(self.model.body_jntadr[k])
        axes = self._matrix(model.body_iquat[k])
        inertia = axes @ np.diag(model.body_inertia[k]) @ axes.T
        size = float(np.max(np.abs(inertia)))
        return Body(
            name,
            int(model.body_parentid[k]) - 1,
            clean(np.array(model.body_pos[k])),
            clean(self._matrix(model.body_quat[k])),
            float(model.body_mass[k]),
            np.array(model.body_ipos[k]),
            # without the rounding errors of the principal axes
            np.where(np.abs(inertia) < 1e-15 * size, 0.0, (inertia + inertia.T) / 2),
            tuple(range(first, first + int(model.body_jntnum[k]))),
        )

    def _matrix(self, quaternion: Any) -> Any:
        flat = np.empty(9)
        self.mujoco.mju_quat2Mat(flat, np.array(quaternion))
        return flat.reshape(3, 3)

    def _joint(self, k: int, name: str) -> Joint:
        model = self.model
        dof, at = int(model.jnt_dofadr[k]), int(model.jnt_qposadr[k])
        return Joint(
            name,
            self.joints[k],
            int(model.jnt_type[k]) == int(self.mujoco.mjtJoint.mjJNT_SLIDE),
            clean(np.array(model.jnt_axis[k])),
            np.array(model.jnt_pos[k]),
            float(model.qpos0[at]),
            armature=float(model.dof_armature[dof]),
            damping=float(np.ravel(model.dof_damping[dof])[0]),
            stiffness=float(np.ravel(model.jnt_stiffness[k])[0]),
            rest=float(model.qpos_spring[at]),
            frictionloss=float(model.dof_frictionloss[dof]),
            follows=self.couplings.get(k),
        )

    def _actuator(self, k: int, name: str) -> Actuator:
        model = self.model
        affine = int(model.actuator_biastype[k]) == int(self.mujoco.mjtBias.mjBIAS_AFFINE)
        bias, stiffness, damping = map(float, model.actuator_biasprm[k, :3] if affine else (0.0, 0.0, 0.0))
        return Actuator(
            name,
            int(model.actuator_trnid[k, 0]),
            float(model.actuator_gear[k, 0]),
            float(model.actuator_gainprm[k, 0]),
            bias,
            -stiffness,
            -damping,
            float(model.actuator_dynprm[k, 0]) if model.actuator_dyntype[k] else 0.0,
            self._limits("ctrl", k),
            self._limits("force", k),
        )

    def _limits(self, kind: str, k: int) -> tuple[float, float] | None:
        if not getattr(self.model, f"actuator_{kind}limited")[k]:
            return None
        low, high = getattr(self.model, f"actuator_{kind}range")[k]
        return float(low), float(high)

    def _notes(self) -> Iterator[str]:
        model = self.model
        yield from self.file.notes
        if followers := [self.joints[k] for k in self.couplings]:
            words = "have no coordinate and no input of their own"
            yield f"joints that follow others ({first_few(followers)}) {words}"
        if dry := [self.joints[model.dof_jntid[k]] for k in np.flatnonzero(model.dof_frictionloss)]:
            law = "to include it, give the joint's port a law"
            yield f"the dry friction (frictionloss) of {', '.join(dry)} is not part of the equations: {law}"
        if limited := [self.joints[k] for k in np.flatnonzero(model.jnt_limited)]:
            yield f"the limits of {', '.join(limited)} are not part of the equations"
        if not self.file.urdf and (ends := [self.joints[k] for k in np.flatnonzero(model.jnt_actfrclimited)]):
            yield f"the force limits (actuatorfrcrange) of {', '.join(ends)} are not part of the equations"
        if model.opt.density or model.opt.viscosity:
            yield "forces of the surrounding fluid are not part of the equations"
