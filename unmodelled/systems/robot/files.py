"""Reader of robot files: MJCF (MuJoCo) and URDF, compiled by MuJoCo.

MuJoCo gets what the equations of motion need and no more: nothing outside the file is read, and no mesh.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

from unmodelled.base.errors import BadInput

#: Largest robot file, bytes.
LARGEST = 10_000_000
#: Parts of an MJCF file that its dynamics do not need.
_UNNEEDED = frozenset(
    {"asset", "visual", "statistic", "sensor", "keyframe", "contact", "custom", "size", "site", "camera"}
    | {"light", "material", "mesh", "texture", "pair", "hfield", "skin", "numeric", "text"}
    | {"equality", "tendon"}
)
#: Parts of an MJCF file that change its dynamics in ways that the equations here cannot follow.
_REFUSED = {
    "include": "copy what the file includes into it",
    "extension": "remove the plugin",
    "plugin": "remove the plugin",
    "attach": "write the attached bodies out",
    "composite": "write its bodies out",
    "flexcomp": "remove the deformable body",
    "deformable": "remove the deformable body",
    "replicate": "write the repeated bodies out",
}
_REFUSED_TYPES = {"floating", "planar"}
#: Elements that hold each other, and how many of them are read.
_NESTED, MOST_BODIES = frozenset({"body", "link", "frame", "default"}), 1000
_PLACES = ("meshdir", "texturedir", "assetdir", "fusestatic")


def robot_text(path: Path) -> str:
    """Read a robot file as text.

    Args:
        path: MJCF or URDF file.

    Raises:
        BadInput: if the file cannot be read or is not UTF-8.
    """
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise BadInput(f"{path}: not UTF-8 text: save the file in UTF-8") from None
    except OSError as error:
        raise BadInput(f"{path}: cannot be read: {error.strerror}: check its permissions") from None


def dynamics_only(text: str, where: str) -> tuple[str, bool]:
    """Return the part of a robot file that its dynamics need.

    Args:
        text: content of an MJCF or URDF file.
        where: start of the error message, such as the path of the file.

    Returns:
        MJCF or URDF without meshes and without references to other files, and whether it is URDF.

    Raises:
        BadInput: if the text is no MJCF and no URDF, or has parts that the equations cannot follow.

    Examples:
        >>> xml = '<robot name="r"><link name="a"><visual><mesh filename="/x"/></visual></link></robot>'
        >>> dynamics_only(xml, "r.urdf")
        ('<robot name="r"><link name="a" /><mujoco><compiler fusestatic="false" /></mujoco></robot>', True)
    """
    if re.search(r"<!(DOCTYPE|ENTITY)", text, re.IGNORECASE):
        raise BadInput(f"{where}: a robot file has no DOCTYPE and no entities: remove them")
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        raise BadInput(f"{where}: line {error.position[0]}: not an XML file: {error}") from None
    for element in root.iter():
        if "xacro" in element.tag:
            raise BadInput(f"{where}: {element.tag.split('}')[-1]}: a xacro file: expand it with xacro first")
    if root.tag not in ("mujoco", "robot"):
        raise BadInput(f"{where}: must begin with <mujoco> (MJCF) or <robot> (URDF), got <{root.tag[:40]}>")
    # what ROS and simulators add to a URDF, plugins for instance, is not read
    refused = _REFUSED if root.tag == "mujoco" else {"include"}
    for element in root.iter():
        if element.tag in refused:
            raise BadInput(f"{where}: {named(element)}: cannot be followed: {_REFUSED[element.tag]}")
    nested = sum(element.tag in _NESTED for element in root.iter())
    if nested > MOST_BODIES:
        raise BadInput(
            f"{where}: has {nested} bodies, at most {MOST_BODIES} are read: remove what moves nothing"
        )
    urdf = root.tag == "robot"
    (_strip_urdf if urdf else _strip_mjcf)(root, where)
    return ET.tostring(root, encoding="unicode"), urdf


def named(element: ET.Element) -> str:
    """Return an element with its name, for a message.

    Args:
        element: element of the file.
    """
    name = element.get("name") or element.get("joint") or element.get("class")
    return f"{element.tag} {name!r}" if name else element.tag


def _strip_urdf(root: ET.Element, where: str) -> None:
    for joint in root.iter("joint"):
        kind = joint.get("type", "")
        if kind in _REFUSED_TYPES:
            words = "only revolute, continuous, prismatic and fixed joints have equations here: fix it"
            raise BadInput(f"{where}: {named(joint)}: of type {kind}: {words}")
        if joint.find("mimic") is not None:
            words = "a closed chain has no equations here: remove mimic, or lock the joint"
            raise BadInput(f"{where}: {named(joint)}: follows another joint (mimic): {words}")
    for element in [*root]:
        if element.tag not in ("link", "joint"):
            root.remove(element)
    links = {link.get("name") for link in root.iter("link")}
    for parent in root.findall("joint/parent"):
        if parent.get("link") not in links:  # often that of the world
            links.add(parent.get("link"))
            ET.SubElement(root, "link", name=str(parent.get("link")))
    for link in root.iter("link"):
        for element in [*link]:
            if element.tag != "inertial":
                link.remove(element)
    ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", fusestatic="false")


def _strip_mjcf(root: ET.Element, where: str) -> None:
    for constraint in root.findall("equality/*"):
        if constraint.get("active") != "false":
            words = "a closed chain has no equations here: remove it, or lock a joint"
            raise BadInput(f"{where}: equality {named(constraint)}: {words}")
    for tendon in root.findall("tendon/*"):
        raise BadInput(f"{where}: tendon {named(tendon)}: has no equations here: remove it")
    for actuator in root.findall("actuator/*"):
        if actuator.get("joint") is None and actuator.get("jointinparent") is None:
            words = "only actuators of a joint have equations here: remove it"
            raise BadInput(f"{where}: actuator {named(actuator)}: {words}")
    for compiler in root.findall("compiler"):
        for key in _PLACES:
            compiler.attrib.pop(key, None)
    for world in root.findall("worldbody"):
        for holder in _holders(world):
            for geom in holder.findall("geom"):
                holder.remove(geom)
    from_geoms = any(c.get("inertiafromgeom") == "true" for c in root.findall("compiler"))
    for parent in [*root.iter()]:
        if parent.tag == "body":
            _strip_geoms(parent, from_geoms, where)
        for element in [*parent]:
            if element.tag in _UNNEEDED:
                parent.remove(element)
    for geom in root.iter("geom"):
        for key in ("material", "mesh", "hfield"):
            geom.attrib.pop(key, None)
        if geom.get("type") in ("mesh", "hfield", "sdf"):
            geom.attrib.pop("type")


def _strip_geoms(body: ET.Element, from_geoms: bool, where: str) -> None:
    """Remove the geoms of a body whose mass is given; the mass of the others comes from their geoms."""
    for holder in _holders(body):
        for geom in holder.findall("geom"):
            if body.find("inertial") is not None and not from_geoms:
                holder.remove(geom)
            elif geom.get("mesh") or geom.get("hfield"):
                words = "its mass comes from a mesh, which is not read: give it an inertial"
                raise BadInput(f"{where}: {named(body)}: {words}")


def _holders(body: ET.Element) -> Iterator[ET.Element]:
    """A body and the frames in it, which may hold its geoms."""
    yield body
    for frame in body.findall("frame"):
        yield from _holders(frame)
