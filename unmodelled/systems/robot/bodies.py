"""Bodies of a robot and the joints between them, as numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from unmodelled.base.arrays import Array


@dataclass(frozen=True)
class Body:
    """Rigid body."""

    name: str  # name in a system file
    parent: int  # number of the parent body; -1 for the world
    position: Array  # (3,), origin in the parent's frame, m
    rotation: Array  # (3, 3), matrix from this frame to the parent's frame
    mass: float  # kg
    com: Array  # (3,), centre of mass in this frame, m
    inertia: Array  # (3, 3), about the centre of mass along the axes of this frame, kg m^2
    joints: tuple[int, ...]  # numbers of the joints that move the body, in order


@dataclass(frozen=True)
class Coupling:
    """Gear that moves a joint with another one: q = ratio*q_leader + offset."""

    leader: int | None  # number of the joint that it follows; None: it stands at the offset
    ratio: float
    offset: float  # rad or m


class Units(NamedTuple):
    """Units of the coordinate, speed, torque or force, and armature of a joint."""

    position: str
    speed: str
    effort: str
    inertia: str


@dataclass(frozen=True)
class Joint:
    """Hinge or slide joint."""

    name: str  # name in a system file
    written: str  # name in the robot's file
    slides: bool
    axis: Array  # (3,), unit vector in the frame of its body
    position: Array  # (3,), point of the axis in the frame of its body, m
    zero: float  # coordinate at which the body is where its placement says, rad or m
    armature: float  # inertia or mass of the rotor, seen at the joint, kg m^2 or kg
    damping: float  # viscous friction, N m s/rad or N s/m
    stiffness: float  # stiffness of its spring, N m/rad or N/m
    rest: float  # coordinate at which the spring is at rest, rad or m
    frictionloss: float  # dry friction of the file, N m or N
    follows: Coupling | None = None  # gear to another joint (`mimic` in a URDF); None: it moves by itself

    @property
    def units(self) -> Units:
        """Units of its numbers."""
        return Units("m", "m/s", "N", "kg") if self.slides else Units("rad", "rad/s", "N m", "kg m^2")


@dataclass(frozen=True)
class Actuator:
    """Actuator of one joint: force = clip(gain*a + bias - kp*gear*q - kv*gear*qd), torque = gear*force.

    Its activation a is clip(u), or follows it by timeconst*d(a)/dt = clip(u) - a.
    """

    name: str  # name in a system file
    joint: int  # number of the joint
    gear: float  # ratio of torque and force
    gain: float  # force per unit of the input
    bias: float  # force without input, N m or N
    kp: float  # stiffness of a servo
    kv: float  # damping of a servo
    timeconst: float  # time constant of the activation, s; 0: it is the input
    inputs: tuple[float, float] | None  # smallest and largest input; None: no limits
    forces: tuple[float, float] | None  # smallest and largest force; None: no limits

    @property
    def is_servo(self) -> bool:
        """Whether the input is the wanted position (gain kp) or speed (gain kv, kp zero)."""
        return self.gain != 0.0 and self.gain == (self.kp or self.kv)


@dataclass(frozen=True)
class Robot:
    """Tree of bodies with joints and actuators."""

    bodies: tuple[Body, ...]  # parents first
    joints: tuple[Joint, ...]  # in the order of the file
    actuators: tuple[Actuator, ...]  # in the order of the file
    gravity: Array  # (3,), acceleration in the frame of the world, m/s^2
    notes: tuple[str, ...] = ()  # sentences on what the file says and the equations do not
    massless: tuple[int, ...] = ()  # joints that move no inertia, so that no torque determines their motion

    def resting(self, locked: Mapping[int, float]) -> dict[int, float]:
        """Return the coordinate (rad or m) of every joint that does not move, by number of the joint.

        These are locked joints, joints that move no inertia, at zero, and joints that follow such a joint.
        """
        ends = {k: self._followed(k, locked) for k in range(len(self.joints))}
        return {k: end.offset for k, end in ends.items() if end.leader is None}

    def following(self, locked: Mapping[int, float]) -> dict[int, Coupling]:
        """Return the gear of every moving joint to a joint that moves by itself, by number of the joint."""
        ends = {k: self._followed(k, locked) for k in range(len(self.joints))}
        return {k: end for k, end in ends.items() if end.leader not in (None, k)}

    def _followed(self, k: int, locked: Mapping[int, float]) -> Coupling:
        """Gear of a joint to the last joint of its chain of leaders, possibly itself."""
        leader: int | None = k
        ratio, offset = 1.0, 0.0
        while leader is not None:
            coupling = self.joints[leader].follows
            if leader in locked:
                coupling = Coupling(None, 0.0, locked[leader])
            elif leader in self.massless:
                coupling = Coupling(None, 0.0, 0.0)
            if coupling is None:
                break
            offset += ratio * coupling.offset
            ratio *= coupling.ratio
            leader = coupling.leader if ratio else None
        return Coupling(leader, ratio, offset)
