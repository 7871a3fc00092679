"""Numbers of a robot file that can be parameters of a system."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase

from unmodelled.systems.robot.bodies import Actuator, Joint, Robot
from unmodelled.systems.robot.links import Tree

AXES = "xyz"
#: Axes of the numbers of a moment of inertia, in the order of MuJoCo's `fullinertia`.
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


@dataclass(frozen=True)
class Units:
    """Units of the coordinate, speed, torque or force, and armature of a joint."""

    position: str
    speed: str
    effort: str
    inertia: str


def units_of(joint: Joint) -> Units:
    """Return the units at a joint."""
    return Units("m", "m/s", "N", "kg") if joint.slides else Units("rad", "rad/s", "N m", "kg m^2")


@dataclass(frozen=True)
class Property:
    """Number of a body, a joint or an actuator."""

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
    moving = [link.joint for link in tree.links]
    for k in sorted(moving):
        joint = robot.joints[k]
        u = units_of(joint)
        yield Property(joint.name, "armature", joint.armature, u.inertia)
        yield Property(joint.name, "damping", joint.damping, f"{u.effort} s/{u.position}")
        yield Property(joint.name, "stiffness", joint.stiffness, f"{u.effort}/{u.position}")
    for actuator in robot.actuators:
        if actuator.joint in moving:
            yield from _of_actuator(actuator, units_of(robot.joints[actuator.joint]))
    for k in sorted(k for link in tree.links for k in link.bodies):
        body = robot.bodies[k]
        yield Property(body.name, "mass", body.mass, "kg")
        for axis, x in zip(AXES, body.com, strict=True):
            yield Property(body.name, f"com_{axis}", float(x), "m")
        for i, j in PAIRS:
            value = float(body.inertia[i, j])
            yield Property(body.name, f"inertia_{AXES[i]}{AXES[j]}", value, "kg m^2")


def _of_actuator(actuator: Actuator, units: Units) -> Iterator[Property]:
    yield Property(actuator.name, "gear", actuator.gear, "1")
    if actuator.timeconst:
        yield Property(actuator.name, "timeconst", actuator.timeconst, "s")
    if actuator.kp:
        yield Property(actuator.name, "kp", actuator.kp, f"{units.effort}/{units.position}")
    if actuator.kv:
        yield Property(actuator.name, "kv", actuator.kv, f"{units.effort} s/{units.position}")
    if not actuator.is_servo:
        yield Property(actuator.name, "gain", actuator.gain, "1" if actuator.gain == 1.0 else units.effort)
