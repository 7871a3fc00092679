"""Bodies of a robot and the joints between them, as numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Body:
    """Rigid body.

    Attributes:
        name: name, as a name of a system file.
        parent: number of the parent body; -1 for the world.
        position: origin in the parent's frame, shape (3,), m.
        rotation: matrix from this frame to the parent's frame, shape (3, 3).
        mass: mass, kg.
        com: centre of mass in this frame, shape (3,), m.
        inertia: inertia about the centre of mass along the axes of this frame, shape (3, 3), kg m^2.
        joints: numbers of the joints that move the body, in order.
    """

    name: str
    parent: int
    position: Array
    rotation: Array
    mass: float
    com: Array
    inertia: Array
    joints: tuple[int, ...]


@dataclass(frozen=True)
class Coupling:
    """Gear that moves a joint with another one: q = ratio*q_leader + offset.

    Attributes:
        leader: number of the joint that it follows; None: it stands at the offset.
        ratio: ratio of the coordinates, rad or m per rad or m.
        offset: coordinate where that of the leader is zero, rad or m.
    """

    leader: int | None
    ratio: float
    offset: float


@dataclass(frozen=True)
class Joint:
    """Hinge or slide joint.

    Attributes:
        name: name, as a name of a system file.
        written: name in the robot's file.
        slides: whether it is a slide joint.
        axis: axis in the frame of its body, shape (3,), of length one.
        position: point of the axis in the frame of its body, shape (3,), m.
        zero: coordinate at which the body is where its placement says, rad or m.
        armature: inertia or mass of the rotor, seen at the joint, kg m^2 or kg.
        damping: viscous friction, N m s/rad or N s/m.
        stiffness: stiffness of its spring, N m/rad or N/m.
        rest: coordinate at which the spring is at rest, rad or m.
        frictionloss: dry friction of the file, N m or N.
        follows: gear to another joint (`mimic` in a URDF file); None (default): it moves by itself.
    """

    name: str
    written: str
    slides: bool
    axis: Array
    position: Array
    zero: float
    armature: float
    damping: float
    stiffness: float
    rest: float
    frictionloss: float
    follows: Coupling | None = None


@dataclass(frozen=True)
class Actuator:
    """Actuator of one joint: force = clip(gain*a + bias - kp*gear*q - kv*gear*qd), torque = gear*force.

    Its activation a is clip(u), or follows it by timeconst*d(a)/dt = clip(u) - a.

    Attributes:
        name: name, as a name of a system file.
        joint: number of the joint.
        gear: ratio of torque and force.
        gain: force per unit of the input.
        bias: force without input, N m or N.
        kp: stiffness of the servo.
        kv: damping of the servo.
        timeconst: time constant of the activation, s; 0: it is the input.
        inputs: smallest and largest input; None: no limits.
        forces: smallest and largest force; None: no limits.
    """

    name: str
    joint: int
    gear: float
    gain: float
    bias: float
    kp: float
    kv: float
    timeconst: float
    inputs: tuple[float, float] | None
    forces: tuple[float, float] | None

    @property
    def is_servo(self) -> bool:
        """Whether the input is the wanted position (gain kp) or speed (gain kv, kp zero)."""
        return self.gain != 0.0 and self.gain == (self.kp or self.kv)


@dataclass(frozen=True)
class Robot:
    """Tree of bodies with joints and actuators.

    Attributes:
        bodies: bodies, parents first.
        joints: joints, in the order of the file.
        actuators: actuators, in the order of the file.
        gravity: acceleration of gravity in the frame of the world, shape (3,), m/s^2.
        notes: sentences on what the file says and the equations do not.
        massless: numbers of joints that move no inertia, so that no torque determines their motion.
    """

    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    actuators: tuple[Actuator, ...]
    gravity: Array
    notes: tuple[str, ...] = ()
    massless: tuple[int, ...] = ()

    def resting(self, locked: Mapping[int, float]) -> dict[int, float]:
        """Return the coordinate (rad or m) of every joint that does not move, by number of the joint.

        These are locked joints, joints that move no inertia, at zero, and joints that follow such a joint. A
        locked joint follows no other one.
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
