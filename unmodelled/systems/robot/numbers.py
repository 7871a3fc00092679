"""All numbers of a robot that a patched file can change, and those that can be parameters of a system."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from math import inf, isclose

from unmodelled.systems.robot.actuators import input_unit
from unmodelled.systems.robot.bodies import Robot
from unmodelled.systems.robot.links import Tree

#: Name of the body, joint or actuator, and name of the number; no two kinds of element share a quantity.
Key = tuple[str, str]

#: Axes of the numbers of a moment of inertia, in the order of MuJoCo's `fullinertia`.
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
OF_JOINTS = ("armature", "damping", "stiffness", "springref", "frictionloss")
_LIMITS = ("ctrl_low", "ctrl_high", "force_low", "force_high")
OF_ACTUATORS = ("gear", "gain", "bias", "kp", "kv", "timeconst", *_LIMITS)
OF_BODIES = ("mass", "com_x", "com_y", "com_z", *(f"inertia_{'xyz'[i]}{'xyz'[j]}" for i, j in PAIRS))
#: Factor of all moments of inertia about the centre of mass, which no file writes.
SCALE = "inertia_scale"
#: Limits of what has none.
_FREE = (-inf, inf)


def numbers(robot: Robot) -> dict[Key, float]:
    """Return the numbers of a robot by element and quantity, SI; a limit that is missing is infinite."""
    rows: list[tuple[str, tuple[str, ...], tuple[float, ...]]] = []
    for j in robot.joints:
        rows.append((j.name, OF_JOINTS, (j.armature, j.damping, j.stiffness, j.rest, j.frictionloss)))
    for a in robot.actuators:
        limits = (*(a.inputs or _FREE), *(a.forces or _FREE))
        rows.append((a.name, OF_ACTUATORS, (a.gear, a.gain, a.bias, a.kp, a.kv, a.timeconst, *limits)))
    for b in robot.bodies:
        inertias = (float(b.inertia[i, j]) for i, j in PAIRS)
        rows.append((b.name, OF_BODIES, (b.mass, *b.com.tolist(), *inertias)))
    return {(name, q): value for name, qs, row in rows for q, value in zip(qs, row, strict=True)}


@dataclass(frozen=True)
class Property:
    """Number of a body, a joint or an actuator that can be a parameter of a system."""

    element: str  # name of the body, joint or actuator
    quantity: str  # name of the number, such as "armature"
    value: float  # value in the file, SI
    unit: str

    @property
    def name(self) -> str:
        """Name of the parameter."""
        return f"{self.element}_{self.quantity}"

    def matches(self, pattern: str) -> bool:
        """Return whether a pattern such as "*.armature" names the number."""
        return fnmatchcase(f"{self.element}.{self.quantity}", pattern)


def properties(robot: Robot, tree: Tree) -> Iterator[Property]:
    """Yield all numbers of a robot file that can influence the motion of its links."""
    values, moving = numbers(robot), sorted(link.joint for link in tree.links)
    of_joint = ("armature", "damping", "stiffness")
    keys = [(robot.joints[k].name, quantity) for k in moving for quantity in of_joint]
    for a in (a for a in robot.actuators if a.joint in moving):
        used = ["gear", *(quantity for quantity in ("timeconst", "kp", "kv") if getattr(a, quantity))]
        keys += [(a.name, quantity) for quantity in (used if a.is_servo else [*used, "gain"])]
    bodies = sorted(k for link in tree.links for k in link.bodies)
    keys += [(robot.bodies[k].name, quantity) for k in bodies for quantity in (*OF_BODIES, SCALE)]
    values |= {(robot.bodies[k].name, SCALE): 1.0 for k in bodies}
    # the input of a motor with another gain than 1 has no unit
    gains = {(a.name, "gain"): robot.joints[a.joint].units.effort for a in robot.actuators if a.gain != 1.0}
    yield from (Property(*key, values[key], gains.get(key) or unit_of(robot, key)) for key in keys)


def of(all_of_them: Mapping[Key, float], element: str, quantities: Sequence[str]) -> dict[str, float]:
    """Return the numbers of an element by quantity, without those that are not there."""
    return {q: all_of_them[element, q] for q in quantities if (element, q) in all_of_them}


def whole_links(robot: Robot, changed: Mapping[Key, float]) -> dict[Key, float]:
    """Return changed numbers with those of the inertia that follow of a mass and of `SCALE`."""
    found = {key: value for key, value in changed.items() if key[1] != SCALE}
    for body in robot.bodies:
        scale = changed.get((body.name, SCALE), 1.0)
        if body.mass > 0.0:
            scale *= changed.get((body.name, "mass"), body.mass) / body.mass
        own = {(body.name, f"inertia_{'xyz'[i]}{'xyz'[j]}"): float(body.inertia[i, j]) for i, j in PAIRS}
        found |= {key: scale * value for key, value in own.items() if scale != 1.0 and key not in found}
    return found


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
    if quantity == SCALE:
        return "1"
    if quantity in OF_BODIES:
        return "kg" if quantity == "mass" else "m" if quantity.startswith("com_") else "kg m^2"
    actuators = {a.name: a for a in robot.actuators} if quantity in OF_ACTUATORS else {}
    joints = {j.name: j for j in robot.joints}
    u = (robot.joints[actuators[element].joint] if actuators else joints[element]).units
    if quantity.startswith("ctrl_"):
        return input_unit(robot, actuators[element])
    stiffness, damping = f"{u.effort}/{u.position}", f"{u.effort} s/{u.position}"
    known = {"armature": u.inertia, "springref": u.position, "stiffness": stiffness, "kp": stiffness}
    known |= {"damping": damping, "kv": damping, "gear": "1", "gain": "1", "timeconst": "s"}
    return known.get(quantity, u.effort)
