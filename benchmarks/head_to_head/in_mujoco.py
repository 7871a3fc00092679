"""Free runs of a robot in MuJoCo: the fit of mujoco.sysid, and the gap of every method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from benchmarks.head_to_head.joints import QUANTITIES, JointFit
from benchmarks.head_to_head.method import Model
from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.free_runs import replayed
from unmodelled.engine.robot.mujoco_runs import RobotInMujoco
from unmodelled.engine.robot.supplement import Callback, Supplement
from unmodelled.logs.preparation import prepare
from unmodelled.systems.robot.compile import plain_name, written_names
from unmodelled.systems.robot.files import Needed
from unmodelled.systems.robot.loading import loaded

#: Arrays of a model of MuJoCo with one number per degree of freedom, or per joint.
OF_JOINTS = {
    "damping": "dof_damping",
    "armature": "dof_armature",
    "frictionloss": "dof_frictionloss",
    "stiffness": "jnt_stiffness",
}


class RobotFit:
    """Free runs in MuJoCo as a function of damping, dry friction, armature and stiffness of every joint.

    The joints are driven by torques; `families` of the library stand for the fitted quantities.
    """

    def __init__(self, study: Study, families: Sequence[str] = tuple(QUANTITIES.values())) -> None:

        self.study, self.joints = study, JointFit.of(study, families)
        robot = study.system.robot
        assert robot is not None
        self.robot = loaded(robot.text, robot.file).model
        _set_options(self.robot, study)
        self.names = [plain_name(name) for name in written_names(self.robot, "joint")]
        each = self.joints.unknowns.each
        amplitudes = {e.amplitudes[0]: e for e in self.joints.hypothesis.effects}
        self.places = [k for k, u in enumerate(each) if u.name in amplitudes]
        self.effects = [amplitudes[each[k].name] for k in self.places]
        self.scale = np.array([each[k].scale for k in self.places])
        self.start = self.joints.start[self.places]
        self.bounds = tuple(b[self.places] for b in self.joints.bounds)

    def numbers(self, z: Array) -> dict[str, dict[str, float]]:
        """Return the numbers of a vector (entries,) by joint and quantity, SI."""
        quantities = {family: quantity for quantity, family in QUANTITIES.items()}
        found: dict[str, dict[str, float]] = {}
        for effect, value in zip(self.effects, z * self.scale, strict=True):
            found.setdefault(effect.place.name, {})[quantities[effect.family]] = float(value)
        return found

    def errors(self, z: Array) -> Array:
        """Return training errors (errors, sets) of vectors (sets, entries), in standard deviations."""
        return np.stack([self._errors(self.compiled(one)) for one in z], axis=1)

    def compiled(self, z: Array) -> Any:
        """Return the model of MuJoCo with the numbers of a vector (entries,)."""
        set_numbers(self.robot, self.numbers(z))
        return self.robot

    def _errors(self, robot: Any) -> Array:
        import mujoco
        from mujoco import rollout

        recording, logs, system = self.study.recording, self.study.logs, self.study.system
        steps = int(recording.steps.max())
        last = recording.start + recording.steps
        rows = np.minimum(recording.start[:, None] + np.arange(steps + 1), last[:, None])
        inputs = [item.name for item in system.inputs]
        u = logs.u[rows][:, :, [inputs.index(f"tau_{name}") for name in self.names]]
        force = 0.5 * (u[:, 1:] + u[:, :-1])
        states = [state.name for state in system.states]
        q, v = ([states.index(f"{s}_{name}") for name in self.names] for s in ("q", "qd"))
        x = prepare(system, logs).x[recording.start]
        first = np.column_stack([np.zeros(len(x)), x[:, q], x[:, v]])
        spec = int(mujoco.mjtState.mjSTATE_QFRC_APPLIED)
        found, _ = rollout.rollout(robot, mujoco.MjData(robot), first, force, control_spec=spec)
        simulated = np.full((*found.shape[:2], len(states)), np.nan)
        simulated[:, :, q], simulated[:, :, v] = np.split(found[:, :, 1:], 2, axis=2)
        shown = [states.index(str(o.expression)) for o in system.outputs]
        off = (simulated[:, :, shown] - logs.y[recording.rows]) / recording.scale
        off = np.clip(np.nan_to_num(off, nan=LARGEST_ERROR), -LARGEST_ERROR, LARGEST_ERROR)
        return off[recording.counted].ravel()

    def model(self, z: Array, budget: str) -> Model:
        """Return the model of a vector (entries,); `budget` tells simulations and the reason to stop."""
        full = self.joints.start.copy()
        full[self.places] = z
        return self.joints.model(full, budget)


class LinkFit(RobotFit):
    """Free runs in MuJoCo as a function of damping, dry friction, armature and the inertias of the links."""

    def __init__(self, study: Study) -> None:
        import mujoco
        from mujoco import sysid

        super().__init__(study, [QUANTITIES[name] for name in ("damping", "frictionloss", "armature")])
        robot = study.system.robot
        assert robot is not None
        spec = mujoco.MjSpec.from_string(Needed.of(robot.text, robot.file).text)
        for body in spec.bodies[1:]:
            own = self.robot.body(body.name)
            body.mass, body.explicitinertial = float(own.mass[0]), True
            body.ipos, body.iquat, body.inertia = own.ipos, own.iquat, own.inertia
            body.fullinertia = np.full(6, np.nan)  # not given
        spec.compile()
        self.spec = mujoco.MjSpec.from_string(spec.to_xml())  # as MJCF, in which inertias are explicit
        bodies = [self.robot.body(k).name for k in self.robot.jnt_bodyid]
        kind = sysid.InertiaType.Pseudo
        each = [sysid.body_inertia_param(self.spec, self.robot, name, kind) for name in bodies]
        self.links = sysid.ParameterDict({one.name: one for one in each})
        self.bodies, self.own = bodies, len(self.start)
        self.start = np.concatenate([self.start, self.links.as_vector()])
        limits = zip(self.bounds, self.links.get_bounds(), strict=True)
        self.bounds = tuple(np.concatenate(pair) for pair in limits)

    def compiled(self, z: Array) -> Any:
        self.links.update_from_vector(z[self.own :])
        model = copy(self.robot)
        for link, name in zip(self.links.values(), self.bodies, strict=True):
            set_link(model, name, _inertial(link.value))
        set_numbers(model, self.numbers(z[: self.own]))
        return model

    def model(self, z: Array, budget: str) -> Model:
        fitted, given = self.compiled(z), self.robot
        parts = "mass", "ipos", "iquat", "inertia"
        links = {n: tuple(getattr(fitted.body(n), part).copy() for part in parts) for n in self.bodies}
        found = super().model(z[: self.own], budget)
        said = [
            f"mass of {name} {given.body(name).mass[0]:.3g} -> {links[name][0][0]:.3g} kg, largest inertia "
            f"{given.body(name).inertia.max():.3g} -> {links[name][3].max():.3g} kg m^2"
            for name in self.bodies
        ]
        return replace(found, says="; ".join([found.says, *said]), links=links)


def _inertial(theta: Array) -> tuple[Array, ...]:
    """Mass, centre of mass, axes and principal inertias of the ten numbers of a pseudo-inertia.

    `mujoco.sysid.apply_body_inertia` of MuJoCo 4.0.0 makes a specification of them that does not compile.
    """
    import mujoco
    from mujoco.sysid._src import model_modifier as modifier

    pi = modifier.pi_from_theta(theta)
    mass, place = pi[0], pi[1:4] / pi[0]
    cross = modifier.skew(place)
    inertia, axes = np.linalg.eigh(pi[4:].reshape(3, 3) + mass * cross @ cross)
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, axes.ravel())
    return np.array([mass]), place, quaternion, np.maximum(inertia, 1e-9)


def _set_options(model: Any, study: Study) -> None:
    """Leave out contacts and limits, as in the equations, and step with the period of the logs."""
    import mujoco

    flags = mujoco.mjtDisableBit
    model.opt.disableflags |= int(flags.mjDSBL_CONTACT | flags.mjDSBL_LIMIT | flags.mjDSBL_AUTORESET)
    model.opt.timestep = study.logs.period


def set_numbers(model: Any, numbers: Mapping[str, Mapping[str, float]]) -> None:
    """Set numbers of joints, SI, by joint and quantity, in a model of MuJoCo."""
    import mujoco

    names = [plain_name(name) for name in written_names(model, "joint")]
    for joint, entries in numbers.items():
        k = names.index(joint)
        for quantity, value in entries.items():
            place = k if quantity == "stiffness" else model.jnt_dofadr[k]
            getattr(model, OF_JOINTS[quantity])[place] = value
    mujoco.mj_setConst(model, mujoco.MjData(model))


def set_link(model: Any, name: str, numbers: tuple[Array, ...]) -> None:
    """Set mass (kg), centre of mass (m), axes (quaternion) and principal inertias (kg m^2) of a link.

    Constants that follow from them in a model of MuJoCo are not computed again.
    """
    body = model.body(name)
    body.mass[:], body.ipos[:], body.iquat[:], body.inertia[:] = numbers


@dataclass(frozen=True)
class JointNumbers(Supplement):
    """Supplement that also holds the dry friction of joints, and the inertia of links."""

    joints: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    links: Mapping[str, tuple[Array, ...]] = field(default_factory=dict)

    def complete(self, model: Any, where: str = "supplement") -> Callback:
        for name, numbers in self.links.items():
            set_link(model, name, numbers)
        set_numbers(model, self.joints)
        return super().complete(model, where)


def gaps_in_mujoco(model: Model, study: Study) -> dict[str, float]:
    """Return the gap of a model, and of the robot file as given, in MuJoCo on the held-out experiments."""
    if model.answer is not None:
        entry = model.answer.content.get("robot")  # type: ignore[attr-defined]
        if not entry:
            return {}
        runs = entry["replay"]
        final = runs.get("supplemented") or runs["patched"]
        return {"mujoco": final["gap"], "mujoco_given": runs["given"]["gap"]}
    found = {"mujoco_given": _gap(study.system, study.logs, study, {}, {}, {})}
    return {"mujoco": _gap(model.system, model.logs, study, model.joints, model.laws, model.links), **found}


def _gap(system: Any, logs: Any, study: Study, joints: Any, laws: Any, links: Any) -> float:
    robot = study.system.robot
    assert robot is not None
    names = [state.name.removeprefix("q_") for state in system.states if state.name.startswith("q_")]
    applied = {name: system.signals[f"drive_{name}"] - laws.get(name, 0) for name in names}
    numbers = JointNumbers(joints=joints, links=links)
    backend = RobotInMujoco(robot.text, robot.file, [], applied, robot.locked, numbers)
    return replayed(backend, system, prepare(system, logs), study.horizon, study.held_out)[0]
