"""Free runs of a robot in MuJoCo: the fit of mujoco.sysid, and the gap of every method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.head_to_head.joints import QUANTITIES, JointFit
from benchmarks.head_to_head.method import Model
from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.free_runs import replayed
from unmodelled.engine.robot.mujoco_runs import RobotInMujoco
from unmodelled.engine.robot.supplement import Callback, Supplement
from unmodelled.logs.preparation import prepare
from unmodelled.systems.robot.compile import plain_name, written_names
from unmodelled.systems.robot.files import dynamics_only

Array = NDArray[np.float64]

#: Arrays of a model of MuJoCo with one number per degree of freedom, or per joint.
OF_JOINTS = {
    "damping": "dof_damping",
    "armature": "dof_armature",
    "frictionloss": "dof_frictionloss",
    "stiffness": "jnt_stiffness",
}


class RobotFit:
    """Free runs in MuJoCo as a function of damping, dry friction, armature and stiffness of every joint.

    Args:
        study: system of a robot whose joints are driven by torques, with logs.
        families: families of the library that stand for the fitted quantities; default: all of `QUANTITIES`.
    """

    def __init__(self, study: Study, families: Sequence[str] = tuple(QUANTITIES.values())) -> None:
        import mujoco

        self.study, self.joints = study, JointFit.of(study, families)
        robot = study.system.robot
        assert robot is not None
        self.robot = mujoco.MjModel.from_xml_string(dynamics_only(robot.text, robot.file)[0])
        flags = mujoco.mjtDisableBit
        self.robot.opt.disableflags |= int(flags.mjDSBL_CONTACT | flags.mjDSBL_LIMIT | flags.mjDSBL_AUTORESET)
        self.robot.opt.timestep = study.logs.period
        self.names = [plain_name(name) for name in written_names(self.robot, "joint")]
        each = self.joints.unknowns.each
        amplitudes = {e.amplitudes[0]: e for e in self.joints.hypothesis.effects}
        self.places = [k for k, u in enumerate(each) if u.name in amplitudes]
        self.effects = [amplitudes[each[k].name] for k in self.places]
        self.scale = np.array([each[k].scale for k in self.places])
        self.start = self.joints.start[self.places]
        self.bounds = tuple(b[self.places] for b in self.joints.bounds)

    def numbers(self, z: Array) -> dict[str, dict[str, float]]:
        """Return the numbers of the joints by joint and quantity, SI.

        Args:
            z: vector, shape (entries,).
        """
        quantities = {family: quantity for quantity, family in QUANTITIES.items()}
        found: dict[str, dict[str, float]] = {}
        for effect, value in zip(self.effects, z * self.scale, strict=True):
            found.setdefault(effect.place.name, {})[quantities[effect.family]] = float(value)
        return found

    def errors(self, z: Array) -> Array:
        """Return the errors over the training experiments, in standard deviations, shape (errors, sets).

        Args:
            z: vectors, shape (sets, entries).
        """
        return np.stack([self._errors(self.numbers(one)) for one in z], axis=1)

    def _errors(self, numbers: Mapping[str, Mapping[str, float]]) -> Array:
        import mujoco
        from mujoco import rollout

        recording, logs, system = self.study.recording, self.study.logs, self.study.system
        set_numbers(self.robot, numbers)
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
        found, _ = rollout.rollout(
            self.robot,
            mujoco.MjData(self.robot),
            first,
            force,
            control_spec=int(mujoco.mjtState.mjSTATE_QFRC_APPLIED),
        )
        simulated = np.full((*found.shape[:2], len(states)), np.nan)
        simulated[:, :, q], simulated[:, :, v] = np.split(found[:, :, 1:], 2, axis=2)
        shown = [states.index(str(o.expression)) for o in system.outputs]
        off = (simulated[:, :, shown] - logs.y[recording.rows]) / recording.scale
        off = np.clip(np.nan_to_num(off, nan=LARGEST_ERROR), -LARGEST_ERROR, LARGEST_ERROR)
        return off[recording.counted].ravel()

    def model(self, z: Array, budget: str) -> Model:
        """Return the model of a vector.

        Args:
            z: vector, shape (entries,).
            budget: what the optimiser used.
        """
        full = self.joints.start.copy()
        full[self.places] = z
        return self.joints.model(full, budget)


def set_numbers(model: Any, numbers: Mapping[str, Mapping[str, float]]) -> None:
    """Set numbers of joints in a model of MuJoCo.

    Args:
        model: model, changed.
        numbers: numbers by joint and quantity, SI.
    """
    import mujoco

    names = [plain_name(name) for name in written_names(model, "joint")]
    for joint, entries in numbers.items():
        k = names.index(joint)
        for quantity, value in entries.items():
            place = k if quantity == "stiffness" else model.jnt_dofadr[k]
            getattr(model, OF_JOINTS[quantity])[place] = value
    mujoco.mj_setConst(model, mujoco.MjData(model))


@dataclass(frozen=True)
class JointNumbers(Supplement):
    """Supplement that also holds the dry friction of joints."""

    joints: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def complete(self, model: Any, where: str = "supplement") -> Callback:
        set_numbers(model, self.joints)
        return super().complete(model, where)


def gaps_in_mujoco(model: Model, study: Study) -> dict[str, float]:
    """Return the gap of a model, and of the robot file as given, in MuJoCo on the held-out experiments.

    Args:
        model: fitted model of a system with a robot.
        study: known physics, logs and held-out experiments.
    """
    if model.answer is not None:
        entry = model.answer.findings.content.get("robot")  # type: ignore[attr-defined]
        if not entry:
            return {}
        runs = entry["replay"]
        final = runs.get("supplemented") or runs["patched"]
        return {"mujoco": final["gap"], "mujoco_given": runs["given"]["gap"]}
    found = {"mujoco_given": _gap(study.system, study.logs, study, {}, {})}
    return {"mujoco": _gap(model.system, model.logs, study, model.joints, model.laws), **found}


def _gap(system: Any, logs: Any, study: Study, joints: Any, laws: Any) -> float:
    robot = study.system.robot
    assert robot is not None
    names = [state.name.removeprefix("q_") for state in system.states if state.name.startswith("q_")]
    applied = {name: system.signals[f"drive_{name}"] - laws.get(name, 0) for name in names}
    backend = RobotInMujoco(robot.text, robot.file, [], applied, robot.locked, JointNumbers(joints=joints))
    return replayed(backend, system, prepare(system, logs), study.horizon, study.held_out)[0]
