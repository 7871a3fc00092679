"""What a robot file cannot say of a robot: numbers and forces that MuJoCo gets beside the file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp

from unmodelled.base.errors import BadInput, closest
from unmodelled.base.files import read_json, write_json
from unmodelled.engine.machine.program import Equations, Program, assembled
from unmodelled.systems import grammar
from unmodelled.systems.model import symbol
from unmodelled.systems.robot.compile import plain_name, written_names
from unmodelled.systems.scope import Scope, Value

SCHEMA = "supplement/1"
#: Where a model of MuJoCo holds a number of a joint: array, and the array with the place of the joint in it.
_OF_JOINTS = {
    "armature": ("dof_armature", "jnt_dofadr"),
    "damping": ("dof_damping", "jnt_dofadr"),
    "stiffness": ("jnt_stiffness", None),
    "springref": ("qpos_spring", "jnt_qposadr"),
}
#: Array of a number of an actuator, its column and its sign.
_OF_ACTUATORS = {
    "gear": ("actuator_gear", 0, 1.0),
    "gain": ("actuator_gainprm", 0, 1.0),
    "bias": ("actuator_biasprm", 0, 1.0),
    "kp": ("actuator_biasprm", 1, -1.0),
    "kv": ("actuator_biasprm", 2, -1.0),
}
#: Quantities that a supplement can hold.
QUANTITIES = (*_OF_JOINTS, *_OF_ACTUATORS)
#: Function of model and data, see `mujoco.set_mjcb_passive`.
Callback = Callable[[Any, Any], None]


@dataclass(frozen=True)
class Supplement:
    """Numbers and forces that belong to a robot beside its file.

    Attributes:
        numbers: numbers by joint or actuator and then by quantity, SI; they replace those of the file.
        forces: effort on a joint by its name, N m or N: expression of the grammar of system files in
            q_<joint>, qd_<joint>, applied_<joint> (`qfrc_applied`), u_<actuator> (`ctrl`), t and the names in
            `values`.
        values: numbers of the expressions by name, SI.
    """

    numbers: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    forces: Mapping[str, str] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return bool(self.numbers or self.forces)

    def write(self, path: Path) -> None:
        """Write the supplement as JSON.

        Args:
            path: file, replaced where it exists.

        Raises:
            BadInput: when the file cannot be written.
        """
        write_json(path, {"schema": SCHEMA, **asdict(self)})

    @classmethod
    def read(cls, path: Path) -> Supplement:
        """Read a supplement; nothing in it is executed.

        Args:
            path: JSON file.

        Raises:
            BadInput: when the file cannot be read or is no supplement.
        """
        content = read_json(path)
        if not isinstance(content, dict) or content.get("schema") != SCHEMA:
            raise BadInput(f"{path}: schema: must be {SCHEMA!r}: give the file that diagnose wrote")
        parts = {name: content.get(name, {}) for name in ("numbers", "forces", "values")}
        elements = parts["numbers"] if _is_object(parts["numbers"]) else {"": None}
        numbers = [parts["values"], *elements.values()]
        if not all(map(_is_object, [*numbers, parts["forces"]])):
            raise BadInput(f"{path}: numbers, forces and values must be objects: give the file of diagnose")
        if not all(_is_number(value) for entries in numbers for value in entries.values()):
            raise BadInput(f"{path}: a number is missing or not finite: give the file of diagnose")
        if not all(isinstance(text, str) for text in parts["forces"].values()):
            raise BadInput(f"{path}: a force must be a text: give the file of diagnose")
        return cls(**parts)

    def complete(self, model: Any, where: str = "supplement") -> Callback:
        """Set the numbers in a model of MuJoCo, and return the forces as a callback of passive forces.

        Args:
            model: model of the robot, changed.
            where: start of the error message, such as the name of the file.

        Returns:
            Function of model and data for `mujoco.set_mjcb_passive`.

        Raises:
            BadInput: when the robot has no such joint or actuator, or an expression is not allowed.
        """
        import mujoco

        for element, numbers in self.numbers.items():
            for quantity, value in numbers.items():
                _set(model, element, quantity, value, where)
        mujoco.mj_setConst(model, mujoco.MjData(model))  # inertias that MuJoCo computes once
        return self._callback(model, where) if self.forces else lambda *_: None

    def _callback(self, model: Any, where: str) -> Callback:
        joints, actuators = _names(model, "joint"), _names(model, "actuator")
        states = [f"{s}_{name}" for s in ("q", "qd") for name in joints]
        inputs = [*(f"applied_{name}" for name in joints), *(f"u_{name}" for name in actuators)]
        strange = [name for name in self.forces if name not in joints]
        if strange:
            raise BadInput(f"{where}: forces: the robot has no joint {strange[0]!r}: use its own file")
        x, u, p = ([symbol(name) for name in names] for names in (states, inputs, self.values))
        scope = Scope({str(s): Value(s) for s in (*x, *u, *p)})
        laws = [grammar.parse(text, scope, f"{where}: forces.{n}") for n, text in self.forces.items()]
        equations = Equations(x, u, p, (), [sp.S.Zero] * len(x), laws, {}, ())
        to = [joints.index(name) for name in self.forces]
        return _Forces(assembled(equations), model, to, [*self.values.values()])


class _Forces:
    """Passive forces of the expressions of a supplement."""

    def __init__(self, program: Program, model: Any, joints: list[int], values: list[float]) -> None:
        self.program, self.dofs = program, np.array(model.jnt_dofadr)
        self.places, self.to = np.array(model.jnt_qposadr), np.array(model.jnt_dofadr)[joints]
        self.values, self.nothing = np.array(values, np.float64), np.empty(0)

    def __call__(self, _: Any, data: Any) -> None:
        x = np.concatenate([data.qpos[self.places], data.qvel[self.dofs]])
        u = np.concatenate([data.qfrc_applied[self.dofs], data.ctrl])
        t = np.array(data.time)
        data.qfrc_passive[self.to] += self.program.evaluate(t, x, u, self.values, self.nothing)


def _set(model: Any, element: str, quantity: str, value: float, where: str) -> None:
    """Set a number of a joint or an actuator in a model."""
    if quantity in _OF_JOINTS:
        array, place = _OF_JOINTS[quantity]
        k = _index(model, "joint", element, where)
        getattr(model, array)[k if place is None else getattr(model, place)[k]] = value
    elif quantity in _OF_ACTUATORS:
        import mujoco

        array, column, sign = _OF_ACTUATORS[quantity]
        k = _index(model, "actuator", element, where)
        getattr(model, array)[k, column] = sign * value
        if array == "actuator_biasprm":
            model.actuator_biastype[k] = mujoco.mjtBias.mjBIAS_AFFINE
    else:
        raise BadInput(f"{where}: numbers.{element}: {quantity!r}{closest(quantity, QUANTITIES)}")


def _index(model: Any, kind: str, element: str, where: str) -> int:
    names = _names(model, kind)
    if element not in names:
        raise BadInput(f"{where}: the robot has no {kind} {element!r}{closest(element, names)}")
    return names.index(element)


def _is_object(entries: Any) -> bool:
    return isinstance(entries, dict)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))


def _names(model: Any, kind: str) -> list[str]:
    return [plain_name(written) for written in written_names(model, kind)]
