"""Writer of numbers into the elements of an MJCF file."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from math import degrees, inf

from unmodelled.systems.robot.bodies import Joint, Robot
from unmodelled.systems.robot.numbers import OF_ACTUATORS, OF_BODIES, OF_JOINTS, Key, of
from unmodelled.systems.robot.tree import RobotTree, row

#: Attributes that turn the axes of an inertia.
_TURNED = ("quat", "axisangle", "xyaxes", "zaxis", "euler")


def write(tree: RobotTree, robot: Robot, wanted: Mapping[Key, float], changed: Mapping[Key, float]) -> None:
    """Write numbers into the elements of a file, as far as MJCF can say them."""
    for joint in robot.joints:
        new = of(changed, joint.name, OF_JOINTS)
        _joint(tree.elements["joint"][joint.name], joint, new, tree.degrees)
    for actuator in robot.actuators:
        new = of(changed, actuator.name, OF_ACTUATORS)
        element = tree.elements["actuator"][actuator.name]
        _actuator(element, of(wanted, actuator.name, OF_ACTUATORS), new)
    for body in robot.bodies:
        if new := of(changed, body.name, OF_BODIES):
            _body(tree.elements["body"][body.name], of(wanted, body.name, OF_BODIES), new)


def _joint(element: ET.Element, joint: Joint, new: Mapping[str, float], in_degrees: bool) -> None:
    for quantity, value in new.items():
        turned = quantity == "springref" and in_degrees and not joint.slides
        element.set(quantity, row(degrees(value) if turned else value))


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


def _body(element: ET.Element, wanted: Mapping[str, float], new: Mapping[str, float]) -> None:
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
