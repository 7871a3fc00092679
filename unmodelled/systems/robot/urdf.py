"""Writer of numbers into the elements of a URDF file."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping

from unmodelled.systems.robot.bodies import Robot
from unmodelled.systems.robot.numbers import OF_BODIES, OF_JOINTS, Key, of
from unmodelled.systems.robot.tree import RobotTree, row

#: Attribute of `dynamics` by quantity of a joint; URDF has no others.
_DYNAMICS = {"damping": "damping", "frictionloss": "friction"}


def write(tree: RobotTree, robot: Robot, wanted: Mapping[Key, float], changed: Mapping[Key, float]) -> None:
    """Write numbers into the elements of a file, as far as URDF can say them."""
    for joint in robot.joints:
        new = of(changed, joint.name, OF_JOINTS)
        for quantity in new.keys() & _DYNAMICS.keys():
            dynamics = _inside(tree.elements["joint"][joint.name], "dynamics")
            dynamics.set(_DYNAMICS[quantity], row(new[quantity]))
    for body in robot.bodies:
        if new := of(changed, body.name, OF_BODIES):
            _inertial(tree.elements["body"][body.name], of(wanted, body.name, OF_BODIES), new)


def _inertial(link: ET.Element, wanted: Mapping[str, float], new: Mapping[str, float]) -> None:
    inertial = _inside(link, "inertial")
    if "mass" in new:
        _inside(inertial, "mass").set("value", row(wanted["mass"]))
    origin = _inside(inertial, "origin")
    if any(quantity.startswith("com_") for quantity in new):
        origin.set("xyz", row(*(wanted[q] for q in OF_BODIES if q.startswith("com_"))))
    if any(quantity.startswith("inertia_") for quantity in new):
        origin.set("rpy", "0 0 0")
        for quantity in OF_BODIES:
            if quantity.startswith("inertia_"):
                axes = quantity.removeprefix("inertia_")
                _inside(inertial, "inertia").set(f"i{axes}", row(wanted[quantity]))


def _inside(parent: ET.Element, tag: str) -> ET.Element:
    """The element of a name in its parent, which gets one if it has none."""
    found = parent.find(tag)
    if found is None:
        found = ET.SubElement(parent, tag)
        if len(parent) > 1:
            before = parent[-2]
            found.tail, before.tail = before.tail, parent.text
    return found
