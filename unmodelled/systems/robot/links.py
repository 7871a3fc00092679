"""Links of a robot: bodies that move together, in frames in which most numbers are zero.

The z-axis of a link's frame is the axis of its joint (modified Denavit-Hartenberg convention where the tree
is a chain; W. Khalil and E. Dombre, Modeling, Identification and Control of Robots, 2002, chapter 3).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.systems.robot.bodies import Coupling, Joint, Robot

#: Rounding errors of a rotation matrix; what is nearer to 0 or 1 is 0 or 1.
_ROUNDING = 4e-15


@dataclass
class Placement:
    """Frame in another frame."""

    rotation: Array  # (3, 3), matrix from this frame to the other one
    position: Array  # (3,), origin in the other frame, m

    def __matmul__(self, inner: Placement) -> Placement:
        return Placement(self.rotation @ inner.rotation, self.position + self.rotation @ inner.position)


@dataclass
class Link:
    """Bodies that one joint moves together."""

    joint: int  # number of the joint
    parent: int  # number of the parent link; -1 for the world
    placement: Placement  # in the parent's frame, where the joint's angle or travel is zero
    offset: float  # added to `ratio` times the coordinate of the leader, rad or m
    leader: int  # number of the joint whose coordinate moves the link: its own, or that which it follows
    ratio: float  # of the joint's coordinate to that of the leader; 1 for its own
    start: float  # coordinate of the joint where that of the leader is zero, rad or m
    bodies: dict[int, Placement] = field(default_factory=dict)  # in the frame of the link, by number


@dataclass(frozen=True)
class Tree:
    """Moving links of a robot, parents first."""

    links: tuple[Link, ...]
    gravity: Array  # (3,), acceleration of gravity in the frame of the world, m/s^2

    @property
    def leaders(self) -> tuple[int, ...]:
        """Numbers of the joints that move by themselves, in the order of their links."""
        return tuple(link.joint for link in self.links if link.joint == link.leader)

    @property
    def followers(self) -> dict[int, list[Link]]:
        """Links of the joints that follow each joint that moves by itself, by number of the latter."""
        found: dict[int, list[Link]] = {k: [] for k in self.leaders}
        for link in self.links:
            if link.joint != link.leader:
                found[link.leader].append(link)
        return found

    @classmethod
    def of(cls, robot: Robot, locked: Mapping[int, float]) -> Tree:
        """Return the links of a robot."""
        resting, following = robot.resting(locked), robot.following(locked)
        links: list[Link] = []
        places: dict[int, tuple[int, Placement]] = {-1: (-1, Placement(np.eye(3), np.zeros(3)))}
        for number, body in enumerate(robot.bodies):
            link, place = places[body.parent]
            place = place @ Placement(body.rotation, body.position)
            for j in body.joints:
                joint = robot.joints[j]
                if j in resting:
                    place = place @ _moved(joint, resting[j] - joint.zero)
                    continue
                axis = Placement(_from_z(joint.axis), joint.position)
                gear = following.get(j, Coupling(j, 1.0, 0.0))
                assert gear.leader is not None
                own = gear.leader, gear.ratio, gear.offset
                links.append(Link(j, link, place @ axis, gear.offset - joint.zero, *own))
                link, place = len(links) - 1, Placement(axis.rotation.T, -axis.rotation.T @ joint.position)
            places[number] = link, place
            if link >= 0:
                links[link].bodies[number] = place
        gravity = _aligned(links, robot)
        return cls(tuple(links), gravity)


def _moved(joint: Joint, q: float) -> Placement:
    if joint.slides:
        return Placement(np.eye(3), joint.axis * q)
    to_axis = _from_z(joint.axis)
    turned = to_axis @ about_z(q) @ to_axis.T
    return Placement(turned, joint.position - turned @ joint.position)


def about_z(angle: float) -> Array:
    """Return the matrix (3, 3) of a rotation about z; angle in rad."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _from_z(axis: Array) -> Array:
    """Matrix of a rotation that turns z into an axis."""
    first = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = np.cross(first, axis)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(axis, x), axis], 1)


def _aligned(links: list[Link], robot: Robot) -> Array:
    """Choose the frames so that most numbers are zero, and return gravity in the frame of the world."""
    gravity = robot.gravity
    eldest = {link.parent: k for k, link in reversed(list(enumerate(links)))}
    for k, link in reversed(list(enumerate(links))):
        if robot.joints[link.joint].slides:
            continue
        before, inner, after = _angles(link.placement.rotation)
        link.placement.rotation = about_z(before) @ _about_x(inner)
        link.offset += after
        if eldest[link.parent] == k:  # its parent's frame turns about z instead
            for placement in _inside(links, link.parent):
                _put(placement, Placement(about_z(-before), np.zeros(3)) @ placement)
            if link.parent < 0:
                gravity = about_z(-before) @ gravity
            elif robot.joints[links[link.parent].joint].slides:
                turned = links[link.parent].placement
                turned.rotation = turned.rotation @ about_z(before)
            else:
                links[link.parent].offset += before
        _shift(links, k)
    for link in links:
        link.placement.rotation = clean(link.placement.rotation)
        link.placement.position = clean(link.placement.position)
    return clean(gravity)


def _inside(links: list[Link], k: int) -> list[Placement]:
    """What is placed in the frame of a link, or of the world: bodies and links."""
    bodies = list(links[k].bodies.values()) if k >= 0 else []
    return [*bodies, *(link.placement for link in links if link.parent == k)]


def _put(placement: Placement, new: Placement) -> None:
    placement.rotation, placement.position = new.rotation, new.position


def _shift(links: list[Link], k: int) -> None:
    """Move the origin of a hinged link along its axis so that a number of its position is zero."""
    place = links[k].placement
    axis = place.rotation[:, 2]
    zero = 1 if abs(axis[1]) > 0.5 else 2
    way = -place.position[zero] / axis[zero]
    place.position = place.position + way * axis
    place.position[zero] = 0.0
    for placement in _inside(links, k):
        placement.position = placement.position - np.array([0.0, 0.0, way])


def _angles(r: Array) -> tuple[float, float, float]:
    """Angles of a rotation about z, then x, then z."""
    inner = math.atan2(math.hypot(r[0, 2], r[1, 2]), r[2, 2])
    before = math.atan2(r[0, 2], -r[1, 2]) if math.sin(inner) > _ROUNDING else 0.0
    rest = (about_z(before) @ _about_x(inner)).T @ r  # accurate however small the inner angle is
    return before, inner, math.atan2(rest[1, 0], rest[0, 0])


def _about_x(angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def clean(numbers: Array) -> Array:
    """Return numbers (...) without the rounding errors of 0, 1 and -1."""
    near = np.clip(np.round(numbers), -1.0, 1.0)
    return np.where(np.abs(numbers - near) < _ROUNDING, near, numbers)
