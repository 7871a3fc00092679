"""Other numbers in a robot file: the same file in which attributes were changed or added."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees, inf

from unmodelled.base.errors import BadInput
from unmodelled.systems.robot.bodies import Robot
from unmodelled.systems.robot.compile import compiled
from unmodelled.systems.robot.numbers import (
    OF_ACTUATORS,
    OF_BODIES,
    OF_JOINTS,
    Key,
    consistent,
    differing,
    numbers,
    of,
)
from unmodelled.systems.robot.tree import RobotTree, row

#: Attribute of `dynamics` in a URDF by quantity of a joint; URDF has no others.
_DYNAMICS = {"damping": "damping", "frictionloss": "friction"}
#: Attributes of an MJCF that turn the axes of an inertia.
_TURNED = ("quat", "axisangle", "xyaxes", "zaxis", "euler")


@dataclass(frozen=True)
class Patched:
    """Patched robot file."""

    text: str
    format: str  # MJCF or URDF
    #: wanted numbers that the file does not hold, as its format or its other entries do not allow them, SI
    missing: Mapping[Key, float]


def patched(text: str, where: str, wanted: Mapping[Key, float]) -> Patched:
    """Return a robot file with other numbers, and those of them that MuJoCo then does not read of it."""
    robot = compiled(text, where)
    found, written = numbers(robot), text
    all_of_it = consistent(robot, {**found, **wanted})
    # what MuJoCo computes of a number, such as kv of dampratio and an armature, is written in a second pass
    for _ in range(2):
        changed = differing(all_of_it, found)
        if not changed:
            break
        tree = RobotTree.of(written)
        _check_names(tree, robot, where)
        _write(tree, robot, all_of_it, changed)
        written = str(tree)
        found = numbers(compiled(written, where))
    return Patched(written, "URDF" if RobotTree.of(text).urdf else "MJCF", differing(all_of_it, found))


def _check_names(tree: RobotTree, robot: Robot, where: str) -> None:
    for kind, known in (("body", robot.bodies), ("joint", robot.joints), ("actuator", robot.actuators)):
        for element in known:
            if element.name not in tree.elements[kind]:
                raise BadInput(f"{where}: {kind} {element.name!r} is not found in the file: give it a name")


def _write(tree: RobotTree, robot: Robot, wanted: Mapping[Key, float], changed: Mapping[Key, float]) -> None:
    """Write numbers into the elements of a file, as far as its format can say them."""
    for joint in robot.joints:
        element, new = tree.elements["joint"][joint.name], of(changed, joint.name, OF_JOINTS)
        for quantity, value in new.items():
            if not tree.urdf:
                turned = quantity == "springref" and tree.degrees and not joint.slides
                element.set(quantity, row(degrees(value) if turned else value))
            elif quantity in _DYNAMICS:
                _inside(element, "dynamics").set(_DYNAMICS[quantity], row(value))
    for actuator in robot.actuators:  # of an MJCF
        element, new = tree.elements["actuator"][actuator.name], of(changed, actuator.name, OF_ACTUATORS)
        _actuator(element, of(wanted, actuator.name, OF_ACTUATORS), new)
    for body in robot.bodies:
        if new := of(changed, body.name, OF_BODIES):
            write = _inertial_of_urdf if tree.urdf else _inertial_of_mjcf
            write(tree.elements["body"][body.name], of(wanted, body.name, OF_BODIES), new)


def _actuator(element: ET.Element, wanted: Mapping[str, float], new: Mapping[str, float]) -> None:
    if "gear" in new:
        _, *others = (element.get("gear") or "1").split()
        element.set("gear", " ".join([row(new["gear"]), *others]))
    if "timeconst" in new and element.tag == "position":
        element.set("timeconst", row(new["timeconst"]))
    elif "timeconst" in new and element.tag != "general":
        # no other kind has a time constant, and general ones say all that a motor or a velocity servo says
        new = {**{q: wanted[q] for q in ("gain", "bias", "kp", "kv") if wanted[q]}, **new}
        element.tag = "general"
        element.attrib.pop("kv", None)
    if element.tag == "general":
        if "gain" in new:
            _, *others = (element.get("gainprm") or "1").split()
            element.set("gainprm", " ".join([row(new["gain"]), *others]))
        if new.keys() & {"bias", "kp", "kv"}:
            element.set("biastype", "affine")
            element.set("biasprm", row(wanted["bias"], -wanted["kp"], -wanted["kv"]))
        if "timeconst" in new:
            element.set("dyntype", "filterexact")
            element.set("dynprm", row(new["timeconst"]))
    for quantity in ("kp", "kv"):
        if quantity in new and element.tag in ("position", "velocity"):
            element.set(quantity, row(new[quantity]))
            element.attrib.pop("dampratio", None)
    for kind in ("ctrl", "force"):
        ends = wanted[f"{kind}_low"], wanted[f"{kind}_high"]
        if new.keys() & {f"{kind}_low", f"{kind}_high"} and inf not in map(abs, ends):
            element.set(f"{kind}range", row(*ends))
            element.set(f"{kind}limited", "true")


def _inertial_of_mjcf(element: ET.Element, wanted: Mapping[str, float], new: Mapping[str, float]) -> None:
    inertial = element.find("inertial")
    if inertial is None:  # its mass came from its geoms
        inertial = ET.Element("inertial")
        inertial.tail = element.text
        element.insert(0, inertial)
        new = wanted
    if "mass" in new:
        inertial.set("mass", row(wanted["mass"]))
    if any(quantity.startswith("com_") for quantity in new):
        inertial.set("pos", row(*(wanted[q] for q in OF_BODIES if q.startswith("com_"))))
    if any(quantity.startswith("inertia_") for quantity in new):
        for name in (*_TURNED, "diaginertia"):
            inertial.attrib.pop(name, None)
        inertial.set("fullinertia", row(*(wanted[q] for q in OF_BODIES if q.startswith("inertia_"))))


def _inertial_of_urdf(link: ET.Element, wanted: Mapping[str, float], new: Mapping[str, float]) -> None:
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
