"""What a robot file cannot say of a robot: numbers and forces that MuJoCo gets beside the file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
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

    Forces and rates are expressions of the grammar of system files in q_<joint>, qd_<joint>, applied_<joint>
    (`qfrc_applied`), u_<actuator> (`ctrl`), t and the names in `values` and `rates`.
    """

    #: numbers by joint or actuator and quantity, SI; they replace those of the file
    numbers: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    forces: Mapping[str, str] = field(default_factory=dict)  # effort on a joint by its name, N m or N
    values: Mapping[str, float] = field(default_factory=dict)  # numbers of the expressions, SI
    rates: Mapping[str, str] = field(default_factory=dict)  # derivatives of states that a force remembers by
    starts: Mapping[str, float] = field(default_factory=dict)  # initial values of these states, default 0

    def __bool__(self) -> bool:
        return bool(self.numbers or self.forces)

    def write(self, path: Path) -> None:
        """Write the supplement as JSON."""
        write_json(path, {"schema": SCHEMA, **asdict(self)})

    @classmethod
    def read(cls, path: Path) -> Supplement:
        """Read a supplement; nothing in it is executed."""
        content = read_json(path)
        if not isinstance(content, dict) or content.get("schema") != SCHEMA:
            raise BadInput(f"{path}: schema: must be {SCHEMA!r}: give the file that diagnose wrote")
        parts = {f.name: content.get(f.name, {}) for f in fields(cls)}
        elements = parts["numbers"] if isinstance(parts["numbers"], dict) else {"": None}
        numbers = [parts["values"], parts["starts"], *elements.values()]
        texts = [parts["forces"], parts["rates"]]
        if not all(isinstance(entries, dict) for entries in [*numbers, *texts]):
            raise BadInput(f"{path}: {', '.join(parts)} must be objects: give the file of diagnose")
        if not all(_is_number(value) for entries in numbers for value in entries.values()):
            raise BadInput(f"{path}: a number is missing or not finite: give the file of diagnose")
        if not all(isinstance(text, str) for entries in texts for text in entries.values()):
            raise BadInput(f"{path}: a force or a rate must be a text: give the file of diagnose")
        return cls(**parts)

    def complete(self, model: Any, where: str = "supplement") -> Forces:
        """Set the numbers in a model of MuJoCo, and return the forces as a callback of passive forces."""
        import mujoco

        for element, numbers in self.numbers.items():
            for quantity, value in numbers.items():
                _set(model, element, quantity, value, where)
        mujoco.mj_setConst(model, mujoco.MjData(model))  # inertias that MuJoCo computes once
        return Forces(self, model, where)


class Forces:
    """Passive forces of the expressions of a supplement, with the states (states,) that they remember by."""

    def __init__(self, supplement: Supplement, model: Any, where: str) -> None:
        joints, actuators = _names(model, "joint"), _names(model, "actuator")
        states = [f"{s}_{name}" for s in ("q", "qd") for name in joints]
        inputs = [*(f"applied_{name}" for name in joints), *(f"u_{name}" for name in actuators)]
        strange = [name for name in supplement.forces if name not in joints]
        if strange:
            raise BadInput(f"{where}: forces: the robot has no joint {strange[0]!r}: use its own file")
        names = ([*states, *supplement.rates], inputs, supplement.values)
        x, u, p = ([symbol(name) for name in each] for each in names)
        scope = Scope({str(s): Value(s) for s in (*x, *u, *p)})
        laws, rates = (
            [grammar.parse(text, scope, f"{where}: {part}.{n}") for n, text in texts.items()]
            for part, texts in (("forces", supplement.forces), ("rates", supplement.rates))
        )
        slopes = [sp.diff(rate, symbol(n)) for rate in rates for n in supplement.rates]
        still = [sp.S.Zero] * len(x)
        self.laws = assembled(Equations(x, u, p, (), still, laws, {}, ()))
        self.changes = assembled(Equations(x, u, p, (), still, [*rates, *slopes], {}, ()))
        self.places, self.dofs = np.array(model.jnt_qposadr), np.array(model.jnt_dofadr)
        self.to = self.dofs[[joints.index(name) for name in supplement.forces]]
        self.values = np.array([*supplement.values.values()], np.float64)
        self.starts = np.array([supplement.starts.get(name, 0.0) for name in supplement.rates])
        self.begin(np.inf, self.starts)

    def begin(self, time: float, memory: Array) -> None:
        """Set a time, s, and what the forces remember then (states,)."""
        self.time, self.memory = time, memory.copy()

    def __call__(self, _: Any, data: Any) -> None:
        if not len(self.to):
            return
        if data.time < self.time:  # a new run
            self.begin(data.time, self.starts)
        x = np.concatenate([data.qpos[self.places], data.qvel[self.dofs], self.memory])
        u = np.concatenate([data.qfrc_applied[self.dofs], data.ctrl])
        if data.time > self.time and len(self.memory):
            self._advance(data.time, x, u)
            x[-len(self.memory) :] = self.memory
        data.qfrc_passive[self.to] += self._evaluated(self.laws, data.time, x, u)

    def _advance(self, time: float, x: Array, u: Array) -> None:
        """Integrate the memory to a time, exactly where its rates are linear in it: bristles are stiff."""
        from scipy.linalg import expm

        n = len(self.memory)
        both = self._evaluated(self.changes, time, x, u)
        ahead = np.zeros((n + 1, n + 1))
        ahead[:n, :n], ahead[:n, n] = both[n:].reshape(n, n), both[:n]
        self.memory = self.memory + expm((time - self.time) * ahead)[:n, n]
        self.time = time

    def _evaluated(self, program: Program, time: float, x: Array, u: Array) -> Array:
        return program.evaluate(np.array(time), x, u, self.values, np.empty(0))


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


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))


def _names(model: Any, kind: str) -> list[str]:
    return [plain_name(written) for written in written_names(model, kind)]


def supplement(model: Any, path: Path | str) -> Callback:
    """Complete a model of MuJoCo with the supplement of a patched robot file.

    The numbers of the supplement are set in the model. Its forces are expressions that are read as those of a
    system file; nothing is executed.

    Args:
        model: `mujoco.MjModel` of the patched file.
        path: supplement, `answer/robot/<file>_supplement.json` of a diagnosis.

    Returns:
        Function of model and data that adds the forces, for `mujoco.set_mjcb_passive`.

    Raises:
        BadInput: when the file is no supplement, or belongs to another robot.

    Examples:
        >>> import json, mujoco
        >>> from tempfile import TemporaryDirectory
        >>> import unmodelled as um
        >>> cart = '''<mujoco><worldbody><body><joint name="rail" type="slide"/><geom size="0.1"/></body>
        ...   </worldbody></mujoco>'''
        >>> model = mujoco.MjModel.from_xml_string(cart)
        >>> content = {"schema": "supplement/1", "forces": {"rail": "-k*qd_rail**2"}, "values": {"k": 3.0}}
        >>> with TemporaryDirectory() as folder:
        ...     path = Path(folder, "cart_supplement.json")
        ...     path.write_text(json.dumps(content)) > 0
        ...     mujoco.set_mjcb_passive(um.supplement(model, path))
        True
        >>> data = mujoco.MjData(model)
        >>> data.qvel[0] = 2.0
        >>> mujoco.mj_forward(model, data)
        >>> data.qfrc_passive[0].item()
        -12.0
        >>> mujoco.set_mjcb_passive(None)
    """
    return Supplement.read(Path(path)).complete(model, str(path))
