"""All numbers of a robot that a patched file can change, by element and quantity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf, isclose

from unmodelled.systems.robot.actuators import input_unit
from unmodelled.systems.robot.bodies import Actuator, Joint, Robot
from unmodelled.systems.robot.properties import AXES, PAIRS, units_of

#: Name of the body, joint or actuator, and name of the number; no two kinds of element share a quantity.
Key = tuple[str, str]

OF_JOINTS = ("armature", "damping", "stiffness", "springref", "frictionloss")
OF_ACTUATORS = (
    "gear",
    "gain",
    "bias",
    "kp",
    "kv",
    "timeconst",
    "ctrl_low",
    "ctrl_high",
    "force_low",
    "force_high",
)
OF_BODIES = (
    *("mass", *(f"com_{axis}" for axis in AXES)),
    *(f"inertia_{AXES[i]}{AXES[j]}" for i, j in PAIRS),
)


def numbers(robot: Robot) -> dict[Key, float]:
    """Return the numbers of a robot by element and quantity, SI; a limit that is missing is infinite."""
    found: dict[Key, float] = {}
    for joint in robot.joints:
        found |= {(joint.name, quantity): value for quantity, value in _of_joint(joint).items()}
    for actuator in robot.actuators:
        found |= {(actuator.name, quantity): value for quantity, value in _of_actuator(actuator).items()}
    for body in robot.bodies:
        values = [body.mass, *body.com.tolist(), *(float(body.inertia[i, j]) for i, j in PAIRS)]
        found |= {(body.name, quantity): v for quantity, v in zip(OF_BODIES, values, strict=True)}
    return found


def _of_joint(joint: Joint) -> dict[str, float]:
    values = (joint.armature, joint.damping, joint.stiffness, joint.rest, joint.frictionloss)
    return dict(zip(OF_JOINTS, values, strict=True))


def _of_actuator(actuator: Actuator) -> dict[str, float]:
    given = (actuator.gear, actuator.gain, actuator.bias, actuator.kp, actuator.kv, actuator.timeconst)
    limits = (*(actuator.inputs or (-inf, inf)), *(actuator.forces or (-inf, inf)))
    return dict(zip(OF_ACTUATORS, (*given, *limits), strict=True))


def of(all_of_them: Mapping[Key, float], element: str, quantities: Sequence[str]) -> dict[str, float]:
    """Return the numbers of an element by quantity, without those that are not there."""
    return {q: all_of_them[element, q] for q in quantities if (element, q) in all_of_them}


def consistent(robot: Robot, wanted: Mapping[Key, float]) -> dict[Key, float]:
    """Return numbers as a robot file says them: the gain of a motor is part of its gear."""
    found = dict(wanted)
    for given in robot.actuators:
        name = given.name
        own = of(wanted, name, OF_ACTUATORS)
        free = not (own["kp"] or own["kv"] or own["bias"])
        if given.gain == 1.0 and free and own["gain"] > 0.0:
            found[name, "gear"] = own["gear"] * own["gain"]
            found |= {(name, end): own[end] / own["gain"] for end in ("force_low", "force_high")}
            found[name, "gain"] = 1.0
    return found


def servo_gains(robot: Robot, wanted: Mapping[Key, float]) -> dict[Key, float]:
    """Return the gains of servos that follow from their stiffness or damping."""
    found = {}
    for given in robot.actuators:
        kp, kv = (wanted[given.name, quantity] for quantity in ("kp", "kv"))
        if given.is_servo:
            found[given.name, "gain"] = kp or kv
    return found


def differing(wanted: Mapping[Key, float], found: Mapping[Key, float]) -> dict[Key, float]:
    """Return the wanted numbers that differ from the found ones by more than their rounding in the file."""
    # ten digits are written, and a matrix of inertia is turned
    close = {key: isclose(value, found[key], rel_tol=1e-8, abs_tol=1e-14) for key, value in wanted.items()}
    return {key: value for key, value in wanted.items() if not close[key]}


def unit_of(robot: Robot, key: Key) -> str:
    """Return the SI unit of a number."""
    element, quantity = key
    if quantity in OF_BODIES:
        return "kg" if quantity == "mass" else "m" if quantity.startswith("com_") else "kg m^2"
    actuators = {a.name: a for a in robot.actuators} if quantity in OF_ACTUATORS else {}
    joints = {j.name: j for j in robot.joints}
    u = units_of(robot.joints[actuators[element].joint] if actuators else joints[element])
    if quantity.startswith("ctrl_"):
        return input_unit(robot, actuators[element])
    stiffness, damping = f"{u.effort}/{u.position}", f"{u.effort} s/{u.position}"
    known = {"armature": u.inertia, "springref": u.position, "stiffness": stiffness, "kp": stiffness}
    known |= {"damping": damping, "kv": damping, "gear": "1", "gain": "1", "timeconst": "s"}
    return known.get(quantity, u.effort)
