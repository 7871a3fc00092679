"""Robot files as models of MuJoCo, with the inertias and gears that they write."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from unmodelled.base.errors import BadInput, first_few
from unmodelled.systems.robot.bodies import Coupling
from unmodelled.systems.robot.files import Needed
from unmodelled.systems.robot.inertials import LARGEST_NUMBER, set_inertials

#: Arrays of a compiled model that must be finite, by the kind of their rows.
_FINITE = {
    "body": ("body_pos", "body_quat", "body_mass", "body_ipos", "body_iquat", "body_inertia"),
    "joint": (
        *("jnt_pos", "jnt_axis", "jnt_stiffness", "qpos0", "qpos_spring"),
        *("dof_armature", "dof_damping", "dof_frictionloss"),
    ),
    "actuator": ("actuator_gear", "actuator_gainprm", "actuator_biasprm", "actuator_dynprm"),
}
#: Time constant (s) and damping ratio, and impedances of a gear: as stiff as MuJoCo's time step allows.
_RIGID = (0.004, 1.0), (0.9999, 0.9999)


@dataclass(frozen=True)
class Loaded:
    """Robot file in MuJoCo."""

    model: Any  # `mujoco.MjModel`
    urdf: bool
    notes: tuple[str, ...]  # sentences on numbers of the file that were not used, or that no solid body has


def loaded(text: str, where: str) -> Loaded:
    """Compile an MJCF or URDF file, of which only the dynamics are read."""
    import mujoco

    needed = Needed.of(text, where)
    warn = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)  # MuJoCo writes its warnings to a file
    try:
        if needed.mimics:
            spec = mujoco.MjSpec.from_string(needed.text)
            for name, (leader, ratio, offset) in needed.mimics.items():
                gear = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT)
                gear.name1, gear.name2 = name, leader or ""
                gear.data[:2] = offset, ratio
                gear.solref[:], gear.solimp[:2] = _RIGID
            model = spec.compile()
        else:
            model = mujoco.MjModel.from_xml_string(needed.text)
    except (ValueError, TypeError) as error:
        # lines are those of the part that MuJoCo gets
        said = re.sub(r",? line \d+", "", " ".join(str(error).split()))
        raise BadInput(f"{where}: MuJoCo: {said}: correct this element") from None
    finally:
        mujoco.set_mju_user_warning(warn)
    set_inertials(model, needed.inertials)
    return Loaded(model, needed.urdf, (*needed.notes, *_of_inertials(model, needed)))


def _of_inertials(model: Any, needed: Needed) -> Iterator[str]:
    import mujoco

    strange = [name for name, inertial in needed.inertials.items() if not inertial.possible]
    bodies = {name: mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name) for name in strange}
    still = [name for name, k in bodies.items() if model.body_weldid[max(k, 0)] == 0]
    if still:
        yield f"masses and inertias of {first_few(still)} are not used: these links do not move"
    if moving := [name for name in strange if name not in still]:
        words = "they are used as written; correct them in the file, MuJoCo itself refuses it"
        yield f"the inertias of {first_few(moving)} are those of no solid body: {words}"


def couplings(model: Any, names: list[str], where: str) -> dict[int, Coupling]:
    """Return the gears between joints by number of the joint that follows."""
    found: dict[int, Coupling] = {}
    for e in np.flatnonzero(model.eq_active0):
        k, leader = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
        what = f"{where}: joint {names[k]!r}: follows"
        if np.any(model.eq_data[e, 2:5]):
            words = "write a straight line (polycoef), or remove the constraint"
            raise BadInput(f"{what} another joint by a curve, which has no equations here: {words}")
        if k in found:
            words = "a closed chain has no equations here: remove one of the gears"
            raise BadInput(f"{what} two joints: {words}")
        ratio = float(model.eq_data[e, 1]) if leader >= 0 else 0.0
        zero = ratio * model.qpos0[leader] if ratio else 0.0
        offset = float(model.eq_data[e, 0] + model.qpos0[k] - zero)
        found[k] = Coupling(leader if leader >= 0 else None, ratio, offset)
    for first in found:
        last, seen = found[first].leader, {first}
        while last is not None and last in found:
            if last in seen:
                raise BadInput(f"{where}: joint {names[first]!r}: follows itself: remove one of the gears")
            seen.add(last)
            last = found[last].leader
    return found


def check_finite(model: Any, names: dict[str, list[str]], where: str) -> None:
    """Refuse a model with a number that is infinite or none."""
    for kind, arrays in _FINITE.items():
        for array in arrays:
            wrong = ~(np.abs(np.asarray(getattr(model, array), np.float64)) < LARGEST_NUMBER)
            for row in np.unique(np.nonzero(wrong)[0]):
                number = array.split("_", 1)[-1]
                words = f"its {number} is not a finite number: correct it"
                raise BadInput(f"{where}: {kind} {names[kind][row]!r}: {words}")
    if not np.all(np.isfinite(model.opt.gravity)):
        raise BadInput(f"{where}: option gravity: is not finite: correct it")
